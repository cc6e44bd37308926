"""The quadratic program behind a stepping plan: ZMP knots, footholds and one common margin.

The ZMP is constant over each knot, z_j = base_j + sum_i share_ji p_i + o_j, with the footholds p_i and the
offsets o_j free. Every constraint is affine in (s, o, p): o_j lies in its support shrunk by the margin s, the
final state is at rest over an affine point, the footholds are within reach.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import daqp
import numpy as np

from controllers.pendulum import Pendulum
from models.errors import OkiagariError

# One metre of margin outweighs any square of footholds [m^2] that a leg can reach: s is maximised first.
_MARGIN_WEIGHT = 1e3
_FOOTHOLD_WEIGHT = 1.0
# Small against the footholds, and large enough that the Hessian stays well conditioned.
_ZMP_WEIGHT = 0.1
_EQUALITY = 5
_OPTIMAL, _INFEASIBLE = 1, -1


class PlanningError(OkiagariError):
    """No plan was found: the arguments do not fit, no foothold can be reached, or the solver gave up."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Phase:
    """Successive knots whose supports share their edge directions.

    Attributes:
        ticks: (k,) periods that each knot lasts.
        M: (q, 2) unit edge normals.
        h: (k, q) or (q,) offsets of the support around its base [m]: M o <= h - s.
        base: (2,) or (k, 2) constant part of the base [m].
        share: (k, N) or (N,) weight of each foothold in the base.
        middle: (2,) or (k, 2) offset that the ZMP prefers [m].
    """

    ticks: tuple[int, ...]
    M: np.ndarray
    h: np.ndarray
    base: np.ndarray
    share: np.ndarray
    middle: np.ndarray


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Reach:
    """Rows lower <= G p <= upper on the stacked footholds p (2N,) [m]."""

    G: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Solution:
    """ZMP (m, 2) of each tick, states (m + 1, 4), footholds (N, 2), and the margin s of the program [m]."""

    mu: np.ndarray
    xi: np.ndarray
    footholds: np.ndarray
    margin: float


def knot_ticks(total: int, knot: int) -> tuple[int, ...]:
    """Split `total` ticks into knots of `knot` ticks; the first takes the remainder (0.5 to 1.5 knots)."""
    count = max(1, round(total / knot))
    return (total - (count - 1) * knot,) + (knot,) * (count - 1)


@lru_cache(maxsize=1024)
def _modes(rate: float, ticks: tuple[int, ...]) -> tuple[np.ndarray, float]:
    """Rows (2, K) of both modes at the end over the knots' ZMPs, and the decay over the whole plan.

    The divergent mode is scaled by that decay, so that no coefficient grows with the length of the plan:
    e^{-wT} d_T = d_0 + g z and c_T = e^{-wT} c_0 + h z.
    """
    edges = np.concatenate([[0.0], np.cumsum(ticks)]) * rate
    total = edges[-1]
    rows = np.vstack([np.diff(np.exp(-edges)), np.diff(np.exp(edges - total))])
    rows.setflags(write=False)
    return rows, math.exp(-total)


def end_modes(pendulum: Pendulum, ticks: tuple[int, ...]) -> tuple[np.ndarray, float]:
    """What ZMP knots of `ticks` periods do to one axis until their end.

    Returns:
        rows (2, K) and a decay q: with the divergent mode d = p + pd/w and the convergent c = p - pd/w,
        q d_end = d_0 + rows[0] z and c_end = q c_0 + rows[1] z.
    """
    return _modes(pendulum.omega * pendulum.dt, ticks)


def solve(
    pendulum: Pendulum,
    x0: np.ndarray,
    phases: Sequence[Phase],
    *,
    end_base: np.ndarray,
    end_share: np.ndarray,
    nominal: np.ndarray,
    reach: Reach | None,
    zmp_margin: float,
) -> Solution:
    """Solve for the ZMP, the footholds and the margin, and roll the plan out.

    Args:
        pendulum: model and period.
        x0: (4,) state at the start.
        phases: the knots in order.
        end_base, end_share: constant (2,) and share (N,) of the point over which the COG rests at the end.
        nominal: (N, 2) footholds to stay near [m].
        reach: hard limits of the footholds, None if there is no foothold.
        zmp_margin: margin [m] beyond which more is worth nothing.

    Raises:
        PlanningError: the solver finds no optimum.
    """
    count, steps = sum(len(phase.ticks) for phase in phases), len(nominal)
    zmp_rows = sum(len(phase.ticks) * len(phase.M) for phase in phases)
    size, rows = 1 + 2 * count + 2 * steps, zmp_rows + 4 + (0 if reach is None else len(reach.G))
    matrix = np.zeros((rows, size))
    upper, lower = np.empty(1 + rows), np.full(1 + rows, -np.inf)
    weights = np.full(size, _ZMP_WEIGHT)
    linear = np.empty(size)
    base, share = np.empty((count, 2)), np.empty((count, steps))

    upper[0], weights[0], linear[0] = zmp_margin, 1.0, -_MARGIN_WEIGHT
    knot, row = 0, 0
    for phase in phases:
        k, q = len(phase.ticks), len(phase.M)
        block = matrix[row : row + k * q].reshape(k, q, size)
        block[:, :, 0] = 1.0
        columns = 1 + 2 * (knot + np.arange(k))
        for axis in (0, 1):
            block[np.arange(k), :, columns + axis] = phase.M[:, axis]
        upper[1 + row : 1 + row + k * q].reshape(k, q)[:] = phase.h
        base[knot : knot + k], share[knot : knot + k] = phase.base, phase.share
        linear[1 + 2 * knot : 1 + 2 * (knot + k)].reshape(k, 2)[:] = -_ZMP_WEIGHT * phase.middle
        knot, row = knot + k, row + k * q
    foot = 1 + 2 * count
    weights[foot:] = _FOOTHOLD_WEIGHT
    linear[foot:] = -_FOOTHOLD_WEIGHT * nominal.ravel()

    ticks = tuple(n for phase in phases for n in phase.ticks)
    modes, decay = end_modes(pendulum, ticks)
    scale = np.array([decay, 1.0])
    rates = x0[1::2] / pendulum.omega
    start = np.vstack([x0[0::2] + rates, decay * (x0[0::2] - rates)])
    held, by_foot = modes @ base - scale[:, None] * end_base, modes @ share - scale[:, None] * end_share
    for axis in (0, 1):
        line = slice(row + 2 * axis, row + 2 * axis + 2)
        matrix[line, 1 + axis : foot : 2] = modes
        matrix[line, foot + axis :: 2] = by_foot
        bound = slice(1 + row + 2 * axis, 1 + row + 2 * axis + 2)
        upper[bound] = lower[bound] = -start[:, axis] - held[:, axis]
    sense = np.zeros(1 + rows, dtype=np.int32)
    sense[1 + row : 5 + row] = _EQUALITY
    if reach is not None:
        matrix[row + 4 :, foot:] = reach.G
        upper[row + 5 :], lower[row + 5 :] = reach.upper, reach.lower

    optimum, _, flag, _ = daqp.solve(np.diag(weights), linear, matrix, upper, lower, sense, primal_tol=1e-10)
    if flag == _INFEASIBLE:
        # The margin may fall without bound and double support is long: only footholds can exclude each other.
        raise PlanningError("no footholds are within reach of each other in the time of the steps")
    if flag != _OPTIMAL:
        raise PlanningError(f"the stepping program has no optimum (DAQP exit flag {flag})")
    footholds = optimum[foot:].reshape(steps, 2)
    zmp = base + share @ footholds + optimum[1:foot].reshape(count, 2)
    mu, xi = _roll_out(pendulum, x0, zmp, ticks, end_base + end_share @ footholds)
    return Solution(mu=mu, xi=xi, footholds=footholds, margin=float(optimum[0]))


def _roll_out(
    pendulum: Pendulum, x0: np.ndarray, zmp: np.ndarray, ticks: tuple[int, ...], end: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ticks of the plan; what the solver's rounding leaves at the end is taken out by the last knots."""
    mu = np.repeat(zmp, ticks, axis=0)
    xi = pendulum.rollout(x0, mu)
    residual = xi[-1] - pendulum.rest(end)
    if np.abs(residual).max() > 1e-9:
        last = ticks[len(ticks) // 2 :]
        rows, decay = end_modes(pendulum, last)
        modes = np.vstack([rows[0] / decay, rows[1]])
        rates = residual[1::2] / pendulum.omega
        miss = np.vstack([residual[0::2] + rates, residual[0::2] - rates])
        zmp = zmp.copy()
        zmp[-len(last) :] -= np.linalg.lstsq(modes, miss, rcond=None)[0]
        mu = np.repeat(zmp, ticks, axis=0)
        xi = pendulum.rollout(x0, mu)
    return mu, xi
