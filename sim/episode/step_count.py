"""Counts steps: by what is commanded of the feet or, under joint targets, by their contacts."""

from __future__ import annotations

import math

from controllers.interface import JointTargets, Observation
from models.arena import SIDES
from models.robot import Side
from sim.episode.plant import Action

# A foot that carries nothing for less than this has bounced and not stepped [s].
BOUNCE = 0.02


class StepCount:
    """Counts the feet that stood and do not any more: by what is commanded or, under joint targets, by contact."""

    def __init__(self) -> None:
        self._count = 0
        self._stood: dict[Side, bool] = dict.fromkeys(SIDES, True)
        self._loaded: dict[Side, float] = dict.fromkeys(SIDES, -math.inf)

    def standing(self, observation: Observation, action: Action) -> dict[Side, bool]:
        """Which feet are to stand by an action or, if it is of the joints, have carried weight just now."""
        if not isinstance(action, JointTargets):
            return {side: action.feet[side].stance for side in SIDES}
        for side in SIDES:
            if observation.feet[side].force > 0.0 or self._loaded[side] == -math.inf:
                self._loaded[side] = observation.time
        return {side: observation.time - self._loaded[side] < BOUNCE for side in SIDES}

    def see(self, stands: dict[Side, bool]) -> int:
        """Steps begun so far, with those of this tick."""
        self._count += sum(self._stood[side] and not stands[side] for side in SIDES)
        self._stood = stands
        return self._count
