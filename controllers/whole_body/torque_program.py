"""The QP of the inverse dynamics, assembled and solved by ourselves, at less than half of placo's cost.

It is placo's, and a weight on the moment about the vertical of a sole that stands alone, which placo has no place for.
"""

from __future__ import annotations

import daqp
import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, Observation
from controllers.multibody.torque_kernel import assembled
from controllers.whole_body import dynamics_tasks as tasks
from controllers.whole_body.body_terms import BodyTerms
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
        self._weights, self._joints = tasks.weights(robot, model), tasks.joints(robot)
        self._feet = tasks.FeetTask()

    def torque(self, observation: Observation, command: BalanceCommand, acceleration: Array) -> Array | None:
        """Joint torques (n,) [N m]; None if there is no answer.

        Args:
            observation: the measured state.
            command: what the feet are to do.
            acceleration: (3,) that the COG is to have [m/s^2].
        """
        terms = self._terms
        terms.read(observation.configuration, observation.velocity)
        self._feet.aim(command)
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
            self._feet.rows,
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
