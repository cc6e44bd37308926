"""MOA sets of the tracking controller: Section IV, (25)-(41), for every phase of a reference at once.

With e = x - xi, (26) and (27) give e_{k+1} = Atilde e_k and u_k = mu_k - F e_k exactly, and the sums of
(29)-(39) vanish: the set of phase k is E_k = {e : -M_k F e <= v_k - M_k mu_k} cut by {e : Atilde e in E_{k+1}},
and E_m is the set of the regulator that takes over. Its rows are M_{k+i}(-F Atilde^i), those of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.dcm_plane import in_dcm_plane
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.moa import NO_STATE, MoaSet, sentence
from controllers.admissible.recursion import backward
from controllers.admissible.robust import ZmpError, require_room, required_margin
from controllers.admissible.tracking_chain import along_normals
from controllers.gains import Gain
from controllers.geometry.polytope import Polytope
from controllers.geometry.slack_kernel import least_of_each, table_of
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference


class TrackingMismatchError(MoaError):
    """Reference, terminal set and pendulum do not belong together."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrackingSets:
    """Sets kO_inf, k = 0..m: from x_k in set k, tracking and then regulating keeps the ZMP inside for ever.

    All rows lie one after another; those of phase k are `start[k]` up to `start[k + 1]`.

    Attributes:
        pendulum: model and period.
        gain: feedback of (27).
        reference: xi, mu and supports.
        terminal: set of the regulator that takes over at m (38).
        S: (R, 4) rows, unnormalised as in `MoaSet`.
        a: (R,) right sides for x in the world frame [m of ZMP]; +inf is a row that never binds.
        start: (m + 2,) first row of each phase.
        sample: (R,) sample counted from phase 0 that the row looks at; from m on, the regulator's.
        edge: (R,) edge of that sample's support polygon.
    """

    pendulum: Pendulum
    gain: Gain
    reference: Reference
    terminal: MoaSet
    S: np.ndarray
    a: np.ndarray
    start: np.ndarray
    sample: np.ndarray
    edge: np.ndarray
    _start: list[int] = field(init=False, repr=False)
    _table: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        # By columns, a query of all phases streams through memory in half the time.
        table = table_of(self.S, self.a)
        object.__setattr__(self, "_table", table)
        object.__setattr__(self, "S", table[:-1].T)
        object.__setattr__(self, "a", table[-1])
        for value in (self.S, self.a, self.start, self.sample, self.edge):
            value.setflags(write=False)
        # Plain integers: slicing by them costs a fifth of slicing by numpy's.
        object.__setattr__(self, "_start", self.start.tolist())

    @property
    def m(self) -> int:
        """Number of ticks of the reference; the last set is that of phase m."""
        return len(self.start) - 2

    @property
    def error(self) -> ZmpError | None:
        """Errors of the ZMP that the sets withstand: those of the terminal set."""
        return self.terminal.error

    def slack(self, k: int, x: ArrayLike) -> float:
        """Slack [m of ZMP] of state x (4,) in the set of phase k; negative outside, NaN for NaN."""
        i, j = self._start[k], self._start[k + 1]
        slack = self.a[i:j] - np.dot(x, self._table[:-1, i:j])
        return float(slack.item(slack.argmin()))

    def slacks(self, k: int, x: ArrayLike) -> np.ndarray:
        """`slack` in phase k of each state of x (..., 4), as (...,)."""
        return self.polytope(k).slack(x)

    def slack_all(self, x: ArrayLike) -> np.ndarray:
        """Slack (m + 1,) of state x (4,) in the set of every phase."""
        slacks = np.empty(self.m + 1)
        least_of_each(self._table, self.start, np.ascontiguousarray(x, float), slacks)
        return slacks

    def contains(self, k: int, x: ArrayLike) -> bool:
        """Whether state x (4,) is in the closed set of phase k; False for NaN."""
        return self.slack(k, x) >= 0.0

    def tight(self, k: int, x: ArrayLike) -> tuple[int, int]:
        """(sample, edge) of the row of phase k with the least slack at x (4,); samples count from phase 0."""
        i, j = self._start[k], self._start[k + 1]
        row = i + int(np.argmin(self.a[i:j] - np.dot(x, self._table[:-1, i:j])))
        return int(self.sample[row]), int(self.edge[row])

    def polytope(self, k: int) -> Polytope:
        """Set of phase k in x, world frame."""
        i, j = self._start[k], self._start[k + 1]
        return Polytope(S=self.S[i:j], a=self.a[i:j])

    def explain(self, k: int, x: ArrayLike) -> str:
        """One sentence: where and when tracking from x (4,) at phase k would fail, or what is tightest.

        Of a set that withstands errors it is always the tightest constraint, not the first to fail.
        """
        if not np.isfinite(x).all():
            return NO_STATE
        violation, least = None, self.slack(k, x)
        if not least >= 0.0 and self.error is None:
            loop = self.gain.closed_loop(self.pendulum)
            e = np.asarray(x, dtype=float) - self.reference.xi[k]
            for i in range(k, self.m):
                polygon = self.reference.support(i)
                slack = polygon.v - polygon.M @ (self.reference.mu[i] - self.gain.F @ e)
                edge = int(slack.argmin())
                if slack[edge] < 0.0:
                    where, beyond = f"the {polygon.edge_name(edge)} edge", f"({-1e3 * slack[edge]:.1f} mm beyond)"
                    return f"the ZMP would leave through {where} {self._when(i - k)} {beyond}"
                e = loop @ e
            violation = self.terminal.violation(self.reference.xi[-1] + e)
        sample, edge = self.tight(k, x)
        if violation is not None or sample >= self.m:
            delay = (self.m - k) * self.pendulum.dt
            if violation is None and least < 0.0:
                violation = sample - self.m, edge, -least
            return sentence(self.terminal, violation, (sample - self.m, edge), least, delay)
        where = f"the {self.reference.support(sample).edge_name(edge)} edge"
        when = self._when(sample - k)
        despite = "" if self.error is None else f" with the ZMP off by up to {1e3 * self.error.w_bar:.3g} mm"
        if least < 0.0:
            return f"the ZMP could leave through {where} {when} ({-1e3 * least:.1f} mm beyond){despite}"
        return f"the ZMP stays inside{despite}, tightest at {where} ({1e3 * least:.1f} mm) {when}"

    def _when(self, samples: int) -> str:
        return f"{samples * self.pendulum.dt:.2f} s from now" if samples else "now"


def tracking_sets(pendulum: Pendulum, gain: Gain, reference: Reference, terminal: MoaSet) -> TrackingSets:
    """Sets of all phases by the backward recursion; in the plane of the DCM if both gains are DCM gains.

    Args:
        pendulum: model and period, those of the reference and of the terminal set.
        gain: feedback of the tracking controller.
        reference: what is tracked.
        terminal: set of the regulator that takes over at its end, with whatever gain; the sets of all phases
            withstand the same errors of the ZMP as it does.

    Raises:
        EmptySetError: the reference keeps less than `robust.required_margin`; carries the largest error that does.
        UnstableGainError: the closed loop does not converge.
        TrackingMismatchError: omega or dt differ.
    """
    if not pendulum == reference.pendulum == terminal.pendulum:
        raise TrackingMismatchError(
            "pendulum, reference and terminal set must share omega and dt, got "
            + ", ".join(f"({p.omega:g}, {p.dt:g})" for p in (pendulum, reference.pendulum, terminal.pendulum))
        )
    if terminal.error is not None:
        _require_margin(pendulum, gain, reference, terminal.error)
    ratio, final_ratio = gain.dcm_ratio(pendulum), terminal.gain.dcm_ratio(pendulum)
    if ratio is not None and final_ratio is not None and terminal.bounds is None:
        S, a, start, sample, edge = in_dcm_plane(pendulum, reference, terminal, ratio, final_ratio)
    else:
        gain.require_stable(pendulum)
        rows = along_normals(pendulum, gain, reference, terminal)
        rows = backward(pendulum, gain, reference, terminal) if rows is None else rows
        S, a, start, sample, edge = rows
    return TrackingSets(
        pendulum=pendulum, gain=gain, reference=reference, terminal=terminal,
        S=S, a=a, start=start, sample=sample, edge=edge,
    )  # fmt: skip


def _require_margin(pendulum: Pendulum, gain: Gain, reference: Reference, error: ZmpError) -> None:
    rooms, reaches = [], []
    for index, polygon in enumerate(reference.supports):
        mu = reference.mu[reference.support_of == index]
        if len(mu):
            rooms.append(polygon.v - (mu @ polygon.M.T).max(axis=0))
            reaches.append(required_margin(pendulum, gain, polygon, error))
    if rooms:
        what = f"tracking the reference with {gain.name!r}"
        require_room(np.concatenate(rooms), np.concatenate(reaches), error, what)
