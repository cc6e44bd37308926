"""What a loaded sole tells the filter: where the floor carries it, it rests."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.estimation.beliefs import Beliefs
from controllers.estimation.invariant_filter import SIZE, InvariantFilter
from controllers.estimation.options import EkfOptions
from controllers.geometry.rotation import cross, skew
from controllers.whole_body.measured_body import SoleMotion

Array = NDArray[np.float64]

_ROWS = 6


class Trust(NamedTuple):
    """How much of a loaded sole is believed: the fields of `EkfOptions` of these names, with `full_load` in [N]."""

    contact_speed: float
    edge_speed: float
    outlier: float
    edge: float
    contact_height: float
    sole_tilt: float
    flat: float
    full_load: float


class SoleContact:
    """The measurement of both soles, to be filled sole by sole and then taken by the filter."""

    def __init__(self, options: EkfOptions, believed: Beliefs, weight: float, corners: Array, imu: Array) -> None:
        """Stand ready.

        Args:
            options, believed: how much of a loaded sole is believed.
            weight: of the robot [N].
            corners: (4, 2) of a sole in its site's frame [m].
            imu: (3,) place of the IMU in the trunk's frame [m].
        """
        self._imu, self._load = imu, options.contact_load * weight
        self._trust = Trust(
            contact_speed=believed.contact_speed,
            edge_speed=believed.edge_speed,
            outlier=options.outlier,
            edge=believed.edge,
            contact_height=options.contact_height,
            sole_tilt=options.sole_tilt,
            flat=believed.flat,
            full_load=options.full_load * weight,
        )
        self._bounds = np.array([corners.min(axis=0), corners.max(axis=0)])
        self._H = np.zeros((2 * _ROWS, SIZE))
        self._excess, self._variance = np.zeros(2 * _ROWS), np.zeros(2 * _ROWS)

    def take(self, state: InvariantFilter, rate: Array, soles: list[tuple[SoleMotion, float, Array]]) -> None:
        """Correct a filter by the soles that are loaded.

        Args:
            state: the filter.
            rate: (3,) angular velocity of the trunk, in its frame [rad/s].
            soles: motion, normal force [N] and centre of pressure (2,) [m] of each.
        """
        n = 0
        for sole, force, cop in soles:
            if force >= self._load and not math.isnan(float(cop[0])):
                n = self._add(n, state, rate, sole, force, cop)
        if n:
            state.correct(self._H[:n], self._excess[:n], self._variance[:n])

    def _add(self, n: int, state: InvariantFilter, rate: Array, sole: SoleMotion, force: float, cop: Array) -> int:
        """Write what a sole says from row n on; the first row that is free then."""
        x, y = cop.tolist()
        return _sole_rows(
            self._H,
            self._excess,
            self._variance,
            n,
            self._trust,
            state.rotation,
            state.velocity,
            state.position,
            rate,
            sole.position,
            sole.rotation,
            sole.velocity,
            sole.turning,
            self._imu,
            self._bounds,
            force,
            x,
            y,
        )


@compiled
def _sole_rows(
    H: Array,
    excess: Array,
    variance: Array,
    n: int,
    trust: Trust,
    R: Array,
    v: Array,
    p: Array,
    rate: Array,
    position: Array,
    rotation: Array,
    velocity: Array,
    turning: Array,
    imu: Array,
    bounds: Array,
    force: float,
    x: float,
    y: float,
) -> int:
    """Write what a sole says from row n on: H (12, 15), excess and variance (12,); the first row that is free then.

    R, v and p are the filter's; the sole's motion is as of `SoleMotion`; bounds are (2, 2), its lowest and highest
    corner; x and y are its centre of pressure.
    """
    x = min(max(x, bounds[0, 0]), bounds[1, 0])
    y = min(max(y, bounds[0, 1]), bounds[1, 1])
    inside = min(x - bounds[0, 0], y - bounds[0, 1], bounds[1, 0] - x, bounds[1, 1] - y)
    faint = max(1.0, trust.full_load / force)
    arm = rotation[:, 0] * x + rotation[:, 1] * y
    at = position + arm - imu
    H[n : n + _ROWS] = 0.0

    slip = v + R @ (cross(rate, at) + velocity + cross(turning, arm))
    deviation = faint * (trust.contact_speed if inside > trust.edge else trust.edge_speed)
    # an impact or a slip: what deviates by far is believed the less
    deviation *= max(1.0, math.sqrt((slip * slip).sum()) / (trust.outlier * deviation))
    H[n : n + 3, 9:12] = R @ skew(at)
    for i in range(3):
        H[n + i, 3 + i] = 1.0
        excess[n + i] = slip[i]
        variance[n + i] = deviation * deviation
    n += 3

    point = p + R @ at
    H[n, 0], H[n, 1] = point[1], -point[0]
    H[n, 8] = 1.0
    excess[n] = point[2]
    variance[n] = (faint * trust.contact_height) ** 2
    n += 1

    if inside > trust.flat and faint == 1.0:
        # normal of the sole in the world, which errors (a, b) about x and y tilt by (b, -a)
        normal = R @ np.ascontiguousarray(rotation[:, 2])
        H[n, 1], H[n + 1, 0] = 1.0, -1.0
        excess[n], excess[n + 1] = normal[0], normal[1]
        variance[n] = variance[n + 1] = trust.sole_tilt**2
        n += 2
    return n
