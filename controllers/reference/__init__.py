"""Walking references of the paper's Section IV: COG and ZMP from rest to rest over planned footholds."""

from controllers.reference.reference import Reference, ReferenceViolation
from controllers.reference.walking_reference import WalkPlan, walk_plan

__all__ = ["Reference", "ReferenceViolation", "WalkPlan", "walk_plan"]
