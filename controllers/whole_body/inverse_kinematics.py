"""Whole-body layer by inverse kinematics: placo's KinematicsSolver with gravity and contact-wrench feed-forward.

The ZMP command is integrated to a COG reference (1)-(2) that leaks towards the measured COG; joint angles follow by
kinematics, and the torque that the wanted floor force needs goes along, without which the servos' give would lag the
ZMP by tens of milliseconds.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import placo
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, FootReference, JointTargets, Observation
from controllers.registry import NoOptions
from controllers.whole_body.placo_model import PlacoModel, body_tasks, friction_torque
from models.arena import SIDES
from models.robot import Robot, Side

Array = NDArray[np.float64]

FOOT_WEIGHT, COG_WEIGHT, TRUNK_WEIGHT, POSTURE_WEIGHT, REGULARISATION = 10.0, 1.0, 0.3, 1e-2, 1e-6
COG_LEAK = 20.0  # towards the measured COG [1/s]
ANCHOR_LEAK = 10.0  # of a stance foot's anchor towards where the foot really is [1/s]
# The wanted centre of pressure of a foot stays this far inside its sole [m].
SOLE_MARGIN = 0.002
FIRST_SOLVES = 50  # from the measured pose to the solver's own first solution


class IkWholeBody:
    """Inverse kinematics by a weighted QP, from the solver's own last pose."""

    def __init__(self, robot: Robot, dt: float, options: NoOptions) -> None:
        """Build the solver once; it is reused over episodes.

        Args:
            robot: the body.
            dt: control period [s].
            options: none.
        """
        self._robot = robot
        self._dt = dt
        self._model = PlacoModel(robot)
        self._omega_squared = robot.omega**2
        self._half_sole = 0.5 * np.ptp(robot.sole_vertices["left"], axis=0) - SOLE_MARGIN
        self._solver = solver = self._model.wrapper.make_solver()
        solver.dt = dt
        solver.enable_joint_limits(True)
        wrapper = self._model.wrapper
        for name, speed in zip(robot.joint_names, robot.no_load_speed, strict=True):
            wrapper.set_velocity_limit(name, float(speed))
        solver.enable_velocity_limits(True)
        self._foot: dict[Side, placo.FrameTask] = {}
        for side in SIDES:
            self._foot[side] = solver.add_frame_task(f"{side}_sole", np.eye(4))
            self._foot[side].configure(f"{side}_foot", "soft", FOOT_WEIGHT, FOOT_WEIGHT)
        self._cog = body_tasks(solver, robot, cog=COG_WEIGHT, trunk=TRUNK_WEIGHT, posture=POSTURE_WEIGHT).cog
        solver.add_regularization_task(REGULARISATION)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode's pose, COG reference and anchors."""
        self._started = False
        self._reference = np.zeros((2, 2))  # COG position and velocity, horizontal
        self._anchor: dict[Side, Array | None] = dict.fromkeys(SIDES)
        self._last: JointTargets | None = None

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """See `WholeBodyLayer.targets`. A QP without answer keeps the last targets and says so."""
        if not self._started:
            self._start(observation, command)
        acceleration = self._advance_reference(observation, command.zmp)
        self._aim(observation, command)
        before = self._model.wrapper.state.q[7:].copy()
        position = self._solve()
        if position is None:
            # The reference that led here is not worth keeping: begin anew from what is measured next.
            self._started = False
            last = self._last or _hold(observation)
            return replace(last, velocity=np.zeros_like(last.velocity), solver_failed=True)
        velocity = (position - before) / self._dt
        torque = self._feed_forward(observation, command, acceleration) + friction_torque(self._robot, velocity)
        self._last = JointTargets(position=position, velocity=velocity, torque=torque)
        return self._last

    def _solve(self) -> Array | None:
        """Joint angles (n,) of the next pose, or None: placo raises when its QP has no answer."""
        try:
            self._solver.solve(True)
        except RuntimeError:
            return None
        self._model.wrapper.update_kinematics()
        position: Array = self._model.wrapper.state.q[7:].copy()
        return position if np.isfinite(position).all() else None

    def _start(self, observation: Observation, command: BalanceCommand) -> None:
        self._started = True
        self._model.set_state(observation.configuration, np.zeros_like(observation.velocity))
        self._reference = np.array([observation.cog[:2], observation.cog_velocity[:2]])
        self._aim(observation, command)
        for _ in range(FIRST_SOLVES):
            self._solve()

    def _advance_reference(self, observation: Observation, zmp: Array) -> Array:
        """One tick of the COG reference; returns the COG acceleration (2,) that the command means (1)-(2)."""
        acceleration = self._omega_squared * (observation.cog[:2] - zmp)
        position, velocity = self._reference
        position += velocity * self._dt
        velocity += acceleration * self._dt
        leak = min(1.0, COG_LEAK * self._dt)
        position += leak * (observation.cog[:2] - position)
        velocity += leak * (observation.cog_velocity[:2] - velocity)
        return acceleration

    def _aim(self, observation: Observation, command: BalanceCommand) -> None:
        self._cog.target_world = np.array([*self._reference[0], self._robot.cog_height])
        leak = min(1.0, ANCHOR_LEAK * self._dt)
        for side in SIDES:
            reference = command.feet[side]
            pose = _upright(reference)
            if reference.stance:
                measured, anchor = observation.feet[side].position, self._anchor[side]
                anchor = measured.copy() if anchor is None else anchor + leak * (measured - anchor)
                self._anchor[side] = anchor
                pose[:2, 3] = anchor[:2]
            else:
                self._anchor[side] = None
                pose[:3, 3] = reference.position
            self._foot[side].T_world_frame = pose

    def _feed_forward(self, observation: Observation, command: BalanceCommand, acceleration: Array) -> Array:
        """Joint torques (n,) that hold gravity against the floor force of the command, shared by the feet."""
        robot, wrapper = self._robot, self._model.wrapper
        force = robot.mass * np.array([acceleration[0], acceleration[1], robot.gravity])
        torque = wrapper.generalized_gravity().copy()
        shares = _shares(observation, command)
        middle = sum((share * observation.feet[side].position[:2] for side, share in shares.items()), np.zeros(2))
        for side, share in shares.items():
            if share <= 0.0:
                continue
            cos, sin = math.cos(command.feet[side].yaw), math.sin(command.feet[side].yaw)
            axes = np.array([[cos, sin], [-sin, cos]])
            offset = axes @ (command.zmp - middle)
            lever = axes.T @ np.clip(offset, -self._half_sole, self._half_sole)
            part = share * force
            moment = np.array([lever[1] * part[2], -lever[0] * part[2], lever[0] * part[1] - lever[1] * part[0]])
            jacobian = wrapper.frame_jacobian(f"{side}_sole", "local_world_aligned")
            torque -= jacobian.T @ np.concatenate([part, moment])
        return torque[6:]


def _hold(observation: Observation) -> JointTargets:
    """Targets that keep the measured pose without feed-forward."""
    position = observation.configuration[7:].copy()
    still = np.zeros_like(position)
    return JointTargets(position=position, velocity=still, torque=still)


def _shares(observation: Observation, command: BalanceCommand) -> dict[Side, float]:
    """Share of the floor force that each foot takes, by where the ZMP is along the line between them."""
    left, right = command.feet["left"].stance, command.feet["right"].stance
    if not (left and right):
        return {"left": float(left), "right": float(right)}
    origin = observation.feet["right"].position[:2]
    apart = observation.feet["left"].position[:2] - origin
    share = float((command.zmp - origin) @ apart / (apart @ apart))
    share = min(1.0, max(0.0, share))
    return {"left": share, "right": 1.0 - share}


def _upright(reference: FootReference) -> Array:
    """(4, 4) pose of a level sole with the reference's heading at the origin."""
    pose = np.eye(4)
    cos, sin = math.cos(reference.yaw), math.sin(reference.yaw)
    pose[0, 0], pose[0, 1], pose[1, 0], pose[1, 1] = cos, -sin, sin, cos
    return pose
