"""Which feet stand, and how many steps that makes."""

from __future__ import annotations

from controllers.interface import JointTargets, Observation
from models.arena import SIDES
from models.robot import Side
from sim.episode.plant import Action


class StepCount:
    """Counts the feet that stood and do not any more."""

    def __init__(self) -> None:
        self._count = 0
        self._stood: dict[Side, bool] = dict.fromkeys(SIDES, True)

    def see(self, stands: dict[Side, bool]) -> int:
        """Steps begun so far, with those of this tick."""
        self._count += sum(self._stood[side] and not stands[side] for side in SIDES)
        self._stood = stands
        return self._count


def standing_feet(observation: Observation, action: Action) -> dict[Side, bool]:
    """Which feet are to stand by an action, or, if it is of the joints, which carry weight."""
    if isinstance(action, JointTargets):
        return {side: observation.feet[side].force > 0.0 for side in SIDES}
    return {side: action.feet[side].stance for side in SIDES}
