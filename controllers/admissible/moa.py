"""Maximal output admissible (MOA) set of the COG regulator: Section III, (18)-(24).

When both axes share one gain, the row of edge j at sample i sees only the component of the state along its
normal, and the polygon bounds the ZMP along that normal from both sides. The set {lower <= ZMP <= upper}, two
states instead of four, therefore tells from when on the rows of edge j follow from earlier samples. Leaving
those out is exact: the first sample without all its rows follows from the ones before, the next from it, ...
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.gilbert_tan import MoaError, cutting
from controllers.admissible.robust import ZmpError, require_room, taken, taken_at_last
from controllers.gains import Gain
from controllers.geometry.polytope import Polytope
from controllers.geometry.slack_kernel import least_slack, table_of
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum

# Relative, of a sum over thousands of samples.
_ROUNDING = 1e-9


class CentreOutsideError(MoaError):
    """The regulator would rest with the ZMP on or beyond an edge: its set has no inside."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MoaSet:
    """O_inf = {x : S xbar <= a}, xbar = x - x_C: from here the regulator keeps the ZMP inside for ever (21).

    Row r stands for edge `edge[r]` of the polygon at sample `sample[r]`, and is M(-F Atilde^i) unnormalised,
    so that its slack is the distance [m] of that ZMP from that edge. Bounds of the state, if there are any,
    have the edge numbers after those of the polygon, in the order +x, -x, +xd, -xd, +y, -y, +yd, -yd;
    velocities are divided by omega, so that theirs are metres too.

    Attributes:
        pendulum: model and period.
        gain: feedback of (18).
        polygon: support polygon, world frame.
        centre: (2,) point u_C that the regulator holds [m].
        bounds: (position [m], velocity [m/s]) allowed about the centre, or None.
        error: errors of the ZMP that the set withstands, or None: right sides (24) are smaller by what they take.
        polytope: S (r, 4) and a (r,) of (23), (24), in xbar.
        sample: (r,) ascending.
        edge: (r,).
        bounded: whether the set is bounded. That of a DCM gain is not: only the DCM is limited.
    """

    pendulum: Pendulum
    gain: Gain
    polygon: SupportPolygon
    centre: np.ndarray
    bounds: tuple[float, float] | None
    error: ZmpError | None = None
    polytope: Polytope
    sample: np.ndarray
    edge: np.ndarray
    bounded: bool
    _a: np.ndarray = field(init=False, repr=False)
    # `table_of` the set in x instead of xbar.
    _table: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for value in (self.centre, self.sample, self.edge):
            value.setflags(write=False)
        object.__setattr__(self, "_a", self.polytope.a + self.polytope.S @ self.x_C)
        object.__setattr__(self, "_table", table_of(self.polytope.S, self._a))

    @property
    def S(self) -> np.ndarray:
        """(r, 4) rows of (23) [m of ZMP a m, a m/s]."""
        return self.polytope.S

    @property
    def a(self) -> np.ndarray:
        """(r,) right sides of (24) [m]."""
        return self.polytope.a

    @property
    def x_C(self) -> np.ndarray:
        """(4,) state at rest over the centre."""
        return self.pendulum.rest(self.centre)

    @property
    def t_star(self) -> int:
        """Last sample that a row looks at: n of (23)."""
        return int(self.sample[-1])

    def slack(self, x: ArrayLike) -> float:
        """Slack [m of ZMP] of the tightest row at state x (4,); negative outside the set, NaN for NaN."""
        return least_slack(self._table, np.ascontiguousarray(x, float))

    def slacks(self, x: ArrayLike) -> np.ndarray:
        """`slack` of each state of x (..., 4), as (...,)."""
        return self.in_world().slack(x)

    def contains(self, x: ArrayLike) -> bool:
        """Whether state x (4,) is in the closed set; False for NaN."""
        return self.slack(x) >= 0.0

    def tight(self, x: ArrayLike) -> tuple[int, int]:
        """(sample, edge) of the row with the least slack at state x (4,)."""
        row = int(np.argmin(self._a - np.dot(x, self._table[:-1])))
        return int(self.sample[row]), int(self.edge[row])

    def in_world(self) -> Polytope:
        """The set in x instead of xbar."""
        return Polytope(S=self.S, a=self._a)

    def violation(self, x: ArrayLike) -> tuple[int, int, float] | None:
        """First sample at which the regulator started at x (4,) breaks a constraint, with the worst error if any.

        Returns:
            (sample, edge, distance beyond it [m]), or None for a state of the set.
        """
        if self.contains(x):
            return None
        C, d = outputs(self.pendulum, self.gain, self.polygon, self.centre, self.bounds)
        loop = self.gain.closed_loop(self.pendulum)
        xbar = np.asarray(x, dtype=float) - self.x_C
        lost = None
        if self.error is not None:
            powers = np.stack([np.linalg.matrix_power(loop, i) for i in range(self.t_star + 1)])
            lost = taken(C @ powers, self.pendulum.B, direct_rows(self.polygon, len(d)), self.error)
        for i in range(self.t_star + 1):
            slack = d - C @ xbar if lost is None else d - C @ xbar - lost[i]
            edge = int(slack.argmin())
            if slack[edge] < 0.0:
                return i, edge, -float(slack[edge])
            xbar = loop @ xbar
        return None

    def edge_name(self, edge: int) -> str:
        """Words for an edge or a bound of the state."""
        q = len(self.polygon.v)
        if edge < q:
            return f"the {self.polygon.edge_name(edge)} edge"
        return f"the {('x', 'xd', 'y', 'yd')[(edge - q) // 2]} bound"

    def explain(self, x: ArrayLike, delay: float = 0.0) -> str:
        """One sentence: where and when the regulator started at x (4,), `delay` [s] from now, would fail."""
        if not np.isfinite(x).all():
            return NO_STATE
        return sentence(self, self.violation(x), self.tight(x), self.slack(x), delay)


NO_STATE = "the state is not finite, and in no set"


def sentence(
    at: MoaSet, violation: tuple[int, int, float] | None, tight: tuple[int, int], slack: float, delay: float
) -> str:
    """What `MoaSet.explain` says, from the numbers behind it."""
    i, edge = tight if violation is None else violation[:2]
    seconds = delay + i * at.pendulum.dt
    when = f"{seconds:.2f} s from now" if seconds > 0.0 else "now"
    what = "ZMP" if edge < len(at.polygon.v) else "state"
    despite = "" if at.error is None else f" with the ZMP off by up to {1e3 * at.error.w_bar:.3g} mm"
    if violation is None:
        return f"the {what} stays inside{despite}, tightest at {at.edge_name(edge)} ({1e3 * slack:.1f} mm) {when}"
    could = "would" if at.error is None else "could"
    beyond = f"({1e3 * violation[2]:.1f} mm beyond)"
    return f"the {what} {could} leave through {at.edge_name(edge)} {when} {beyond}{despite}"


def regulator_set(
    pendulum: Pendulum,
    gain: Gain,
    polygon: SupportPolygon,
    centre: ArrayLike | None = None,
    bounds: tuple[float, float] | None = None,
    error: ZmpError | None = None,
    max_samples: int = 10_000,
) -> MoaSet:
    """MOA set (21)-(24) of the regulator (18) on a constant support polygon.

    Args:
        pendulum: model and period.
        gain: feedback; DCM gains are done in closed form (t* = 0).
        polygon: support polygon, world frame.
        centre: (2,) point u_C to hold [m]; the centroid of the polygon if None.
        bounds: (position [m], velocity [m/s]) that |xbar| must not exceed either; makes every set bounded.
        error: errors of the ZMP to withstand, those that change from sample to sample included.
        max_samples: where to give up.

    Raises:
        UnstableGainError: the closed loop does not converge.
        UnobservableGainError: the ZMP does not show the whole state, and there are no bounds.
        CentreOutsideError: the centre is not inside the polygon.
        EmptySetError: no state withstands the error; it carries the largest that would do.
        NotDeterminedError: the recursion reached max_samples.
        MoaError: the bounds are not two positive numbers.
    """
    centre = np.array(polygon.centre if centre is None else centre, dtype=float)
    if bounds is not None and not all(np.isfinite(b) and b > 0.0 for b in bounds):
        raise MoaError(f"bounds must be a positive position [m] and velocity [m/s], got {bounds!r}")
    C, d = outputs(pendulum, gain, polygon, centre, bounds)
    require_inside(polygon, centre, d)
    q, loop = len(d), gain.closed_loop_axis(pendulum)
    ratio = gain.dcm_ratio(pendulum)
    if ratio is None or bounds is not None or error is not None:
        gain.require_stable(pendulum)
    direct = direct_rows(polygon, q)
    if error is not None:
        reach = taken_at_last(C, gain.closed_loop(pendulum), pendulum.B, direct, error)
        if ratio is not None and bounds is None:
            # A DCM gain may lack all room at last, as k* does: only for others are late samples without end then.
            reach *= 1.0 - _ROUNDING
        require_room(d, reach, error, f"the regulator {gain.name!r}")
    if ratio is not None and bounds is None:
        # With an error too: the room of the DCM grows over the samples while the error builds up.
        stack, keep = C[None], np.ones((1, q), dtype=bool)
    elif bounds is None and loop is not None and gain.axis is not None:
        last, along = _along_normals(pendulum, gain, loop, polygon, centre, d, error, max_samples)
        stack = (polygon.M[None, :, :, None] * along[:, None, None, :]).reshape(len(along), q, 4)
        keep = np.arange(len(along))[:, None] <= last
    else:
        lost = None if error is None else partial(taken, B=pendulum.B, direct=direct, error=error)
        keep, stack = cutting(C, d, gain.closed_loop(pendulum), gain.name, max_samples, lost)
    sample, edge = np.nonzero(keep)
    S, a = stack[keep], d[edge]
    if error is not None:
        a = a - taken(stack, pendulum.B, direct, error)[keep]
    return MoaSet(
        pendulum=pendulum, gain=gain, polygon=polygon, centre=centre, bounds=bounds, error=error,
        polytope=Polytope(S=S, a=a), sample=sample, edge=edge, bounded=ratio is None or bounds is not None,
    )  # fmt: skip


def require_inside(polygon: SupportPolygon, centre: np.ndarray, d: np.ndarray) -> None:
    """Raise CentreOutsideError unless the distances d of the centre (2,) to all edges are positive."""
    if not d.min() > 0.0:
        raise CentreOutsideError(
            f"centre {centre.tolist()} m is {-d.min():.3g} m beyond the "
            f"{polygon.edge_name(int(d.argmin()))} edge of the polygon: choose one strictly inside"
        )


def outputs(
    pendulum: Pendulum,
    gain: Gain,
    polygon: SupportPolygon,
    centre: np.ndarray,
    bounds: tuple[float, float] | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Constraints C xbar <= d of one sample: the ZMP by (16)-(18), then the bounds of the state."""
    C, d = -polygon.M @ gain.F, polygon.v - polygon.M @ centre
    if bounds is None:
        return C, d
    unit = np.diag([1.0, 1.0 / pendulum.omega, 1.0, 1.0 / pendulum.omega])
    limit = np.array([bounds[0], bounds[1] / pendulum.omega])
    signed = np.stack((unit, -unit), axis=1).reshape(8, 4)
    return np.vstack((C, signed)), np.concatenate((d, np.tile(np.repeat(limit, 2), 2)))


def direct_rows(polygon: SupportPolygon, rows: int) -> np.ndarray:
    """Rows (q, 2) by which an error of the ZMP enters the constraints of `outputs` at once: M, then zeros."""
    direct = np.zeros((rows, 2))
    direct[: len(polygon.M)] = polygon.M
    return direct


def _along_normals(
    pendulum: Pendulum,
    gain: Gain,
    loop: np.ndarray,
    polygon: SupportPolygon,
    centre: np.ndarray,
    d: np.ndarray,
    error: ZmpError | None,
    max_samples: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Last sample (q,) at which each edge's row can cut, and the rows -f atilde^i (t* + 1, 2)."""
    assert gain.axis is not None
    lower = (polygon.M @ (polygon.vertices - centre).T).min(axis=1)
    off = np.zeros(len(d)) if error is None else error.support(polygon.M)
    # The last sample depends on ratios to d only; parallel edges of equal feet share it.
    cases = list(zip(np.round(lower / d, 12).tolist(), np.round(off / d, 12).tolist(), strict=True))
    C, b = np.vstack((-gain.axis, gain.axis)), np.column_stack((pendulum.B[:2, :1], np.zeros(2)))
    sides = np.array([[1.0, 0.0], [-1.0, 0.0]])
    last, rows = {}, np.empty((0, 2))
    for ratio, share in set(cases):
        # Along a normal the error is one number, up to its support in that direction.
        lost = None if error is None else partial(taken, B=b, direct=sides, error=ZmpError.box(share, 0.0))
        cuts, stack = cutting(C, np.array([1.0, -ratio]), loop, gain.name, max_samples, lost)
        last[ratio, share] = int(np.flatnonzero(cuts.any(axis=1))[-1])
        if len(stack) > len(rows):
            rows = stack[:, 0]
    each = np.array([last[case] for case in cases])
    return each, rows[: each.max() + 1]
