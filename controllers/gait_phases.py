"""What a stepping plan is made of before any state is known: supports knot by knot, rest at the end, reach."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from controllers.footholds import StepLimits, reach_rows
from controllers.gait_program import Phase, PlanningError, Reach, knot_ticks
from controllers.pendulum import Pendulum
from controllers.support import Foot, Point, SupportPolygon, support_polygon
from models.arena import Side
from models.robot import other

# Single support decides the plan and is short; the final double support only has to come to rest.
_STEP_KNOT = 0.025
_SETTLE_KNOT = 0.050
# After the last landing the ZMP goes to the landed foot, where a push is stopped farthest out (Koolen's
# one-step limit), and returns to the middle between these fractions of the settling time. Of fourteen
# schedules this one caught the largest pushes forward and sideways.
_RETURN = (0.4, 0.7)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepPhases:
    """Supports and ends of all plans with the same feet, swing sequence and times, affine in the footholds.

    Attributes:
        phases: knots of each single support, then of the final double support.
        ticks: periods of each step.
        settle: periods of the final double support.
        end_base, end_share: constant (2,) [m] and share (N,) of the footholds of the point of rest.
        reach: rows that the footholds obey; None without a step.
        soles: outline of each foot about its foot point, turned to its yaw.
        standing: (2,) stance foot of the first step [m].
    """

    phases: tuple[Phase, ...]
    ticks: tuple[int, ...]
    settle: int
    end_base: np.ndarray
    end_share: np.ndarray
    reach: Reach | None
    soles: Mapping[Side, SupportPolygon]
    standing: np.ndarray

    @property
    def steps(self) -> int:
        """Number of footholds N."""
        return len(self.ticks)

    @property
    def knots(self) -> tuple[int, ...]:
        """Periods of every knot in order."""
        return tuple(n for phase in self.phases for n in phase.ticks)

    def landed(self, footholds: np.ndarray) -> StepPhases:
        """The same with the footholds (N, 2) decided, so that nothing depends on them any more."""
        footholds = np.asarray(footholds, dtype=float).reshape(-1, 2)
        phases = tuple(
            replace(phase, base=phase.base + phase.share @ footholds, share=np.zeros(0)) for phase in self.phases
        )
        return replace(
            self,
            phases=phases,
            end_base=self.end_base + self.end_share @ footholds,
            end_share=np.zeros(0),
            reach=None,
        )


def step_phases(
    pendulum: Pendulum,
    feet: Mapping[Side, Foot],
    swing: Sequence[Side],
    step_time: float,
    limits: StepLimits,
    *,
    swing_time_left: float | None = None,
    swing_position: Point | None = None,
    settle_time: float = 0.6,
) -> StepPhases:
    """Lay out the supports of a plan; the arguments are those of `gait.plan_steps`.

    Raises:
        PlanningError: a time is not finite or shorter than one period, or a foot steps twice in a row.
    """
    swing = tuple(swing)
    first = step_time if swing_time_left is None else max(swing_time_left, 0.0)
    if not all(map(math.isfinite, (step_time, first, settle_time))):
        raise PlanningError(f"a plan needs finite times, got {step_time!r}, {swing_time_left!r}, {settle_time!r} s")
    if min(step_time, settle_time) < pendulum.dt or any(a == b for a, b in itertools.pairwise(swing)):
        raise PlanningError(f"steps must alternate and times reach one period, got {swing}, {step_time} s")

    dt = pendulum.dt
    settle = max(1, round(settle_time / dt))
    settle_knots = knot_ticks(settle, max(1, round(_SETTLE_KNOT / dt)))
    soles = {side: _sole(foot.yaw, foot.sole.tobytes()) for side, foot in feet.items()}
    if not swing:
        hull = support_polygon([feet["left"], feet["right"]])
        middle = 0.5 * (feet["left"].position + feet["right"].position)
        nothing = np.zeros(0)
        phase = Phase(ticks=settle_knots, M=hull.M, h=hull.v, base=np.zeros(2), share=nothing, middle=middle)
        return StepPhases(
            phases=(phase,), ticks=(), settle=settle, end_base=middle, end_share=nothing,
            reach=None, soles=soles, standing=middle,
        )  # fmt: skip

    ticks = [max(1, round(t / dt)) for t in (first, *[step_time] * (len(swing) - 1))]
    start = feet[swing[0]].position if swing_position is None else np.array(swing_position, dtype=float)
    stances: tuple[Side, ...] = tuple(other(side) for side in swing)
    standing = feet[stances[0]].position
    phases = []
    for i, side in enumerate(stances):
        # Step i stands on foothold i - 1; the first on the foot that is on the floor now.
        share = np.zeros(len(swing))
        share[i - 1 : i] = 1.0
        sole = soles[side]
        phases.append(
            Phase(
                ticks=knot_ticks(ticks[i], max(1, round(_STEP_KNOT / dt))),
                M=sole.M,
                h=sole.v,
                base=standing if i == 0 else np.zeros(2),
                share=share,
                middle=sole.centre,
            )
        )
    end = np.zeros(len(swing))
    end[-2:] = 0.5
    fixed = standing if len(swing) == 1 else np.zeros(2)
    phases.append(_double_support(settle_knots, soles[stances[-1]], soles[swing[-1]], fixed, len(swing)))
    return StepPhases(
        phases=tuple(phases), ticks=tuple(ticks), settle=settle, end_base=0.5 * fixed, end_share=end,
        reach=reach_rows(feet, swing, ticks, start, dt, limits), soles=soles, standing=standing,
    )  # fmt: skip


@lru_cache(maxsize=64)
def _sole(yaw: float, sole: bytes) -> SupportPolygon:
    """Sole turned by `yaw` around the foot point; the plans of one tick share it."""
    return support_polygon([Foot(position=np.zeros(2), yaw=yaw, sole=np.frombuffer(sole).reshape(-1, 2))])


def _double_support(
    knots: tuple[int, ...], old: SupportPolygon, new: SupportPolygon, fixed: np.ndarray, steps: int
) -> Phase:
    """Minkowski combination (1 - alpha) old + alpha new: inside the hull, and affine in the footholds."""
    middles = (np.cumsum(knots) - 0.5 * np.array(knots)) / sum(knots)
    alpha = np.interp(middles, _RETURN, (1.0, 0.5))
    same = old.M.shape == new.M.shape and np.abs(old.M - new.M).max() < 1e-9
    normals = old.M if same else np.vstack([old.M, new.M])
    widths = [np.max(polygon.vertices @ normals.T, axis=0) for polygon in (old, new)]
    share = np.zeros((len(knots), steps))
    share[:, -1] = alpha
    if steps > 1:
        share[:, -2] = 1.0 - alpha
    column = alpha[:, None]
    return Phase(
        ticks=knots,
        M=normals,
        h=(1.0 - column) * widths[0] + column * widths[1],
        base=(1.0 - column) * fixed,
        share=share,
        middle=(1.0 - column) * old.centre + column * new.centre,
    )
