"""Kinematics of the body that the estimators believe in, by pinocchio."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.whole_body.placo_model import PlacoModel, in_placo_order
from models.arena import SIDES
from models.robot import TRUNK, Robot, Side

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
        # placo reads the file; pinocchio, which it stands on, is asked for no more than is needed here
        self._model = PlacoModel(robot).wrapper.model
        self._data = self._model.createData()
        self._soles: dict[Side, int] = {side: self._model.getFrameId(f"{side}_sole") for side in SIDES}
        self._trunk = self._model.getFrameId(TRUNK)
        self._mass = robot.mass
        # joint 1 of pinocchio is the free joint
        self._trunk_com = np.array(self._model.inertias[1].lever)
        self._q, self._qd = pinocchio.neutral(self._model), np.zeros(self._model.nv)
        self._joints, self._rates = self._q.copy(), self._qd.copy()

    def soles(self, position: Array, velocity: Array) -> dict[Side, SoleMotion]:
        """Both soles at joint angles (n,) [rad] and speeds (n,) [rad/s]."""
        model, data, found = self._model, self._data, {}
        self._joints[7:], self._rates[6:] = position, velocity
        pinocchio.forwardKinematics(model, data, self._joints, self._rates)
        for side, frame in self._soles.items():
            pose = pinocchio.updateFramePlacement(model, data, frame)
            twist = pinocchio.getFrameVelocity(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
            parts = pose.translation, pose.rotation, twist.linear, twist.angular
            found[side] = SoleMotion(*(part.copy() for part in parts))
        return found

    def place(self, configuration: Array, velocity: Array) -> None:
        """Take a state of the whole body, in the order of `Observation`, for what follows."""
        in_placo_order(configuration, velocity, self._q, self._qd)
        self._momentum = pinocchio.computeCentroidalMomentum(self._model, self._data, self._q, self._qd)

    @property
    def cog(self) -> Array:
        """(3,) [m], of the state that was placed."""
        where: Array = self._data.com[0].copy()
        return where

    @property
    def cog_velocity(self) -> Array:
        """(3,) [m/s]."""
        velocity: Array = self._momentum.linear / self._mass
        return velocity

    @property
    def angular_momentum(self) -> Array:
        """(3,) about the COG [N m s]."""
        momentum: Array = self._momentum.angular.copy()
        return momentum

    @property
    def trunk_com(self) -> Array:
        """(3,) of the trunk alone [m]."""
        pose = pinocchio.updateFramePlacement(self._model, self._data, self._trunk)
        where: Array = pose.translation + pose.rotation @ self._trunk_com
        return where

    def sole(self, side: Side) -> tuple[Array, Array, float]:
        """Position (3,) of a sole's middle in the world [m], its rotation (3, 3), and its yaw [rad]."""
        pose = pinocchio.updateFramePlacement(self._model, self._data, self._soles[side])
        rotation: Array = pose.rotation.copy()
        return pose.translation.copy(), rotation, math.atan2(rotation[1, 0], rotation[0, 0])
