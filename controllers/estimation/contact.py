"""What a loaded sole tells the filter: where the floor carries it, it rests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.estimation.beliefs import Beliefs
from controllers.estimation.invariant_filter import SIZE, InvariantFilter
from controllers.estimation.options import EkfOptions
from controllers.geometry.rotation import cross, skew
from controllers.multibody.tree import Records

Array = NDArray[np.float64]

_ROWS = 6

# How much of a loaded sole is believed: beliefs and options of these names, and the loads [N] at which it is asked, and
# believed in full.
_BELIEFS = "contact_speed", "edge_speed", "edge", "flat"
_OPTIONS = "outlier", "contact_height", "sole_tilt"
_TRUST = np.dtype([(name, np.float64) for name in (*_BELIEFS, *_OPTIONS, "load", "full_load")])


class SoleContact:
    """The measurement of both soles."""

    def __init__(self, options: EkfOptions, believed: Beliefs, weight: float, corners: Array, imu: Array) -> None:
        """Stand ready.

        Args:
            options, believed: how much of a loaded sole is believed.
            weight: of the robot [N].
            corners: (4, 2) of a sole in its site's frame [m].
            imu: (3,) place of the IMU in the trunk's frame [m].
        """
        self._imu = imu
        figures = *(getattr(believed, name) for name in _BELIEFS), *(getattr(options, name) for name in _OPTIONS)
        loads = options.contact_load * weight, options.full_load * weight
        # an element of such an array is what a kernel takes for a record
        self._trust: Any = np.array([(*figures, *loads)], _TRUST)[0]
        self._bounds = np.array([corners.min(axis=0), corners.max(axis=0)])
        self._H = np.zeros((2 * _ROWS, SIZE))
        self._excess, self._variance = np.zeros(2 * _ROWS), np.zeros(2 * _ROWS)

    def take(self, state: InvariantFilter, soles: Records, forces: Array, centres: Array) -> None:
        """Correct a filter by the soles that are loaded.

        Args:
            state: the filter.
            soles: (2,) of `MOTION`, from the trunk.
            forces: (2,) normal forces [N].
            centres: (2, 2) centres of pressure in the soles' frames [m]; NaN for none.
        """
        H, excess, variance = self._H, self._excess, self._variance
        where = state.rotation, state.velocity, state.position, state.rate, self._imu
        if n := _rows(H, excess, variance, self._trust, *where, soles, self._bounds, forces, centres):
            state.correct(H[:n], excess[:n], variance[:n])


@compiled
def _rows(
    H: Array,
    excess: Array,
    variance: Array,
    trust: Any,
    R: Array,
    v: Array,
    p: Array,
    rate: Array,
    imu: Array,
    soles: Records,
    bounds: Array,
    forces: Array,
    centres: Array,
) -> int:
    """Write what the loaded soles say into H (12, 15), excess and variance (12,); the number of rows.

    R, v, p and rate are the filter's; bounds are (2, 2), the lowest and the highest corner of a sole.
    """
    n = 0
    for i in range(len(soles)):
        x, y, force = centres[i, 0], centres[i, 1], forces[i]
        if force >= trust.load and not math.isnan(x):
            n = _sole_rows(H, excess, variance, n, trust, R, v, p, rate, imu, soles[i], bounds, force, x, y)
    return n


@compiled
def _sole_rows(
    H: Array,
    excess: Array,
    variance: Array,
    n: int,
    trust: Any,
    R: Array,
    v: Array,
    p: Array,
    rate: Array,
    imu: Array,
    sole: Any,
    bounds: Array,
    force: float,
    x: float,
    y: float,
) -> int:
    """Write what a sole says from row n on; the first row that is free then."""
    x = min(max(x, bounds[0, 0]), bounds[1, 0])
    y = min(max(y, bounds[0, 1]), bounds[1, 1])
    inside = min(x - bounds[0, 0], y - bounds[0, 1], bounds[1, 0] - x, bounds[1, 1] - y)
    faint = max(1.0, trust.full_load / force)
    arm = sole.R[:, 0] * x + sole.R[:, 1] * y
    at = sole.p + arm - imu
    H[n : n + _ROWS] = 0.0

    slip = v + R @ (cross(rate, at) + sole.v + cross(sole.w, arm))
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
        normal = R @ np.ascontiguousarray(sole.R[:, 2])
        H[n, 1], H[n + 1, 0] = 1.0, -1.0
        excess[n], excess[n + 1] = normal[0], normal[1]
        variance[n] = variance[n + 1] = trust.sole_tilt**2
        n += 2
    return n
