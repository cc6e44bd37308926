"""The brain: the paper's sets, the supervisor and its baselines, whole-body layers. It knows no MuJoCo.

What a controller of your own needs is here by name; see README, "Your controller".
"""

from controllers.fields import File, Strict
from controllers.interface import (
    BalanceCommand,
    BalanceController,
    Decision,
    FootReference,
    FootState,
    JointController,
    JointTargets,
    Observation,
    Phase,
    Prediction,
    Region,
    Setting,
    WholeBodyLayer,
)
from controllers.senses import Estimator, Reading

__all__ = [
    "BalanceCommand",
    "BalanceController",
    "Decision",
    "Estimator",
    "File",
    "FootReference",
    "FootState",
    "JointController",
    "JointTargets",
    "Observation",
    "Phase",
    "Prediction",
    "Reading",
    "Region",
    "Setting",
    "Strict",
    "WholeBodyLayer",
]
