"""Kinematics of the body that the estimators believe in, by placo."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.whole_body.placo_model import PlacoModel
from models.arena import SIDES
from models.robot import Robot, Side

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SoleMotion:
    """A sole as the joints move it, seen from the trunk.

    Attributes:
        position: (3,) of the sole's middle in the trunk's frame [m].
        rotation: (3, 3) from the sole's frame to the trunk's.
        velocity: (3,) of its middle relative to the trunk [m/s].
        turning: (3,) angular velocity relative to the trunk [rad/s].
    """

    position: Array
    rotation: Array
    velocity: Array
    turning: Array


class MeasuredBody:
    """The nominal body at measured joints."""

    def __init__(self, robot: Robot) -> None:
        self._model = PlacoModel(robot)
        self._mass = robot.mass
        # joint 1 of pinocchio is the free joint
        self._trunk_com = np.array(self._model.wrapper.model.inertias[1].lever)
        self._configuration = np.zeros(7 + len(robot.joint_names))
        self._configuration[3] = 1.0
        self._velocity = np.zeros(6 + len(robot.joint_names))

    def soles(self, position: Array, velocity: Array) -> dict[Side, SoleMotion]:
        """Both soles at joint angles (n,) [rad] and speeds (n,) [rad/s]."""
        self._configuration[7:], self._velocity[6:] = position, velocity
        self._model.set_state(self._configuration, self._velocity)
        wrapper, found = self._model.wrapper, {}
        for side in SIDES:
            pose = wrapper.get_T_world_frame(f"{side}_sole")
            twist = wrapper.frame_jacobian(f"{side}_sole", "local_world_aligned") @ self._velocity
            found[side] = SoleMotion(pose[:3, 3], pose[:3, :3], twist[:3], twist[3:])
        return found

    def place(self, configuration: Array, velocity: Array) -> None:
        """Take a state of the whole body, in the order of `Observation`, for what follows."""
        self._model.set_state(configuration, velocity)
        # placo's own order, base velocity in the base
        self._momentum = self._model.wrapper.centroidal_map() @ self._model.wrapper.state.qd

    @property
    def cog(self) -> Array:
        """(3,) [m], of the state that was placed."""
        where: Array = np.array(self._model.wrapper.com_world())
        return where

    @property
    def cog_velocity(self) -> Array:
        """(3,) [m/s]."""
        velocity: Array = self._momentum[:3] / self._mass
        return velocity

    @property
    def angular_momentum(self) -> Array:
        """(3,) about the COG [N m s]."""
        momentum: Array = self._momentum[3:].copy()
        return momentum

    @property
    def trunk_com(self) -> Array:
        """(3,) of the trunk alone [m]."""
        pose = self._model.wrapper.get_T_world_frame("trunk")
        where: Array = pose[:3, 3] + pose[:3, :3] @ self._trunk_com
        return where

    def sole(self, side: Side) -> tuple[Array, Array, float]:
        """Position (3,) of a sole's middle in the world [m], its rotation (3, 3), and its yaw [rad]."""
        pose = self._model.wrapper.get_T_world_frame(f"{side}_sole")
        return pose[:3, 3].copy(), pose[:3, :3].copy(), math.atan2(pose[1, 0], pose[0, 0])
