"""What a loaded sole tells the filter: where the floor carries it, it rests."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.estimation.invariant_filter import GYRO, PLACE, SIZE, SPEED, TURN, InvariantFilter
from controllers.estimation.options import EkfOptions
from controllers.geometry.rotation import cross, skew
from controllers.whole_body.measured_body import SoleMotion

Array = NDArray[np.float64]

_ROWS = 6
_UNIT = np.eye(3)


class SoleContact:
    """The measurement of both soles, to be filled sole by sole and then taken by the filter."""

    def __init__(self, options: EkfOptions, weight: float, corners: Array, imu: Array) -> None:
        """Stand ready.

        Args:
            options: how much of a loaded sole is believed.
            weight: of the robot [N].
            corners: (4, 2) of a sole in its site's frame [m].
            imu: (3,) place of the IMU in the trunk's frame [m].
        """
        self._options, self._imu = options, imu
        self._load, self._full_load = options.contact_load * weight, options.full_load * weight
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        self._H = np.zeros((2 * _ROWS, SIZE))
        self._excess, self._variance = np.zeros(2 * _ROWS), np.zeros(2 * _ROWS)
        self._rows = 0

    def take(self, state: InvariantFilter, rate: Array, soles: list[tuple[SoleMotion, float, Array]]) -> None:
        """Correct a filter by the soles that are loaded.

        Args:
            state: the filter.
            rate: (3,) angular velocity of the trunk, in its frame [rad/s].
            soles: motion, normal force [N] and centre of pressure (2,) [m] of each.
        """
        self._rows = 0
        for sole, force, cop in soles:
            if force >= self._load and not math.isnan(float(cop[0])):
                self._add(state, rate, sole, force, cop)
        n = self._rows
        if n:
            state.correct(self._H[:n], self._excess[:n], self._variance[:n])

    def _add(self, state: InvariantFilter, rate: Array, sole: SoleMotion, force: float, cop: Array) -> None:
        o, H, n = self._options, self._H, self._rows
        x, y = np.clip(cop, self._low, self._high).tolist()
        inside = min(x - self._low[0], y - self._low[1], self._high[0] - x, self._high[1] - y)
        faint = max(1.0, self._full_load / force)
        arm = sole.rotation[:, 0] * x + sole.rotation[:, 1] * y
        at = sole.position + arm - self._imu
        R = state.rotation
        H[n : n + _ROWS] = 0.0

        slip = state.velocity + R @ (cross(rate, at) + sole.velocity + cross(sole.turning, arm))
        deviation = faint * (o.contact_speed if inside > o.edge else o.edge_speed)
        # an impact or a slip: what deviates by far is believed the less
        deviation *= max(1.0, math.sqrt(float(slip @ slip)) / (o.outlier * deviation))
        H[n : n + 3, SPEED] = _UNIT
        H[n : n + 3, GYRO] = R @ skew(at)
        self._excess[n : n + 3] = slip
        self._variance[n : n + 3] = deviation * deviation
        n += 3

        away = R @ at
        point = state.position + away
        H[n, TURN] = point[1], -point[0], 0.0
        H[n, PLACE] = 0.0, 0.0, 1.0
        self._excess[n] = point[2]
        self._variance[n] = (faint * o.contact_height) ** 2
        n += 1

        if inside > o.flat and faint == 1.0:
            # normal of the sole in the world, which errors (a, b) about x and y tilt by (b, -a)
            H[n, TURN] = 0.0, 1.0, 0.0
            H[n + 1, TURN] = -1.0, 0.0, 0.0
            self._excess[n : n + 2] = (R @ sole.rotation[:, 2])[:2]
            self._variance[n : n + 2] = o.sole_tilt**2
            n += 2
        self._rows = n
