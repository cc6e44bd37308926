"""MOA sets of the tracking controller: Section IV, (25)-(41), for every phase of a reference at once.

With e = x - xi, (26) and (27) give e_{k+1} = Atilde e_k and u_k = mu_k - F e_k exactly, and the sums of (29)-(39)
vanish: the set of phase k is E_k = {e : -M_k F e <= v_k - M_k mu_k} cut by {e : Atilde e in E_{k+1}}, and E_m is
the set of the regulator that takes over. Its rows are M_{k+i}(-F Atilde^i), those of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from controllers.gains import Gain, dcm_contraction
from controllers.moa import MoaError, MoaSet, sentence
from controllers.pendulum import Pendulum
from controllers.polytope import EmptyPolytopeError, Polytope
from controllers.reference import Reference

# Phases between two prunings: rows between them cost less than a pruning of every phase.
_PRUNE_EVERY = 10
# Powers of the contraction below this are taken as this: a bound 1e300 times the polygon never binds.
_SMALLEST = 1e-300


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

    def __post_init__(self) -> None:
        for value in (self.S, self.a, self.start, self.sample, self.edge):
            value.setflags(write=False)
        # Plain integers: slicing by them costs a fifth of slicing by numpy's.
        object.__setattr__(self, "_start", self.start.tolist())

    @property
    def m(self) -> int:
        """Number of ticks of the reference; the last set is that of phase m."""
        return len(self.start) - 2

    def slack(self, k: int, x: ArrayLike) -> float:
        """Slack [m of ZMP] of state x (4,) in the set of phase k; negative outside, NaN for NaN."""
        i, j = self._start[k], self._start[k + 1]
        return float(np.minimum.reduce(self.a[i:j] - self.S[i:j].dot(x)))

    def slacks(self, k: int, x: ArrayLike) -> np.ndarray:
        """`slack` in phase k of each state of x (..., 4), as (...,)."""
        return self.polytope(k).slack(x)

    def slack_all(self, x: ArrayLike) -> np.ndarray:
        """Slack (m + 1,) of state x (4,) in the set of every phase."""
        return np.minimum.reduceat(self.a - self.S.dot(x), self.start[:-1])

    def contains(self, k: int, x: ArrayLike) -> bool:
        """Whether state x (4,) is in the closed set of phase k; False for NaN."""
        return self.slack(k, x) >= 0.0

    def tight(self, k: int, x: ArrayLike) -> tuple[int, int]:
        """(sample, edge) of the row of phase k with the least slack at x (4,); samples count from phase 0."""
        i, j = self._start[k], self._start[k + 1]
        row = i + int(np.argmin(self.a[i:j] - self.S[i:j].dot(x)))
        return int(self.sample[row]), int(self.edge[row])

    def polytope(self, k: int) -> Polytope:
        """Set of phase k in x, world frame."""
        i, j = self._start[k], self._start[k + 1]
        return Polytope(S=self.S[i:j], a=self.a[i:j])

    def explain(self, k: int, x: ArrayLike) -> str:
        """One sentence: where and when tracking from x (4,) at phase k would fail, or what is tightest."""
        loop = self.gain.closed_loop(self.pendulum)
        e = np.asarray(x, dtype=float) - self.reference.xi[k]
        for i in range(k, self.m):
            polygon = self.reference.support(i)
            slack = polygon.v - polygon.M @ (self.reference.mu[i] - self.gain.F @ e)
            edge = int(slack.argmin())
            if slack[edge] < 0.0:
                where = f"the {polygon.edge_name(edge)} edge"
                return f"the ZMP would leave through {where} {self._when(i - k)} ({-1e3 * slack[edge]:.1f} mm beyond)"
            e = loop @ e
        delay = (self.m - k) * self.pendulum.dt
        violation = self.terminal.violation(self.reference.xi[-1] + e)
        sample, edge = self.tight(k, x)
        if violation is not None or sample >= self.m:
            tight = (sample - self.m, edge)
            return sentence(self.terminal, violation, tight, self.slack(k, x), delay)
        where = f"the {self.reference.support(sample).edge_name(edge)} edge"
        return f"the ZMP stays inside, tightest at {where} ({1e3 * self.slack(k, x):.1f} mm) {self._when(sample - k)}"

    def _when(self, samples: int) -> str:
        return f"{samples * self.pendulum.dt:.2f} s from now" if samples else "now"


def tracking_sets(pendulum: Pendulum, gain: Gain, reference: Reference, terminal: MoaSet) -> TrackingSets:
    """Sets of all phases by the backward recursion; in the plane of the DCM if both gains are DCM gains.

    Args:
        pendulum: model and period, those of the reference and of the terminal set.
        gain: feedback of the tracking controller.
        reference: what is tracked.
        terminal: set of the regulator that takes over at its end, with whatever gain.

    Raises:
        UnstableGainError: the closed loop does not converge.
        TrackingMismatchError: omega or dt differ.
    """
    if not pendulum == reference.pendulum == terminal.pendulum:
        raise TrackingMismatchError(
            "pendulum, reference and terminal set must share omega and dt, got "
            + ", ".join(f"({p.omega:g}, {p.dt:g})" for p in (pendulum, reference.pendulum, terminal.pendulum))
        )
    ratio, final_ratio = gain.dcm_ratio(pendulum), terminal.gain.dcm_ratio(pendulum)
    if ratio is not None and final_ratio is not None and terminal.bounds is None:
        S, a, start, sample, edge = _in_dcm_plane(pendulum, reference, terminal, ratio, final_ratio)
    else:
        gain.require_stable(pendulum)
        S, a, start, sample, edge = _backward(pendulum, gain, reference, terminal)
    return TrackingSets(
        pendulum=pendulum, gain=gain, reference=reference, terminal=terminal,
        S=S, a=a, start=start, sample=sample, edge=edge,
    )  # fmt: skip


_Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _backward(pendulum: Pendulum, gain: Gain, reference: Reference, terminal: MoaSet) -> _Rows:
    loop, m = gain.closed_loop(pendulum), reference.m
    outputs = [(-polygon.M @ gain.F, np.arange(len(polygon.v))) for polygon in reference.supports]
    S = terminal.S
    a = terminal.a - S @ (reference.xi[-1] - terminal.x_C)
    sample, edge = m + terminal.sample, terminal.edge
    phases = [(S, a, sample, edge)]
    for k in range(m - 1, -1, -1):
        polygon = reference.supports[reference.support_of[k]]
        C, edges = outputs[reference.support_of[k]]
        S = np.concatenate((C, S @ loop))
        a = np.concatenate((polygon.v - polygon.M @ reference.mu[k], a))
        sample, edge = np.concatenate((np.full(len(C), k), sample)), np.concatenate((edges, edge))
        if (m - k) % _PRUNE_EVERY == 0 or k == 0:
            try:
                keep = Polytope(S=S, a=a).irredundant()
            except EmptyPolytopeError:
                # A reference that is not admissible may leave nothing: all rows stay, no state has slack.
                keep = np.arange(len(S))
            S, a, sample, edge = S[keep], a[keep], sample[keep], edge[keep]
        phases.append((S, a, sample, edge))
    phases.reverse()
    rows = [len(phase[1]) for phase in phases]
    flat_S, flat_a, flat_sample, flat_edge = (np.concatenate(parts) for parts in zip(*phases, strict=True))
    flat_a = flat_a + np.einsum("rn,rn->r", flat_S, np.repeat(reference.xi, rows, axis=0))
    return flat_S, flat_a, np.concatenate(([0], np.cumsum(rows))), flat_sample, flat_edge


def _in_dcm_plane(
    pendulum: Pendulum, reference: Reference, terminal: MoaSet, ratio: float, final_ratio: float
) -> _Rows:
    """One row a phase for each direction an edge faces: that of the sample which limits the DCM error most.

    The DCM error contracts by lambda a sample, so sample k + i asks n . error <= margin / (ratio lambda^i); the
    least over i, for all k at once, by doubling the number of samples looked at.
    """
    m, contraction = reference.m, dcm_contraction(pendulum, ratio)
    normals, margin, edge_of = _margins_by_normal(reference, terminal)
    weight = np.full(m + 1, ratio)
    weight[m] = final_ratio
    # Rows of the terminal set are its polygon's times the ratio, shifted from its centre to the end of the reference.
    least = margin / weight[:, None]
    from_sample = np.broadcast_to(np.arange(m + 1)[:, None], margin.shape).copy()
    reach, power = 1, contraction
    while reach <= m:
        later = least[reach:] / max(power, _SMALLEST)
        better = later < least[:-reach]
        source = from_sample[reach:].copy()
        np.copyto(least[:-reach], later, where=better)
        np.copyto(from_sample[:-reach], source, where=better)
        reach, power = 2 * reach, power * power
    columns = np.arange(len(normals))
    scale = weight[from_sample] * contraction ** (from_sample - np.arange(m + 1)[:, None])
    flat = np.stack(
        (normals[:, 0], normals[:, 0] / pendulum.omega, normals[:, 1], normals[:, 1] / pendulum.omega), 1
    )
    S = scale[:, :, None] * flat
    a = margin[from_sample, columns] + scale * (reference.xi @ flat.T)
    start = np.arange(m + 2) * len(normals)
    return S.reshape(-1, 4), a.ravel(), start, from_sample.ravel(), edge_of[from_sample, columns].ravel()


def _margins_by_normal(reference: Reference, terminal: MoaSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions (D, 2) of all edges, and for each sample 0..m the margin (m + 1, D) of its edge that faces there.

    The margin is inf, and the edge -1, where no edge of that sample's polygon faces in the direction.
    """
    m = reference.m
    used = [int(p) for p in np.unique(reference.support_of)]
    polygons = [reference.supports[p] for p in used] + [terminal.polygon]
    known: dict[tuple[float, float, int], int] = {}
    columns = []
    for polygon in polygons:
        own: list[int] = []
        for nx, ny in np.round(polygon.M, 12).tolist():
            # A polygon with two edges this close to parallel keeps both.
            key = (nx, ny, 0) if known.get((nx, ny, 0)) not in own else (nx, ny, len(known))
            own.append(known.setdefault(key, len(known)))
        columns.append(np.array(own))
    normals = np.zeros((len(known), 2))
    margin = np.full((m + 1, len(known)), np.inf)
    edge_of = np.full((m + 1, len(known)), -1)
    for p, polygon, own_columns in zip(used, polygons, columns, strict=False):
        ticks = np.flatnonzero(reference.support_of == p)[:, None]
        margin[ticks, own_columns] = polygon.v - reference.mu[ticks[:, 0]] @ polygon.M.T
        edge_of[ticks, own_columns] = np.arange(len(own_columns))
        normals[own_columns] = polygon.M
    margin[m, columns[-1]] = terminal.a - terminal.S @ (reference.xi[-1] - terminal.x_C)
    edge_of[m, columns[-1]] = np.arange(len(columns[-1]))
    normals[columns[-1]] = terminal.polygon.M
    return normals, margin, edge_of
