"""Tracking sets of a gain that both axes share: each row is dropped at the phase from which it follows from others.

The row of an edge with normal n at sample l sees, from phase k, only the component xi of the error along n:
p_{l-k} xi <= margin with p_i = -f atilde^i. Along n the polygons bound the ZMP from both sides at every sample (by an
edge, or by the corner farthest that way), so the sets of all phases have shadows {p_{l-k} xi <= b_l for l >= k} with
two unknowns. One phase earlier these are the same half-planes seen through atilde, which keeps their order around the
circle, and two more; so one ring of rows is kept for each line of normals, and a row that leaves it never returns.

Leaving out all rows that are strictly redundant along their own normal, at once, changes nothing. Let x violate
something, scaled so that all right sides are 1, and let r be the row it exceeds most, by lambda > 1. Were r left out,
it would be a combination with weights that sum to less than 1 of rows of its ring, which x exceeds by lambda at most
(those of corners are combinations of edges): so x exceeded r by less than lambda.
"""

from __future__ import annotations

import numpy as np

from controllers.admissible.dcm_plane import directions_of
from controllers.admissible.moa import MoaSet
from controllers.admissible.recursion import Rows
from controllers.gains import Gain
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference

# A row leaves the ring only if its neighbours imply it with this to spare, relative: well above the rounding.
_STRICTLY = 1.0 - 1e-12


def along_normals(pendulum: Pendulum, gain: Gain, reference: Reference, terminal: MoaSet) -> Rows | None:
    """Rows of all phases, as `recursion.backward`; None where this way does not apply.

    It needs one gain for both axes and for the terminal regulator, no bounds, no error of the ZMP, a closed loop that
    keeps the orientation of the plane, and a reference that keeps off every edge.
    """
    loop, m = gain.closed_loop_axis(pendulum), reference.m
    if loop is None or gain.axis is None or terminal.bounds is not None or terminal.error is not None:
        return None
    turn = float(np.linalg.det(loop))
    if not (turn > 0.0 and np.array_equal(gain.F, terminal.gain.F)):
        return None
    samples = m + terminal.t_star + 1
    powers = _along(-gain.axis, loop, samples)
    normals, known = directions_of((*reference.supports, terminal.polygon))
    support_of = np.append(reference.support_of, np.full(samples - m, len(reference.supports)))
    corners = [p.vertices @ normals.T for p in (*reference.supports, terminal.polygon)]
    above, below = np.array([c.max(axis=0) for c in corners]), np.array([c.min(axis=0) for c in corners])
    centre = np.concatenate((reference.mu @ normals.T, np.tile(normals @ terminal.centre, (samples - m, 1))))
    # What the terminal regulator has to correct if it does not hold the end of the reference.
    beside = reference.xi[-1] - terminal.x_C
    centre[m:] += powers[: samples - m] @ (normals @ beside.reshape(2, 2)).T
    upper, lower = above[support_of] - centre, centre - below[support_of]
    if not (upper.min() > 0.0 and lower.min() > 0.0):
        return None
    real = known[support_of] >= 0
    kept = np.zeros_like(real[m:])
    kept[terminal.sample, [known[-1].tolist().index(edge) for edge in terminal.edge.tolist()]] = True
    real[m:] &= kept
    dropped = np.full(real.shape, -1)
    seen = powers[0, 0] * powers[:, 1] - powers[0, 1] * powers[:, 0]
    for one, other in _lines(normals):
        fate = _dropped(seen.tolist(), turn, upper[:, one].tolist(), lower[:, one].tolist())
        dropped[:, one] = fate[::2]
        if other is not None:
            dropped[:, other] = fate[1::2]
    # The terminal set is the last one as it is.
    np.minimum(dropped[m:], m - 1, out=dropped[m:])
    return _assemble(reference, powers, normals, known[support_of], upper, real, dropped)


def _along(row: np.ndarray, loop: np.ndarray, samples: int) -> np.ndarray:
    """p_0, p_1, ... (samples, 2)."""
    rows, power = row[None], loop
    while len(rows) < samples:
        rows, power = np.concatenate((rows, rows @ power)), power @ power
    return rows[:samples]


def _lines(normals: np.ndarray) -> list[tuple[int, int | None]]:
    """Each normal with its opposite, if there is one, once."""
    lines: list[tuple[int, int | None]] = []
    taken: set[int] = set()
    for one in range(len(normals)):
        if one not in taken:
            facing = np.flatnonzero(np.abs(normals + normals[one]).max(axis=1) < 1e-11)
            other = next((int(i) for i in facing if int(i) not in taken), None)
            taken |= {one} if other is None else {one, other}
            lines.append((one, other))
    return lines


def _dropped(seen: list[float], turn: float, upper: list[float], lower: list[float]) -> list[int]:
    """From which phase each half-plane along one line of normals follows from its neighbours in the ring.

    Entry 2 l is the upper bound of sample l, 2 l + 1 the lower one. Plain numbers and closures: there are thousands
    of decisions on three rows each, one after another.

    Args:
        seen: cross products p_0 x p_i; p_i x p_j is turn^i times that of j - i.
        turn: determinant of atilde, positive.
        upper: right side of each sample.
        lower: that of the opposite direction.

    Returns:
        The phase for each entry, -1 for never.
    """
    samples = len(upper)
    powers = [turn**i for i in range(samples)]
    # Negative indices read the products the other way round.
    cross = [*seen, *(-value for value in reversed(seen[1:]))]
    limit = [value for pair in zip(upper, lower, strict=True) for value in pair]
    after, before, dropped = [0] * (2 * samples), [0] * (2 * samples), [-1] * (2 * samples)

    def turns(i: int, j: int, k: int) -> float:
        """Cross product of the directions of entries i and j, seen from phase k."""
        first, second = i >> 1, j >> 1
        value = powers[(first if first < second else second) - k] * cross[second - first]
        return -value if (i ^ j) & 1 else value

    def implied(u: int, v: int, w: int, k: int) -> bool:
        """Whether the half-planes u and w on either side of v imply it, strictly."""
        one, two, three = u >> 1, v >> 1, w >> 1
        gap = powers[(one if one < three else three) - k] * cross[three - one]
        if (u ^ w) & 1:
            gap = -gap
        if gap <= 0.0:
            return False
        left = powers[(one if one < two else two) - k] * cross[two - one]
        right = powers[(two if two < three else three) - k] * cross[three - two]
        if (u ^ v) & 1:
            left = -left
        if (v ^ w) & 1:
            right = -right
        # Both weights non-negative: sound whatever rounding did to the order of the ring.
        needed = limit[u] * right + limit[w] * left
        return left >= 0.0 and right >= 0.0 and needed < limit[v] * gap * _STRICTLY

    # Two opposite half-planes to start with; then sample by sample, each beside the last one of its side.
    near = [2 * samples - 2, 2 * samples - 1]
    for i, j in (near, near[::-1]):
        after[i] = before[i] = j
    for v in (2 * k + side for k in range(samples - 2, -1, -1) for side in (0, 1)):
        k, u = v >> 1, near[v & 1]
        while dropped[u] >= 0:
            u = before[u]
        if turns(u, v, k) >= 0.0:
            hint = u
            while turns(after[u], v, k) >= 0.0 and turns(u, after[u], k) > 0.0:
                u = after[u]
                if u == hint:
                    break
        else:
            while turns(u, v, k) < 0.0:
                u = before[u]
        w = after[u]
        near[v & 1] = u
        if implied(u, v, w, k):
            dropped[v], before[v] = k, u
            continue
        while after[w] != u and implied(v, w, after[w], k):
            dropped[w], before[w] = k, v
            w = after[w]
        while before[u] != w and implied(before[u], u, v, k):
            dropped[u] = k
            u = before[u]
        after[u], before[v], after[v], before[w] = v, u, w, v
        near[v & 1] = v
    return dropped


def _assemble(
    reference: Reference,
    powers: np.ndarray,
    normals: np.ndarray,
    edges: np.ndarray,
    upper: np.ndarray,
    real: np.ndarray,
    dropped: np.ndarray,
) -> Rows:
    """Flat rows of all phases from the phase at which each row was dropped (-1: never), phase by phase."""
    m = reference.m
    sample, column = np.nonzero(real & (dropped < np.minimum(np.arange(len(real)), m)[:, None]))
    first = dropped[sample, column] + 1
    count = np.minimum(sample, m) + 1 - first
    row = np.repeat(np.arange(len(sample)), count)
    phase = np.arange(len(row)) - np.repeat(np.cumsum(count) - count - first, count)
    order = np.argsort(phase.astype(np.int16 if m < 2**15 else np.int64), kind="stable")
    row, phase = row[order], phase[order]
    sample, column = sample[row], column[row]
    along, normal = powers[sample - phase], normals[column]
    S = np.empty((len(row), 4), order="F")
    a = upper[sample, column]
    xi = reference.xi[phase]
    for i in range(4):
        np.multiply(normal[:, i // 2], along[:, i % 2], out=S[:, i])
        a += S[:, i] * xi[:, i]
    start = np.concatenate(([0], np.cumsum(np.bincount(phase, minlength=m + 1))))
    return S, a, start, sample, edges[sample, column]
