"""A library of stepping references over direction, length, step time and initial velocity, kept on disk.

Each reference is planned before anything happens: from the COG over the middle of the feet at some velocity, one
step to a given place, to rest. Online, one product with the rows of all their sets 0O_inf tells which of them
hold the state, and with how much slack.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from controllers.disk_cache import content_key, load_or_build
from controllers.footholds import StepLimits
from controllers.gains import Gain
from controllers.gait import StepPlan, true_supports
from controllers.gait_phases import StepPhases, step_phases
from controllers.gait_program import solve
from controllers.moa import regulator_set
from controllers.pendulum import Pendulum
from controllers.reference import Reference
from controllers.reference_grid import LibraryError, LibraryGrid
from controllers.support import Foot
from controllers.tracking_sets import tracking_sets
from models.arena import SIDES, Side

# Raise when what is planned or stored changes, and every older file is ignored.
_FORMAT = 1
_REACH = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class ReferenceLibrary:
    """References and the rows of their sets 0O_inf.

    Attributes:
        pendulum, gain, feet, settle_time, limits: what they were planned for.
        swing: (L,) number of the swing foot in `SIDES`.
        step_time: (L,) [s].
        landing: (L, 2) foothold [m].
        start: (L, 4) xi_0.
        S, a, first: rows (R, 4), right sides (R,) [m of ZMP], and the first row (L,) of each reference.
        knots, counts: ZMP knots (K, 2) [m] one reference after another, and their numbers (L,).
        from_disk: whether the references were read instead of planned.
    """

    pendulum: Pendulum
    gain: Gain
    feet: Mapping[Side, Foot]
    settle_time: float
    limits: StepLimits
    swing: np.ndarray
    step_time: np.ndarray
    landing: np.ndarray
    start: np.ndarray
    S: np.ndarray
    a: np.ndarray
    first: np.ndarray
    knots: np.ndarray
    counts: np.ndarray
    from_disk: bool

    def __len__(self) -> int:
        return len(self.first)

    def slacks(self, x: np.ndarray) -> np.ndarray:
        """Slack (L,) [m of ZMP] of state x (4,) in the set 0O_inf of every reference; negative outside."""
        return np.minimum.reduceat(self.a - self.S.dot(x), self.first)

    def containing(self, x: np.ndarray) -> np.ndarray:
        """Indices of the references whose sets contain state x (4,), the largest slack first."""
        slack = self.slacks(x)
        order = np.argsort(-slack, kind="stable")
        return order[slack[order] >= 0.0]

    def best(self, x: ArrayLike) -> tuple[int, float]:
        """Index and slack [m of ZMP] of the reference whose set holds state x (4,) best, or misses it least.

        Raises:
            LibraryError: x is not a finite state.
        """
        x = np.asarray(x, dtype=float)
        if x.shape != (4,) or not np.isfinite(x).all():
            raise LibraryError(f"a reference is looked up for a finite state (4,), got {x!r}")
        slack = self.slacks(x)
        index = int(slack.argmax())
        return index, float(slack[index])

    @cached_property
    def _ends(self) -> np.ndarray:
        return np.cumsum(self.counts)

    def plan(self, index: int) -> StepPlan:
        """Reference `index` in full, checked anew."""
        swing, time = SIDES[self.swing[index]], float(self.step_time[index])
        shape = step_phases(self.pendulum, self.feet, (swing,), time, self.limits, settle_time=self.settle_time)
        end = self._ends[index]
        zmp = self.knots[end - self.counts[index] : end]
        return _plan(self.pendulum, self.feet, swing, time, shape, self.start[index], self.landing[index], zmp)


def _plan(
    pendulum: Pendulum,
    feet: Mapping[Side, Foot],
    swing: Side,
    step_time: float,
    shape: StepPhases,
    start: np.ndarray,
    landing: np.ndarray,
    zmp: np.ndarray,
) -> StepPlan:
    foothold = feet[swing].moved(landing)
    supports = true_supports(shape, feet, (swing,), [foothold])
    mu = np.repeat(zmp, shape.knots, axis=0)
    reference = Reference.least_violated(
        pendulum=pendulum,
        xi=pendulum.rollout(start, mu),
        mu=mu,
        supports=supports,
        support_of=np.repeat([0, 1], [shape.ticks[0], shape.settle]),
        final=supports[-1],
    )
    return StepPlan(
        reference=reference,
        slack=float(reference.margins().min()),
        footholds=(foothold,),
        swing=(swing,),
        landings=shape.ticks,
        step_time=step_time,
    )


def reference_library(
    pendulum: Pendulum,
    gain: Gain,
    feet: Mapping[Side, Foot],
    limits: StepLimits,
    grid: LibraryGrid | None = None,
    *,
    margin: float = 0.005,
    settle_time: float = 0.6,
    directory: Path | None = None,
) -> ReferenceLibrary:
    """Read the library of these inputs from disk, or plan and keep it.

    Args:
        pendulum: model and period.
        gain: feedback of the tracking controller, and of the regulator that takes over.
        feet: both feet on the floor.
        limits: reach of a foot; combinations beyond it are left out.
        grid: what the references differ by.
        margin: what every reference keeps to the edges of its supports [m]; what cannot is left out.
        settle_time: double support after the step [s].
        directory: where it is kept; the user's cache directory if None.

    Raises:
        LibraryError: the margin is not a length, or no combination can be planned.
        CacheError: the directory cannot be written.
        UnstableGainError, MoaError: the gain has no set.
    """
    grid = LibraryGrid() if grid is None else grid
    if not (math.isfinite(margin) and margin >= 0.0):
        raise LibraryError(f"margin must be a finite non-negative number of metres, got {margin!r}")
    gain.require_stable(pendulum)
    inputs = {
        "format": np.array([_FORMAT]),
        "numbers": np.array([pendulum.omega, pendulum.dt, margin, settle_time]),
        "limits": np.array(astuple(limits)),
        "F": gain.F,
        "swings": np.array([SIDES.index(side) for side in grid.swings]),
    }
    for name in ("directions", "lengths", "step_times", "speeds"):
        inputs[name] = np.array(getattr(grid, name), dtype=float)
    for side in SIDES:
        foot = feet[side]
        inputs |= {f"{side} pose": np.append(foot.position, foot.yaw), f"{side} sole": foot.sole}

    def build() -> Mapping[str, np.ndarray]:
        return _build(pendulum, gain, feet, limits, grid, margin, settle_time)

    arrays, from_disk = load_or_build(content_key(inputs), build, directory)
    for value in arrays.values():
        value.setflags(write=False)
    return ReferenceLibrary(
        pendulum=pendulum, gain=gain, feet=dict(feet), settle_time=settle_time, limits=limits,
        from_disk=from_disk, **arrays,
    )  # fmt: skip


def _build(
    pendulum: Pendulum,
    gain: Gain,
    feet: Mapping[Side, Foot],
    limits: StepLimits,
    grid: LibraryGrid,
    margin: float,
    settle_time: float,
) -> Mapping[str, np.ndarray]:
    rest = pendulum.rest(0.5 * (feet["left"].position + feet["right"].position))
    found: list[tuple[int, float, np.ndarray, np.ndarray]] = []
    rows, sides, knots = [], [], []
    for swing, time, way, velocity in grid.combinations():
        shape = step_phases(pendulum, feet, (swing,), time, limits, settle_time=settle_time)
        landing, start = feet[swing].position + way, rest.copy()
        start[1::2] = velocity
        reach = shape.reach
        assert reach is not None
        way_in = reach.G @ landing
        if (way_in < reach.lower - _REACH).any() or (way_in > reach.upper + _REACH).any():
            continue
        fixed = shape.landed(landing)
        solution = solve(
            pendulum, start, fixed.phases, end_base=fixed.end_base, end_share=fixed.end_share,
            nominal=np.zeros((0, 2)), reach=None, zmp_margin=margin,
        )  # fmt: skip
        zmp = solution.mu[np.cumsum((0, *shape.knots[:-1]))]
        plan = _plan(pendulum, feet, swing, time, shape, start, landing, zmp)
        # The program aims at the margin up to its own tolerance.
        if plan.slack < margin - _REACH:
            continue
        reference = plan.reference
        terminal = regulator_set(pendulum, gain, reference.final, reference.xi[-1, 0::2])
        sets = tracking_sets(pendulum, gain, reference, terminal).polytope(0)
        finite = np.isfinite(sets.a)
        found.append((SIDES.index(swing), time, landing, start))
        rows.append(sets.S[finite])
        sides.append(sets.a[finite])
        knots.append(zmp)
    if not found:
        raise LibraryError(
            f"no reference of the grid is within reach and keeps {margin:g} m: "
            "allow shorter steps, lower speeds, more time or less margin"
        )
    return {
        "swing": np.array([entry[0] for entry in found]),
        "step_time": np.array([entry[1] for entry in found]),
        "landing": np.array([entry[2] for entry in found]),
        "start": np.array([entry[3] for entry in found]),
        "S": np.vstack(rows),
        "a": np.concatenate(sides),
        "first": np.cumsum([0, *(len(side) for side in sides[:-1])]),
        "knots": np.vstack(knots),
        "counts": np.array([len(knot) for knot in knots]),
    }
