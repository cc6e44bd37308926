"""What the sets are timed against: the `polytope` library, and the textbook written down plainly."""

from __future__ import annotations

import numpy as np
import polytope
from scipy.optimize import linprog

from controllers.admissible.moa import MoaSet
from controllers.admissible.tracking_sets import TrackingSets
from controllers.pendulum import Pendulum

_SAME = 1e-9


def gilbert_tan(pendulum: Pendulum, moa: MoaSet) -> tuple[np.ndarray, np.ndarray]:
    """Gilbert and Tan's algorithm: a linear program for each row of the next sample, until none cuts.

    Returns:
        S (r, 4) and a (r,) of the set that `moa` holds, in xbar.
    """
    loop = moa.gain.closed_loop(pendulum)
    block = -moa.polygon.M @ moa.gain.F
    limits = moa.polygon.v - moa.polygon.M @ moa.centre
    S, a = block, limits
    while True:
        block = block @ loop
        worst = [_most(row, S, a) for row in block]
        cuts = np.array(worst) > limits + _SAME
        if not cuts.any():
            return S, a
        S, a = np.vstack((S, block[cuts])), np.concatenate((a, limits[cuts]))


def _most(row: np.ndarray, S: np.ndarray, a: np.ndarray) -> float:
    """Largest row x over {S x <= a}, by the call that a textbook makes: HiGHS, cold every time."""
    answer = linprog(-row, A_ub=S, b_ub=a, bounds=(None, None), method="highs")
    return float("inf") if answer.fun is None else -float(answer.fun)


def rows_with_redundant_ones(pendulum: Pendulum, moa: MoaSet, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """(23) and (24) up to a sample beyond t*, nothing left out."""
    loop, block, blocks = moa.gain.closed_loop(pendulum), -moa.polygon.M @ moa.gain.F, []
    for _ in range(samples):
        blocks.append(block)
        block = block @ loop
    limits = moa.polygon.v - moa.polygon.M @ moa.centre
    return np.vstack(blocks), np.tile(limits, samples)


def library_set(S: np.ndarray, a: np.ndarray) -> polytope.Polytope:
    """The same set for `polytope`, with its rows as they are."""
    return polytope.Polytope(S, a, normalize=False)


def reduced(S: np.ndarray, a: np.ndarray) -> polytope.Polytope:
    """`polytope.reduce`: a linear program a row."""
    return polytope.reduce(library_set(S, a))


def paper_phase(sets: TrackingSets, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of phase k as the paper writes them, (29)-(41) with the corrected exponents: sums from k to the end."""
    reference, F = sets.reference, sets.gain.F
    A, B = sets.gain.closed_loop(sets.pendulum), sets.pendulum.B
    S, a = [], []
    power, forced = np.eye(4), np.zeros(4)
    for j in range(k, reference.m):
        polygon = reference.support(j)
        b = reference.mu[j] + F @ reference.xi[j]
        S.append(-polygon.M @ F @ power)
        a.append(polygon.v - polygon.M @ (b - F @ forced))
        forced = A @ forced + B @ b
        power = A @ power
    terminal = sets.terminal
    S.append(terminal.S @ power)
    a.append(terminal.a + terminal.S @ (terminal.x_C - forced))
    return np.vstack(S), np.concatenate(a)
