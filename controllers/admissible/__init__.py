"""The paper's sets: maximal output admissible sets of regulator and tracker, their limits and certificates."""

from controllers.admissible.certificate import certify
from controllers.admissible.gain_bank import gain_bank
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.limits import no_step_limit, recoverable_delta_v
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.admissible.tracking_sets import TrackingSets, tracking_sets

__all__ = [
    "EmptySetError",
    "MoaError",
    "MoaSet",
    "TrackingSets",
    "ZmpError",
    "certify",
    "gain_bank",
    "no_step_limit",
    "recoverable_delta_v",
    "regulator_set",
    "tracking_sets",
]
