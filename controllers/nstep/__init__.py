"""N-step capture regions (Koolen) as MOA sets: which DCM comes to rest in N footholds, where to land, and why."""

from controllers.nstep.certificate import certify_steps
from controllers.nstep.foothold import Foothold, choose_foothold
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import StepSets, step_sets

__all__ = ["Foothold", "StepLimits", "StepSets", "certify_steps", "choose_foothold", "step_sets"]
