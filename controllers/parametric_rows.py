"""Rows of the parametric set: which (x_0, xi_0, footholds) keep the ZMP inside, for ever.

The referential ZMP is an explicit affine function of xi_0 and the footholds p: on each knot it is the middle of
the support plus a few fixed shapes over time, whose heights follow from the end at rest. What is left are the
constraints (28) of each tick, M_k (mu_k - F Atilde^k e_0) <= v_k - s with e_0 = x_0 - xi_0, those of the
regulator that takes over at rest, those of the reference itself, and the reach of the feet.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from controllers.gains import Gain
from controllers.gait_phases import StepPhases
from controllers.gait_program import end_modes
from controllers.linear_program import LinearProgram, UnboundedProgramError
from controllers.moa import MoaSet
from controllers.pendulum import Pendulum

# A row is left out if what it would cut off is below this [m of ZMP]: rounding, not a tolerance of the set.
_REDUNDANT = 1e-10
# Knots whose coefficients agree to rounding ask the same.
_EQUAL = 1e-12


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ZmpLaw:
    """ZMP of each knot, z = constant + by_state [d; c] + by_foothold p, for xi_0 in modes and each axis alike.

    Attributes:
        constant: (K, 2) [m].
        by_state: (K, 2) weight of the divergent and the convergent mode of xi_0 along the same axis.
        by_foothold: (K, N) weight of each foothold.
    """

    constant: np.ndarray
    by_state: np.ndarray
    by_foothold: np.ndarray


def zmp_law(pendulum: Pendulum, shape: StepPhases, profile: np.ndarray) -> ZmpLaw:
    """ZMP knots that end at rest, with offsets from the middles of the supports of the given `profile` (K, 2)."""
    modes, decay = end_modes(pendulum, shape.knots)
    count, steps = len(shape.knots), shape.steps
    base, share = np.empty((count, 2)), np.empty((count, steps))
    knot = 0
    for phase in shape.phases:
        own = slice(knot, knot + len(phase.ticks))
        base[own], share[own] = phase.base + phase.middle, phase.share
        knot += len(phase.ticks)
    # profile @ heights is what the ends ask for: q end = d_0 + g z and end = q c_0 + h z.
    to_heights = profile @ np.linalg.inv(modes @ profile)
    whole = np.array([decay, 1.0])
    return ZmpLaw(
        constant=base + to_heights @ (np.outer(whole, shape.end_base) - modes @ base),
        by_state=-to_heights * np.array([1.0, decay]),
        by_foothold=share + to_heights @ (np.outer(whole, shape.end_share) - modes @ share),
    )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Rows:
    """Constraints of_error e_0 + of_start xi_0 + of_feet p + of_slack s <= a - of_margin (margin), R of them.

    Attributes:
        of_error: (R, 4), of e_0 = x_0 - xi_0.
        of_start: (R, 4).
        of_feet: (R, 2N), of the footholds one after another.
        of_slack: (R,) one for the ZMP under tracking, zero otherwise.
        of_margin: (R,) one for the ZMP of the reference, zero otherwise.
        a: (R,) [m].
    """

    of_error: np.ndarray
    of_start: np.ndarray
    of_feet: np.ndarray
    of_slack: np.ndarray
    of_margin: np.ndarray
    a: np.ndarray

    def pruned(self, omega: float, margin: float) -> Rows:
        """The rows that cut something off those kept before them and those to come."""
        unit = np.tile([1.0, omega, 1.0, omega], 2)
        matrix = np.hstack((np.hstack((self.of_error, self.of_start)) * unit, self.of_feet, self.of_slack[:, None]))
        a = self.a - self.of_margin * margin
        program = LinearProgram(matrix, a)
        kept = []
        for i, row in enumerate(matrix):
            program.drop(i)
            try:
                cuts = bool(row @ program.maximise(row) > a[i] + _REDUNDANT)
            except UnboundedProgramError:
                cuts = True
            if cuts:
                kept.append(i)
                program.restore(i)
        which = np.array(kept, dtype=np.intp)
        return Rows(
            of_error=self.of_error[which], of_start=self.of_start[which], of_feet=self.of_feet[which],
            of_slack=self.of_slack[which], of_margin=self.of_margin[which], a=self.a[which],
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Stage:
    """Ticks first..last - 1 with one support M o <= h, and the offset o = constant + of_start xi_0 + of_feet p."""

    first: int
    last: int
    M: np.ndarray
    h: np.ndarray
    of_start: np.ndarray
    of_feet: np.ndarray
    constant: np.ndarray

    def same(self, other: _Stage) -> bool:
        """Whether both ask the same of the reference."""
        return self.M is other.M and all(
            np.abs(mine - its).max(initial=0.0) <= _EQUAL
            for mine, its in (
                (self.h, other.h), (self.of_start, other.of_start),
                (self.of_feet, other.of_feet), (self.constant, other.constant),
            )
        )  # fmt: skip


def _stages(pendulum: Pendulum, shape: StepPhases, law: ZmpLaw) -> list[_Stage]:
    # Modes d, c = p +- pd / w of each axis.
    weights = np.array([[1.0, 1.0 / pendulum.omega], [1.0, -1.0 / pendulum.omega]])
    stages: list[_Stage] = []
    knot, tick = 0, 0
    for phase in shape.phases:
        k = len(phase.ticks)
        base, share = np.broadcast_to(phase.base, (k, 2)), np.broadcast_to(phase.share, (k, shape.steps))
        h = np.broadcast_to(phase.h, (k, len(phase.M)))
        for j, ticks in enumerate(phase.ticks):
            stage = _Stage(
                first=tick, last=tick + ticks, M=phase.M, h=h[j],
                of_start=np.kron(np.eye(2), law.by_state[knot] @ weights),
                of_feet=np.kron(law.by_foothold[knot] - share[j], np.eye(2)),
                constant=law.constant[knot] - base[j],
            )  # fmt: skip
            if stages and stages[-1].same(stage):
                stage = replace(stages.pop(), last=stage.last)
            stages.append(stage)
            knot, tick = knot + 1, tick + ticks
    return stages


def parametric_rows(pendulum: Pendulum, gain: Gain, terminal: MoaSet, shape: StepPhases, law: ZmpLaw) -> Rows:
    """All rows. The terminal set is that of rest at the origin, in the last support about it."""
    ends_only = gain.dcm_ratio(pendulum) is not None
    powers = _powers(gain.closed_loop(pendulum), sum(shape.knots) + 1)
    blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray, float, float, np.ndarray]] = []
    for stage in _stages(pendulum, shape, law):
        of_start, of_feet, a = stage.M @ stage.of_start, stage.M @ stage.of_feet, stage.h - stage.M @ stage.constant
        blocks.append((np.zeros(of_start.shape), of_start, of_feet, 0.0, 1.0, a))
        # The ZMP of a DCM gain moves one way while mu is held: between the ends nothing binds.
        ticks = {stage.first, stage.last - 1} if ends_only else range(stage.first, stage.last)
        blocks += [(-stage.M @ gain.F @ powers[tick], of_start, of_feet, 1.0, 0.0, a) for tick in sorted(ticks)]
    size = 2 * shape.steps
    last = terminal.S @ powers[-1]
    blocks.append((last, np.zeros(last.shape), np.zeros((len(last), size)), 1.0, 0.0, terminal.a))
    if shape.reach is not None:
        nothing = np.zeros((len(shape.reach.G), 4))
        blocks.append((nothing, nothing, shape.reach.G, 0.0, 0.0, shape.reach.upper))
        blocks.append((nothing, nothing, -shape.reach.G, 0.0, 0.0, -shape.reach.lower))
    return Rows(
        of_error=np.vstack([block[0] for block in blocks]),
        of_start=np.vstack([block[1] for block in blocks]),
        of_feet=np.vstack([block[2] for block in blocks]),
        of_slack=np.concatenate([np.full(len(block[5]), block[3]) for block in blocks]),
        of_margin=np.concatenate([np.full(len(block[5]), block[4]) for block in blocks]),
        a=np.concatenate([block[5] for block in blocks]),
    )


def _powers(loop: np.ndarray, count: int) -> list[np.ndarray]:
    powers = [np.eye(len(loop))]
    for _ in range(count - 1):
        powers.append(loop @ powers[-1])
    return powers
