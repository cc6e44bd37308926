"""The QP of the inverse dynamics as placo's DynamicsSolver assembles and solves it."""

from __future__ import annotations

import math

import numpy as np
import placo
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, FootReference, Observation
from controllers.whole_body import dynamics_tasks as tasks
from controllers.whole_body.placo_model import PlacoModel, body_tasks
from models.arena import SIDES
from models.robot import Robot, Side

Array = NDArray[np.float64]


class PlacoDynamics:
    """Joint torques by placo."""

    def __init__(self, robot: Robot, model: PlacoModel, dt: float) -> None:
        """Build the solver once; it is reused over episodes.

        Args:
            robot: the body.
            model: of it; its state is set here.
            dt: control period [s].
        """
        self._model = model
        self._solver = solver = placo.DynamicsSolver(model.wrapper)
        solver.dt = dt
        # Stall torques bound what is asked for: without them the hips were asked for five times that. The rest of the
        # torque-speed line is the world's to enforce: with it in the QP, or a limit on speed, whole tasks were given
        # up and fewer pushes recovered from.
        solver.enable_joint_limits(False)
        solver.enable_velocity_limits(False)
        for name, torque in zip(robot.joint_names, robot.stall_torque.tolist(), strict=True):
            model.wrapper.set_torque_limit(name, torque)
        solver.enable_torque_limits(True)
        solver.torque_cost = tasks.TORQUE_WEIGHT

        self._feet: dict[Side, placo.DynamicsFrameTask] = {}
        self._contacts: dict[Side, placo.Contact6D] = {}
        for side in SIDES:
            foot = solver.add_frame_task(f"{side}_sole", np.eye(4))
            contact = solver.add_planar_contact(foot)
            contact.length, contact.width = tasks.sole_size(robot)
            contact.mu = tasks.FRICTION
            contact.weight_forces, contact.weight_moments = tasks.FORCE_WEIGHT, tasks.MOMENT_WEIGHT
            contact.weight_tangentials = tasks.TANGENTIAL_WEIGHT
            self._feet[side], self._contacts[side] = foot, contact
        self._position = {side: self._feet[side].position() for side in SIDES}
        self._orientation = {side: self._feet[side].orientation() for side in SIDES}
        posture = {name: tasks.POSTURE_WEIGHT * tasks.posture_share(robot, name) for name in robot.joint_names}
        body = body_tasks(solver, robot, cog=tasks.COG_WEIGHT, trunk=tasks.TRUNK_WEIGHT, posture=posture)
        self._cog = body.cog
        self._cog.kp = self._cog.kd = 0.0
        body.trunk.kp, body.trunk.kd = tasks.slowed(tasks.TRUNK_GAINS, robot)
        for pose in body.posture:
            pose.kp, pose.kd = tasks.slowed(tasks.POSTURE_GAINS, robot)
        self._pose = np.eye(4)
        self._stance: dict[Side, bool | None] = dict.fromkeys(SIDES)

    def torque(self, observation: Observation, command: BalanceCommand, acceleration: Array) -> Array | None:
        """Joint torques (n,) [N m]; None if there is no answer.

        Args:
            observation: the measured state.
            command: what the feet are to do.
            acceleration: (3,) that the COG is to have [m/s^2].
        """
        self._model.set_state(observation.configuration, observation.velocity)
        self._cog.ddtarget_world = acceleration
        for side in SIDES:
            self._aim_foot(side, command.feet[side], observation.feet[side].position)
        try:
            # it raises, or returns without success, when its QP has no answer
            result = self._solver.solve(False)
        except RuntimeError:
            return None
        if not result.success:
            return None
        torque: Array = result.tau[6:].copy()
        return torque if np.isfinite(torque).all() else None

    def _aim_foot(self, side: Side, reference: FootReference, measured: Array) -> None:
        position, orientation, pose = self._position[side], self._orientation[side], self._pose
        cos, sin = math.cos(reference.yaw), math.sin(reference.yaw)
        pose[0, 0], pose[0, 1], pose[1, 0], pose[1, 1] = cos, -sin, sin, cos
        if reference.stance:
            # Where the foot stands is where it shall stay: no pull towards a point it has slipped away from.
            pose[:3, 3] = measured[0], measured[1], 0.0
        else:
            pose[:3, 3] = reference.position
            position.dtarget_world = reference.velocity
            position.ddtarget_world = reference.acceleration
            position.kp, position.kd = (0.0, 0.0) if reference.feedback else tasks.SWING_POSITION
        self._feet[side].T_world_frame = pose
        if self._stance[side] is not reference.stance:
            self._stance[side] = reference.stance
            self._contacts[side].active = reference.stance
            weight = tasks.STANCE_WEIGHT if reference.stance else tasks.SWING_WEIGHT
            self._feet[side].configure(f"{side}_foot", "soft", weight, tasks.STANCE_WEIGHT)
            orientation.kp, orientation.kd = tasks.STANCE_ORIENTATION if reference.stance else tasks.SWING_ORIENTATION
            if reference.stance:
                position.kp, position.kd = tasks.STANCE_POSITION
                position.dtarget_world = position.ddtarget_world = np.zeros(3)
