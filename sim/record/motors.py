"""How much of its motors an episode used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.robot import Robot

Array = NDArray[np.float64]

AT_LIMIT = 1e-3
"""A motor within this share of its stall torque of the torque-speed line gives all it can."""


@dataclass(frozen=True, kw_only=True)
class MotorUse:
    """What the motors did, at the ends of the control ticks.

    Each of the three lines is of one joint, the one that used most of what its motor has.

    Attributes:
        peak_torque: greatest torque of the joint with the greatest share of its stall torque [N m].
        peak_torque_use: that share.
        peak_torque_joint: that joint.
        peak_speed: greatest speed of the joint with the greatest share of its no-load speed [rad/s].
        peak_speed_use: that share; above 1 the motor is driven from outside.
        peak_speed_joint: that joint.
        saturated_time: how long any motor was at its torque-speed line [s].
        saturated_joint: whose was there longest; None if none was.
    """

    peak_torque: float
    peak_torque_use: float
    peak_torque_joint: str
    peak_speed: float
    peak_speed_use: float
    peak_speed_joint: str
    saturated_time: float
    saturated_joint: str | None


class MotorLog:
    """Torques and speeds of every motor, filled tick by tick."""

    def __init__(self, robot: Robot, ticks: int) -> None:
        """Make room for `ticks` control ticks."""
        self._robot = robot
        motors = (ticks, len(robot.joint_names))
        self._torque, self._speed = np.zeros(motors), np.zeros(motors)
        self._count = 0

    def add(self, torque: Array, speed: Array) -> None:
        """The motors' torques (n,) [N m] and speeds (n,) [rad/s] at the end of a tick."""
        self._torque[self._count], self._speed[self._count] = torque, speed
        self._count += 1

    def channels(self) -> dict[str, Array]:
        """Peaks over the joints for each tick, worked out for all of them at once; empty without ticks."""
        if not self._count:
            return {}
        effort, share, limited = self._shares()
        return {
            "torque_use": effort.max(axis=1),
            "speed_use": share.max(axis=1),
            "saturated": np.count_nonzero(limited, axis=1).astype(np.float64),
        }

    def use(self, period: float) -> MotorUse | None:
        """What the whole episode used; None without ticks.

        Args:
            period: length of a tick [s].
        """
        if not self._count:
            return None
        joints = self._robot.joint_names
        effort, share, limited = self._shares()
        strong, quick = int(effort.max(axis=0).argmax()), int(share.max(axis=0).argmax())
        ticks = limited.sum(axis=0)
        return MotorUse(
            peak_torque=float(np.abs(self._torque[: self._count, strong]).max()),
            peak_torque_use=float(effort[:, strong].max()),
            peak_torque_joint=joints[strong],
            peak_speed=float(np.abs(self._speed[: self._count, quick]).max()),
            peak_speed_use=float(share[:, quick].max()),
            peak_speed_joint=joints[quick],
            saturated_time=period * int(limited.any(axis=1).sum()),
            saturated_joint=joints[int(ticks.argmax())] if ticks.any() else None,
        )

    def _shares(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """(ticks, n): |torque| / stall, |speed| / no-load, and whether the motor was at its limit."""
        torque, speed = self._torque[: self._count], self._speed[: self._count]
        effort = np.abs(torque) / self._robot.stall_torque
        share = np.abs(speed) / self._robot.no_load_speed
        # A motor that drives has less torque the faster it turns; one that brakes has all of it.
        most = np.where(torque * speed > 0.0, np.maximum(1.0 - share, 0.0), 1.0)
        return effort, share, effort >= most - AT_LIMIT
