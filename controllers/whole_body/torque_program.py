"""The QP of the inverse dynamics, assembled and solved by ourselves: placo's, at less than half of its cost."""

from __future__ import annotations

import daqp
import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, Observation
from controllers.multibody.torque_kernel import FOOT, Weights, assembled
from controllers.whole_body import dynamics_tasks as tasks
from controllers.whole_body.body_terms import BodyTerms
from models.arena import SIDES
from models.robot import Robot

Array = NDArray[np.float64]

_OPTIMAL = 1
# DAQP leaves no limit violated by more [N m, N].
_TOLERANCE = 1e-9


class TorqueProgram:
    """Joint torques by the weighted QP over joint accelerations and contact wrenches.

    Nothing is kept from one tick to the next: the same question has the same answer, to the bit.
    """

    def __init__(self, robot: Robot, model: pinocchio.Model) -> None:
        """Read from the robot what does not change.

        Args:
            robot: the body.
            model: of it, as placo read it.
        """
        self._terms = BodyTerms(robot, model)
        length, width = tasks.sole_size(robot)
        posture = np.array([name not in robot.leg_joints for name in robot.joint_names])
        # columns: stand [rad], whether the posture counts, most torque [N m]
        self._joints = np.column_stack([robot.stand[7:], posture, robot.stall_torque])
        trunk, pose = tasks.slowed(tasks.TRUNK_GAINS, robot), tasks.slowed(tasks.POSTURE_GAINS, robot)
        self._weights = Weights(
            mass=float(pinocchio.computeTotalMass(model)),
            gravity=-float(model.gravity.linear[2]),
            cog=tasks.COG_WEIGHT,
            orientation=tasks.STANCE_WEIGHT,
            trunk=tasks.TRUNK_WEIGHT,
            trunk_stiffness=trunk[0],
            trunk_damping=trunk[1],
            posture=tasks.POSTURE_WEIGHT,
            posture_stiffness=pose[0],
            posture_damping=pose[1],
            torque=tasks.TORQUE_WEIGHT,
            force=tasks.FORCE_WEIGHT,
            tangential=tasks.TANGENTIAL_WEIGHT,
            moment=tasks.MOMENT_WEIGHT,
            half_length=0.5 * length,
            half_width=0.5 * width,
            friction=tasks.FRICTION,
        )
        self._feet = np.zeros((2, FOOT))

    def torque(self, observation: Observation, command: BalanceCommand, acceleration: Array) -> Array | None:
        """Joint torques (n,) [N m]; None if there is no answer.

        Args:
            observation: the measured state.
            command: what the feet are to do.
            acceleration: (3,) that the COG is to have [m/s^2].
        """
        terms = self._terms
        terms.read(observation.configuration, observation.velocity)
        self._aim_feet(command)
        left, right = terms.ankles
        free, torque, hessian, linear, rows, lower, upper, constant = assembled(
            terms.mass,
            terms.jacobian,
            terms.bias,
            terms.q,
            terms.qd,
            *left,
            *right,
            terms.soles,
            terms.chains,
            self._joints,
            acceleration,
            self._feet,
            self._weights,
        )
        if free:
            # The QP is strictly convex: its optimum without limits, if it keeps them, is the optimum.
            return torque
        if not np.isfinite(linear).all():
            return None
        optimum, _, flag, _ = daqp.solve(hessian, linear, rows, upper, lower, primal_tol=_TOLERANCE)
        if flag != _OPTIMAL:
            return None
        torque = rows[: len(constant)] @ optimum + constant
        return torque if np.isfinite(torque).all() else None

    def _aim_feet(self, command: BalanceCommand) -> None:
        for side, row in zip(SIDES, self._feet, strict=True):
            foot = command.feet[side]
            if foot.stance:
                row[:7] = 1.0, foot.yaw, tasks.STANCE_WEIGHT, *tasks.STANCE_POSITION, *tasks.STANCE_ORIENTATION
                # Where the foot stands is where it shall stay: no pull towards a point it has slipped away from.
                row[7:] = 0.0
            else:
                gains = (0.0, 0.0) if foot.feedback else tasks.SWING_POSITION
                row[:7] = 0.0, foot.yaw, tasks.SWING_WEIGHT, *gains, *tasks.SWING_ORIENTATION
                row[7:10], row[10:13], row[13:] = foot.position, foot.velocity, foot.acceleration
