"""The servos of a compiled model: where their controls and gains are."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.interface import JointTargets

Array = NDArray[np.float64]

# Where MuJoCo's <dcmotor> keeps its stiffness [N m/rad] and its damping [N m s/rad].
_GAINS = np.array([4, 6])


class Servos:
    """Gives a model's servos their targets.

    Attributes:
        order: index of each joint's actuator, in the robot's joint order.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self.order = _motor_order(model)
        self._columns = _servo_columns(model)
        self._controls = np.zeros((model.njnt - 1, 3))
        self._flat, self._ctrl = self._controls.reshape(-1), data.ctrl
        self._file_gains = model.actuator_gainprm[self.order][:, _GAINS].copy()
        self._gains_changed = False

    def set(self, targets: JointTargets, at: tuple[Array, Array] | None = None) -> None:
        """Give them their targets, and gains if these have some.

        Args:
            targets: what they shall hold.
            at: (n,) angle [rad] and (n,) speed [rad/s] to hold instead of those of the targets.
        """
        controls = self._controls
        controls[:, 0], controls[:, 1] = (targets.position, targets.velocity) if at is None else at
        controls[:, 2] = targets.torque
        self._ctrl[self._columns] = self._flat
        if targets.stiffness is not None or targets.damping is not None or self._gains_changed:
            self._set_gains(targets.stiffness, targets.damping)

    def _set_gains(self, stiffness: Array | None, damping: Array | None) -> None:
        """Give the servos (n,) gains, or back those of the robot's file."""
        gains = self._file_gains.copy()
        for column, given in enumerate((stiffness, damping)):
            if given is not None:
                gains[:, column] = given
        parameters = self._model.actuator_gainprm
        parameters[np.arange(len(parameters))[self.order][:, None], _GAINS] = gains
        self._gains_changed = stiffness is not None or damping is not None


def _motor_order(model: mujoco.MjModel) -> slice | NDArray[np.intp]:
    """Index of each joint's actuator, in the robot's joint order; a slice if they are in that order already."""
    by_joint = {int(joint): i for i, joint in enumerate(model.actuator_trnid[:, 0])}
    order = np.array([by_joint[joint] for joint in range(1, model.njnt)])
    return slice(None) if (order == np.arange(len(order))).all() else order


def _servo_columns(model: mujoco.MjModel) -> slice | NDArray[np.intp]:
    """Index of the three controls (position, velocity, torque) of each joint after another, as `_motor_order`."""
    first = model.actuator_ctrladr[_motor_order(model)]
    columns = (first[:, None] + np.arange(3)).ravel()
    return slice(None) if (columns == np.arange(model.nu)).all() else columns
