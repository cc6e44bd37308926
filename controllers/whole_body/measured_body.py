"""Kinematics of the body that the estimators believe in."""

from __future__ import annotations

import math

import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.multibody.tree import BODY, MOTION, SOLE, Records, hang, momentum
from controllers.whole_body.placo_model import PlacoModel
from models.arena import SIDES
from models.robot import TRUNK, Robot

Array = NDArray[np.float64]


class MeasuredBody:
    """The nominal body at measured joints. What it finds is written over by its next call.

    Attributes:
        soles: (2,) of `MOTION`, the left and the right one in the world, of the state that was placed.
        sole_places: (2, 3) of their middles [m].
        cog, cog_velocity, angular_momentum: (3,) of the whole body, the last about the COG [m, m/s, N m s].
    """

    def __init__(self, robot: Robot) -> None:
        # placo reads the file, and pinocchio, which it stands on, tells how the bodies hang together
        self._bodies, self._hung = bodies_of(PlacoModel(robot).wrapper.model)
        count = len(self._bodies)
        self._motions, self._from_trunk = np.zeros(count, MOTION), np.zeros(count, MOTION)
        self._joints, self._rates = np.zeros(6 + count), np.zeros(5 + count)
        self._joints[3] = 1.0
        self._by_joints, self.soles = np.zeros(2, MOTION), np.zeros(2, MOTION)
        self.sole_places, self._sole_axes = self.soles["p"], self.soles["R"]
        found = self._found = np.zeros((3, 3))
        self.cog, self.cog_velocity, self.angular_momentum = found[0], found[1], found[2]
        self._trunk_com, trunk = self._bodies["com"][0], self._motions[:1]
        self._trunk_at, self._trunk_axes = trunk["p"][0], trunk["R"][0]

    def by_joints(self, position: Array, velocity: Array) -> Records:
        """(2,) of `MOTION`: the soles as joint angles (n,) [rad] and speeds (n,) [rad/s] move them, from the trunk."""
        self._joints[7:], self._rates[6:] = position, velocity
        hang(self._bodies, self._hung, self._joints, self._rates, self._from_trunk, self._by_joints)
        return self._by_joints

    def place(self, configuration: Array, velocity: Array) -> None:
        """Take a state of the whole body, in the order of `Observation`, for the attributes and `trunk_com`."""
        hang(self._bodies, self._hung, configuration, velocity, self._motions, self.soles)
        momentum(self._bodies, self._motions, self._found)

    def yaw(self, sole: int) -> float:
        """Heading of the left (0) or right (1) sole in the world [rad]."""
        axes = self._sole_axes[sole]
        return math.atan2(axes[1, 0], axes[0, 0])

    @property
    def trunk_com(self) -> Array:
        """(3,) of the trunk alone [m]."""
        where: Array = self._trunk_at + self._trunk_axes @ self._trunk_com
        return where


def bodies_of(model: pinocchio.Model) -> tuple[Records, Records]:
    """The bodies of a model, (b,) of `BODY`, and the soles, (2,) of `SOLE`.

    Raises:
        ValueError: if its trunk does not float, or if a joint is no hinge.
    """
    joints = range(1, model.njoints)  # joint 0 of pinocchio is the world
    units = [_unit(model.joints[i]) for i in joints[1:]]
    if model.frames[model.getFrameId(TRUNK)].parentJoint != 1 or not all(map(_turns, units)):
        raise ValueError("the trunk must float, and every other joint must be a hinge")
    bodies, soles = np.zeros(len(joints), BODY), np.zeros(len(SIDES), SOLE)
    for i, body in zip(joints, bodies, strict=True):
        place, inertia = model.jointPlacements[i], model.inertias[i]
        body["parent"], body["place"], body["turned"] = model.parents[i] - 1, place.translation, place.rotation
        body["mass"], body["com"], body["inertia"] = inertia.mass, inertia.lever, inertia.inertia
        if i > 1:
            body["axis"] = units[i - 2][3:]
    for side, sole in zip(SIDES, soles, strict=True):
        frame = model.frames[model.getFrameId(f"{side}_sole")]
        sole["body"], sole["place"] = frame.parentJoint - 1, frame.placement.translation
        sole["turned"] = frame.placement.rotation
    return bodies, soles


def _unit(joint: pinocchio.JointModel) -> Array:
    """Velocity of a joint at unit speed, linear above angular; (6,) if it has one way to move."""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.nq), np.ones(joint.nv))
    return np.ravel(data.S)


def _turns(unit: Array) -> bool:
    return unit.shape == (6,) and not unit[:3].any() and bool(np.isclose(np.linalg.norm(unit[3:]), 1.0))
