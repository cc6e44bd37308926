"""Whole-body layer by inverse dynamics: placo's DynamicsSolver on the measured state.

Accelerations of the COG, the feet and the trunk are asked for; the solver finds joint torques and contact wrenches
inside the soles and friction cones that give them. The torques go to the servos as feed-forward.
"""

from __future__ import annotations

import math

import numpy as np
import placo
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, FootReference, JointTargets, Observation
from controllers.registry import NoOptions
from controllers.whole_body.placo_model import PlacoModel, body_tasks, friction_torque
from controllers.whole_body.servo_drag import ServoDrag
from models.arena import SIDES
from models.robot import Robot, Side

Array = NDArray[np.float64]

# Weights of the soft tasks, and stiffness [1/s^2] and damping [1/s] of each; those of height, trunk and posture are of
# a robot of scale 1.
COG_WEIGHT, STANCE_WEIGHT, TRUNK_WEIGHT, POSTURE_WEIGHT = 10.0, 50.0, 1.0, 1e-2
# A quick step asks for more than the motors have. The way of the swing foot gives way before the COG and the trunk do.
SWING_WEIGHT = 10.0
HEIGHT_STIFFNESS, HEIGHT_DAMPING = 200.0, 28.0
SWING_POSITION, SWING_ORIENTATION = (900.0, 60.0), (400.0, 40.0)
STANCE_POSITION, STANCE_ORIENTATION = (0.0, 20.0), (400.0, 40.0)
TRUNK_GAINS, POSTURE_GAINS = (100.0, 20.0), (100.0, 20.0)
# The solver's soles are a little smaller than the real ones, so that what it plans does not tip them.
SOLE_MARGIN = 0.005
FRICTION = 0.7


class DynamicsWholeBody:
    """Inverse dynamics by a weighted QP, every tick from the measured state."""

    follows_acceleration = True

    def __init__(self, robot: Robot, dt: float, options: NoOptions) -> None:
        """Build the solver once; it is reused over episodes.

        Args:
            robot: the body.
            dt: control period [s].
            options: none.
        """
        self._robot = robot
        self._model = PlacoModel(robot)
        self._drag = ServoDrag(robot, self._model.wrapper.model, dt)
        self._omega_squared = robot.omega**2
        self._solver = solver = placo.DynamicsSolver(self._model.wrapper)
        solver.dt = dt
        # Stall torques bound what is asked for: without them the hips were asked for five times that. The rest of the
        # torque-speed line is the world's to enforce: with it in the QP, or a limit on speed, whole tasks were given
        # up and fewer pushes recovered from.
        solver.enable_joint_limits(False)
        solver.enable_velocity_limits(False)
        for name, torque in zip(robot.joint_names, robot.stall_torque.tolist(), strict=True):
            self._model.wrapper.set_torque_limit(name, torque)
        solver.enable_torque_limits(True)
        solver.torque_cost = 1e-4

        length, width = np.ptp(robot.sole_vertices["left"], axis=0) - 2 * SOLE_MARGIN
        self._feet: dict[Side, placo.DynamicsFrameTask] = {}
        self._contacts: dict[Side, placo.Contact6D] = {}
        for side in SIDES:
            foot = solver.add_frame_task(f"{side}_sole", np.eye(4))
            foot.configure(f"{side}_foot", "soft", STANCE_WEIGHT, STANCE_WEIGHT)
            contact = solver.add_planar_contact(foot)
            contact.length, contact.width, contact.mu = float(length), float(width), FRICTION
            contact.weight_forces, contact.weight_moments, contact.weight_tangentials = 1e-4, 1e-2, 1e-4
            self._feet[side], self._contacts[side] = foot, contact
        self._position = {side: self._feet[side].position() for side in SIDES}
        self._orientation = {side: self._feet[side].orientation() for side in SIDES}
        tasks = body_tasks(solver, robot, cog=COG_WEIGHT, trunk=TRUNK_WEIGHT, posture=POSTURE_WEIGHT)
        self._cog = tasks.cog
        self._cog.kp = self._cog.kd = 0.0
        tasks.trunk.kp, tasks.trunk.kd = _slowed(TRUNK_GAINS, robot)
        tasks.posture.kp, tasks.posture.kd = _slowed(POSTURE_GAINS, robot)
        self._height_gains = _slowed((HEIGHT_STIFFNESS, HEIGHT_DAMPING), robot)
        self._pose = np.eye(4)
        self._stance: dict[Side, bool | None] = dict.fromkeys(SIDES)
        self._torque = np.zeros(len(robot.joint_names))

    def reset(self) -> None:
        """Forget the last episode's torque and contacts."""
        self._stance = dict.fromkeys(SIDES)
        self._torque = np.zeros(len(self._robot.joint_names))

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """See `WholeBodyLayer.targets`. A QP without answer keeps the last torque and says so."""
        self._model.set_state(observation.configuration, observation.velocity)
        self._aim_cog(observation, command)
        for side in SIDES:
            self._aim_foot(side, command.feet[side], observation.feet[side].position)
        torque = self._solve()
        if torque is not None:
            self._torque = torque
        return JointTargets(
            position=observation.configuration[7:],
            velocity=observation.velocity[6:],
            torque=self._torque + friction_torque(self._robot, observation.velocity[6:]),
            solver_failed=torque is None,
            from_seen=True,
        )

    def _solve(self) -> Array | None:
        """Joint torques (n,), or None: placo raises, or returns without success, when its QP has no answer."""
        try:
            result = self._solver.solve(False)
        except RuntimeError:
            return None
        if not result.success:
            return None
        torque: Array = result.tau[6:].copy()
        return torque if np.isfinite(torque).all() else None

    def _aim_cog(self, observation: Observation, command: BalanceCommand) -> None:
        cx, cy, cz = observation.cog.tolist()
        vz = float(observation.cog_velocity[2])
        w2, zmp = self._omega_squared, command.zmp
        stiffness, damping = self._height_gains
        x, y = w2 * (cx - zmp[0]), w2 * (cy - zmp[1])
        if all(command.feet[side].stance for side in SIDES):
            more_x, more_y = self._drag.made_up(observation.cog_velocity)
            x, y = x + more_x, y + more_y
        rise = stiffness * (self._robot.cog_height - cz) - damping * vz
        self._cog.ddtarget_world = np.array([x, y, rise])

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
            position.kp, position.kd = (0.0, 0.0) if reference.feedback else SWING_POSITION
        self._feet[side].T_world_frame = pose
        if self._stance[side] is not reference.stance:
            self._stance[side] = reference.stance
            self._contacts[side].active = reference.stance
            weight = STANCE_WEIGHT if reference.stance else SWING_WEIGHT
            self._feet[side].configure(f"{side}_foot", "soft", weight, STANCE_WEIGHT)
            orientation.kp, orientation.kd = STANCE_ORIENTATION if reference.stance else SWING_ORIENTATION
            if reference.stance:
                position.kp, position.kd = STANCE_POSITION
                position.dtarget_world = position.ddtarget_world = np.zeros(3)


def _slowed(gains: tuple[float, float], robot: Robot) -> tuple[float, float]:
    """Stiffness [1/s^2] and damping [1/s] in the pendulum's time of a robot."""
    stiffness, damping = gains
    return stiffness / robot.scale.time**2, damping / robot.scale.time
