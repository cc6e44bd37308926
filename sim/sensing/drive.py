"""What the joints' drives make of a reference: each closes its loop on its own encoder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.interface import JointTargets, Observation
from models.robot import Robot
from scenarios.schema import Scenario
from sim.sensing.encoder import Encoders

Array = NDArray[np.float64]


class Drives:
    """Turns references into true joint angles, which the simulated servos act on. For one episode."""

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        sensing = scenario.sensing
        self._at_drive = sensing.at_drive
        offset = Encoders(sensing.joint_figures, len(robot.joint_names), scenario.seed).offset
        self._offset = offset if sensing.estimates and offset.any() else None

    def reference(self, targets: JointTargets, seen: Observation, angle: Array, speed: Array) -> JointTargets:
        """The targets in true angles.

        A drive that is told "where I see the joint" starts from where it finds the joint itself: then neither the
        latency nor the error of its encoder matters. Any other reference is off by the encoder's constant error.

        Args:
            targets: as the controllers gave them.
            seen: what these followed from.
            angle: (n,) true joint angles now [rad].
            speed: (n,) true joint velocities now [rad/s].
        """
        if targets.from_seen and self._at_drive:
            return replace(
                targets,
                position=angle + (targets.position - seen.configuration[7:]),
                velocity=speed + (targets.velocity - seen.velocity[6:]),
            )
        return targets if self._offset is None else replace(targets, position=targets.position - self._offset)
