"""The closed loop as the robot runs it, over many states at once: what the sets are held to."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from controllers.gains import Gain
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.pendulum import Pendulum

# States at a time: all arrays of a sample then stay in the cache.
_CHUNK = 4_000
# What follows t*: a set that were too large by a row that is missing would show there [s].
AFTER = 3.0


def least_slack(
    pendulum: Pendulum,
    gain: Gain,
    x: np.ndarray,
    plan: Iterable[tuple[np.ndarray, np.ndarray, SupportPolygon]],
) -> np.ndarray:
    """Least distance (N,) [m] of the ZMP to an edge under (8) and u = target + F (wanted - x).

    Args:
        pendulum: the plant.
        gain: F.
        x: (N, 4) states at the start.
        plan: for each sample the target (2,), the wanted state (4,) and the polygon.
    """
    plan = list(plan)
    A, B, F = pendulum.A, pendulum.B, gain.F
    least = np.full(len(x), np.inf)
    for i in range(0, len(x), _CHUNK):
        state, part = np.ascontiguousarray(x[i : i + _CHUNK].T), least[i : i + _CHUNK]
        for target, wanted, polygon in plan:
            u = (target + F @ wanted)[:, None] - F @ state
            np.minimum(part, (polygon.v[:, None] - polygon.M @ u).min(axis=0), out=part)
            state = A @ state + B @ u
    return least


def random_polygon(rng: np.random.Generator) -> SupportPolygon:
    """One foot, or two that are staggered and yawed, anywhere near the origin."""
    length, width = rng.uniform(0.04, 0.2), rng.uniform(0.03, 0.1)
    heel = rng.uniform(0.2, 0.8) * length
    sole = np.array([[-heel, -width], [length - heel, -width], [length - heel, width], [-heel, width]]) * [1.0, 0.5]
    apart = width * rng.uniform(1.1, 2.0)
    left = Foot(position=rng.uniform(-0.1, 0.1, 2), yaw=rng.uniform(-0.4, 0.4), sole=sole)
    if rng.uniform() < 0.3:
        return support_polygon([left])
    at = left.position + np.array([rng.uniform(-1.0, 1.0) * length, -apart])
    return support_polygon([left, Foot(position=at, yaw=rng.uniform(-0.4, 0.4), sole=sole)])
