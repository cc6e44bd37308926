"""Whole-body layer of a statue: it holds the joint angles of the first tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, JointTargets, Observation
from controllers.registry import NoOptions
from models.robot import Robot

Array = NDArray[np.float64]


class HeldPose:
    """The joint angles of the first tick as targets, whatever is commanded."""

    def __init__(self, robot: Robot, dt: float, options: NoOptions) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the last episode's pose."""
        self._pose: Array | None = None

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """The pose of the first tick; the command is ignored."""
        if self._pose is None:
            self._pose = observation.configuration[7:].copy()
        still = np.zeros_like(self._pose)
        return JointTargets(position=self._pose, velocity=still, torque=still)
