"""Stances, gains and a walk that the tests of the MOA sets share."""

from __future__ import annotations

import numpy as np

from controllers.gains import Gain, dcm, lqr, poles
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference

PENDULUM = Pendulum.from_height(0.3, 9.81, 0.005)
_SOLE = np.array([[-0.04, -0.03], [0.06, -0.03], [0.06, 0.03], [-0.04, 0.03]])


def foot(x: float, y: float, yaw: float = 0.0) -> Foot:
    return Foot(position=np.array([x, y]), yaw=yaw, sole=_SOLE)


STANCES: dict[str, SupportPolygon] = {
    "box": support_polygon([foot(0.0, 0.05), foot(0.0, -0.05)]),
    "hexagon": support_polygon([foot(0.0, 0.05), foot(0.08, -0.05)]),
    "yawed": support_polygon([foot(0.0, 0.05, 0.3), foot(0.08, -0.06, -0.2)]),
    "single": support_polygon([foot(0.3, 0.05, 0.1)]),
}

# Real fast and slow poles, a complex pair, a double pole, and the divergent component alone.
GAINS: dict[str, Gain] = {
    "lqr": lqr(PENDULUM, (1.0, 1.0), 1.0),
    "lqr complex": lqr(PENDULUM, (1.0, 0.0), 1.0),
    "poles": poles(PENDULUM, (-0.2 * PENDULUM.omega, -0.8 * PENDULUM.omega)),
    "double pole": poles(PENDULUM, (-9.0, -9.0)),
    "dcm": dcm(PENDULUM, 1.5),
}


def walk(pendulum: Pendulum = PENDULUM, m: int = 400) -> Reference:
    """Two steps forward, the second landing foot yawed, with the ZMP at the middle of each support."""
    left, right, left_on, right_on = foot(0.0, 0.05), foot(0.0, -0.05), foot(0.08, 0.05, 0.1), foot(0.08, -0.05)
    stances = ([left, right], [right], [left_on, right], [left_on], [left_on, right_on])
    supports = tuple(support_polygon(feet) for feet in stances)
    support_of = np.digitize(np.arange(m) * pendulum.dt, [0.1, 0.4, 0.5, 0.8])
    mu = np.array([supports[i].centre for i in support_of])
    start, end = supports[0].centre, supports[-1].centre
    phase = pendulum.omega * pendulum.dt
    # The DCM that ends at rest, backward in time, where it is stable.
    divergent = end
    for zmp in mu[::-1]:
        divergent = zmp + (divergent - zmp) * np.exp(-phase)
    x0 = np.ravel(np.column_stack((start, pendulum.omega * (divergent - start))))
    # What is left of the convergent component at the end is taken up by the ZMP of the last third.
    late = np.arange(m) >= 2 * m // 3
    remaining = np.arange(m - 1, -1, -1)
    effect = late * np.stack(((1.0 - np.exp(-phase)) * np.exp(-phase * remaining), np.exp(-phase * np.arange(m))))
    residue = pendulum.rollout(x0, mu)[-1]
    convergent = residue[0::2] - residue[1::2] / pendulum.omega - end
    mu -= np.linalg.pinv(effect) @ np.stack((convergent, np.zeros(2)))
    return Reference(
        pendulum=pendulum, xi=pendulum.rollout(x0, mu), mu=mu, supports=supports,
        support_of=support_of, final=supports[-1],
    )  # fmt: skip


def reach_along(usage: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Largest factor s (N,) with s usage <= limits, from usage (N, T) and limits (T,).

    The constraints are linear along a ray from the reference, so one simulation tells where the set ends on it.
    """
    factors = np.full(usage.shape, np.inf)
    np.divide(limits, usage, out=factors, where=usage > 0.0)
    return factors.min(axis=1)
