"""All sensors of a robot: each at its rate, and what they say late by the latency."""

from __future__ import annotations

from collections import deque

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.senses import Reading
from models.robot import Robot, Side
from scenarios.schema import Scenario
from scenarios.sensing import steps_between
from sim.sensing.encoder import Encoders
from sim.sensing.foot_force import FootForce
from sim.sensing.imu import InertialUnit

Array = NDArray[np.float64]


class Sensors:
    """Measures after every physics step, and hands out what has arrived. For one episode."""

    def __init__(self, scenario: Scenario, robot: Robot, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Put the sensors on.

        Args:
            scenario: gives figures, latency and seed.
            robot: who carries them.
            model: the world's.
            data: the state of the world.
        """
        sensing, seed = scenario.sensing, scenario.seed
        joint, imu, foot = sensing.joint_figures, sensing.imu_figures, sensing.foot_figures
        self._angles, self._physics = data.qpos[7:], scenario.timing.physics
        self._encoders = Encoders(joint, len(robot.joint_names), seed)
        self._imu = InertialUnit(imu, robot, model, data, seed)
        self._feet = FootForce(foot, robot, model, data, seed)
        self._every = [steps_between(figures.rate, self._physics) for figures in (joint, imu, foot)]
        self._late = round(sensing.latency / self._physics)
        self._under_way: deque[tuple[int, Array, Array, dict[Side, float], dict[Side, Array]]] = deque()
        self._angle, self._motion = np.empty(0), np.empty(0)
        self._force: dict[Side, float] = {}
        self._centre: dict[Side, Array] = {}

    def sample(self, step: int) -> None:
        """Measure with all sensors whose turn it is; to be called at the start and after every physics step."""
        if not step:
            self._feet.follow()  # the robot may have been put into its stand since
        joint, imu, foot = self._every
        if by_joint := step % joint == 0:
            self._angle = self._encoders.measure(self._angles)
        if by_imu := step % imu == 0:
            self._motion = self._imu.measure()
        if by_foot := step % foot == 0:
            self._force, self._centre = self._feet.measure()
        self._feet.follow()
        if by_joint or by_imu or by_foot:
            self._under_way.append((step, self._angle, self._motion, self._force, self._centre))

    def arrived(self, step: int, time: float) -> list[Reading]:
        """What has arrived after so many physics steps and was not handed out yet, oldest first.

        Args:
            step: physics steps done.
            time: of the control tick that begins now [s].
        """
        found = []
        while self._under_way and self._under_way[0][0] <= step - self._late:
            taken, angle, motion, force, centre = self._under_way.popleft()
            found.append(
                Reading(
                    time=time,
                    taken=taken * self._physics,
                    joint_position=angle,
                    gyro=motion[0],
                    accelerometer=motion[1],
                    force=force,
                    cop=centre,
                )
            )
        return found
