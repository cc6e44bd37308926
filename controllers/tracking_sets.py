"""MOA sets of the tracking controller: Section IV, (25)-(41), for every phase of a reference at once.

With e = x - xi, (26) and (27) give e_{k+1} = Atilde e_k and u_k = mu_k - F e_k exactly, and the sums of
(29)-(39) vanish: the set of phase k is E_k = {e : -M_k F e <= v_k - M_k mu_k} cut by {e : Atilde e in E_{k+1}},
and E_m is the set of the regulator that takes over. Its rows are M_{k+i}(-F Atilde^i), those of the paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from controllers.gains import Gain, dcm_contraction
from controllers.gilbert_tan import MoaError
from controllers.moa import MoaSet, sentence
from controllers.pendulum import Pendulum
from controllers.polytope import EmptyPolytopeError, Polytope
from controllers.reference import Reference

# Phases between two prunings: rows between them cost less than a pruning of every phase.
_PRUNE_EVERY = 10
# Natural logarithm of the largest power of the contraction used at once: 1e200, clear of overflow.
_POWERS = 460.0


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
        violation = None
        if not self.contains(k, x):
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
            return sentence(self.terminal, violation, (sample - self.m, edge), self.slack(k, x), delay)
        where = f"the {self.reference.support(sample).edge_name(edge)} edge"
        left = f"({1e3 * self.slack(k, x):.1f} mm)"
        return f"the ZMP stays inside, tightest at {where} {left} {self._when(sample - k)}"

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

    The DCM error shrinks by lambda a sample, so the edge at sample l asks of the error at phase k that
    normal . error <= margin_l / (weight_l lambda^(l - k)), and only the least of these over l >= k counts.
    """
    m = reference.m
    normals, margin, edges = _margins(reference, terminal)
    directions, phase = len(normals), np.arange(m + 1)
    weight = np.full(m + 1, ratio)
    weight[m] = final_ratio
    contraction = dcm_contraction(pendulum, ratio)
    limiting = _limiting_samples(margin / weight[:, None], contraction)
    scale = weight[limiting] * (contraction**phase)[limiting - phase[:, None]]
    seen = np.repeat(normals, 2, axis=1) / np.array([1.0, pendulum.omega, 1.0, pendulum.omega])
    entry = limiting * directions + np.arange(directions)
    a = margin.ravel()[entry] + scale * (reference.xi @ seen.T)
    S = (scale[:, :, None] * seen).reshape(-1, 4)
    edge = edges[np.append(reference.support_of, len(edges) - 1)].ravel()[entry]
    return S, a.ravel(), np.arange(m + 2) * directions, limiting.ravel(), edge.ravel()


def _margins(reference: Reference, terminal: MoaSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions that edges face, and the margin of the reference towards each of them.

    Returns:
        normals (D, 2); margins (m + 1, D) [m] of samples 0..m, inf where no edge faces there; and edges
        (P + 1, D), the edge of each support that faces there or -1, the terminal polygon last.
    """
    polygons = (*reference.supports, terminal.polygon)
    known: dict[tuple[float, float, int], int] = {}
    columns: list[list[int]] = []
    for polygon in polygons:
        own: list[int] = []
        for nx, ny in np.round(polygon.M, 12).tolist():
            # Feet with the same heading share their directions, but a polygon with two edges this close to
            # parallel keeps both.
            key = (nx, ny, 0) if known.get((nx, ny, 0)) not in own else (nx, ny, len(known))
            own.append(known.setdefault(key, len(known)))
        columns.append(own)
    normals = np.empty((len(known), 2))
    offsets = np.full((len(polygons), len(known)), np.inf)
    edges = np.full((len(polygons), len(known)), -1)
    for i, (polygon, own) in enumerate(zip(polygons, columns, strict=True)):
        normals[own], offsets[i, own], edges[i, own] = polygon.M, polygon.v, np.arange(len(own))
    margin = np.full((reference.m + 1, len(known)), np.inf)
    margin[:-1] = offsets[reference.support_of] - reference.mu @ normals.T
    # The terminal set is its polygon times its ratio, shifted from its centre to the end of the reference.
    margin[-1, columns[-1]] = terminal.a - terminal.S @ (reference.xi[-1] - terminal.x_C)
    return normals, margin, edges


def _limiting_samples(least: np.ndarray, contraction: float) -> np.ndarray:
    """The l >= k of the least least[l] / contraction^(l - k), for all k: (m + 1, D) from (m + 1, D)."""
    limiting = np.empty(least.shape, dtype=np.intp)
    limiting[-1] = len(least) - 1
    least = least.copy()
    # Blocks so short that the powers stay within double precision; one block for any usual gain.
    block = max(1, int(_POWERS / -math.log(contraction)))
    stop = len(least) - 1
    while stop > 0:
        first = max(0, stop - block)
        seen = least[first : stop + 1] * (contraction ** -np.arange(stop - first + 1.0))[:, None]
        until_end = np.minimum.accumulate(seen[::-1], axis=0)[::-1]
        own = np.arange(first, stop + 1)[:, None]
        # Where a later sample limits more, the first one from there on that is itself the least.
        candidate = np.where(seen == until_end, own, len(least))
        candidate[-1] = limiting[stop]
        limiting[first : stop + 1] = np.minimum.accumulate(candidate[::-1], axis=0)[::-1]
        least[first] = until_end[0]
        stop = first
    return limiting
