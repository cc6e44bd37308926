"""Stepping references planned from the measured state."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from controllers.footholds import StepLimits, nominal_footholds, reach_rows
from controllers.gait_program import Phase, PlanningError, knot_ticks, solve
from controllers.pendulum import Pendulum
from controllers.reference import Reference
from controllers.support import Foot, Point, SupportPolygon, support_polygon
from models.robot import Side, other

# Single support decides the plan and is short; the final double support only has to come to rest.
_STEP_KNOT = 0.025
_SETTLE_KNOT = 0.050
# After the last landing the ZMP goes to the landed foot, where a push is stopped farthest out (Koolen's
# one-step limit), and returns to the middle between these fractions of the settling time. Of fourteen
# schedules this one caught the largest pushes forward and sideways.
_RETURN = (0.4, 0.7)

# Beyond kilometres (and for NaN) the rounding of a plan is larger than the robot.
_FARTHEST = 1e4


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepPlan:
    """A stepping reference with the footholds that it stands on.

    Attributes:
        reference: xi and mu with the true supports; not admissible where slack < 0.
        slack: smallest ZMP margin over the reference [m]; >= 0 makes xi_0 a member of its tracking sets.
        footholds: where each step lands.
        swing: which foot each step moves.
        landings: tick k at which each step lands: double or the next single support holds from k on.
        step_time: planned duration of a whole step [s].
    """

    reference: Reference
    slack: float
    footholds: tuple[Foot, ...]
    swing: tuple[Side, ...]
    landings: tuple[int, ...]
    step_time: float


def plan_steps(
    pendulum: Pendulum,
    x0: np.ndarray,
    feet: Mapping[Side, Foot],
    swing: Sequence[Side],
    step_time: float,
    limits: StepLimits,
    *,
    swing_time_left: float | None = None,
    swing_position: Point | None = None,
    zmp_margin: float = 0.005,
    settle_time: float = 0.6,
) -> StepPlan:
    """Plan steps from the state x0 (4,) that keep the ZMP as far inside the supports as they can.

    Steps follow each other without double support; after the last landing the COG comes to rest over the
    middle of the feet (11).

    Args:
        pendulum: model and period.
        x0: measured state, the exact xi_0.
        feet: both feet on the floor; of one in the air only sole and yaw count if swing_position is given.
        swing: feet in the order they step; empty to come to rest in the present double support.
        step_time: duration of a step [s].
        limits: reach of a foot.
        swing_time_left: what is left of a first step under way [s]; None for a whole step.
        swing_position: where the first swing foot is now (2,) [m]; None for its place in `feet`.
        zmp_margin: margin beyond which more is worth nothing [m].
        settle_time: double support after the last landing [s].

    Raises:
        PlanningError: the arguments do not fit, or no footholds are within reach.
    """
    x0 = np.array(x0, dtype=float)
    swing = tuple(swing)
    first = step_time if swing_time_left is None else max(swing_time_left, 0.0)
    times = (step_time, first, zmp_margin, settle_time)
    if x0.shape != (4,) or not (np.abs(x0).max() < _FARTHEST and all(map(math.isfinite, times))):
        raise PlanningError(f"a plan needs finite times and a state (4,) of a robot in sight, got {x0!r}")
    if min(step_time, settle_time) < pendulum.dt or any(a == b for a, b in itertools.pairwise(swing)):
        raise PlanningError(f"steps must alternate and times reach one period, got {swing}, {step_time} s")

    dt = pendulum.dt
    settle = max(1, round(settle_time / dt))
    settle_knots = knot_ticks(settle, max(1, round(_SETTLE_KNOT / dt)))
    if not swing:
        return _settle(pendulum, x0, feet, settle_knots, step_time, zmp_margin)

    ticks = [max(1, round(t / dt)) for t in (first, *[step_time] * (len(swing) - 1))]
    start = feet[swing[0]].position if swing_position is None else np.array(swing_position, dtype=float)
    soles = {side: _sole(foot.yaw, foot.sole.tobytes()) for side, foot in feet.items()}
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
    solution = solve(
        pendulum,
        x0,
        phases,
        end_base=0.5 * fixed,
        end_share=end,
        nominal=nominal_footholds(pendulum, x0, feet, swing, ticks, soles, limits),
        reach=reach_rows(feet, swing, ticks, start, dt, limits),
        zmp_margin=zmp_margin,
    )

    footholds = tuple(feet[side].moved(p) for side, p in zip(swing, solution.footholds, strict=True))
    places = [standing, *solution.footholds]
    supports = [soles[side].moved(place) for side, place in zip(stances, places, strict=False)]
    final = support_polygon([feet[stances[0]] if len(swing) == 1 else footholds[-2], footholds[-1]])
    reference = Reference.least_violated(
        pendulum=pendulum,
        xi=solution.xi,
        mu=solution.mu,
        supports=(*supports, final),
        support_of=np.repeat(np.arange(len(swing) + 1), [*ticks, settle]),
        final=final,
    )
    return StepPlan(
        reference=reference,
        slack=float(reference.margins().min()),
        footholds=footholds,
        swing=swing,
        landings=tuple(int(k) for k in np.cumsum(ticks)),
        step_time=step_time,
    )


@lru_cache(maxsize=64)
def _sole(yaw: float, sole: bytes) -> SupportPolygon:
    """Sole turned by `yaw` around the foot point; the plans of one tick share it."""
    return support_polygon([Foot(position=np.zeros(2), yaw=yaw, sole=np.frombuffer(sole).reshape(-1, 2))])


def _settle(
    pendulum: Pendulum,
    x0: np.ndarray,
    feet: Mapping[Side, Foot],
    knots: tuple[int, ...],
    step_time: float,
    zmp_margin: float,
) -> StepPlan:
    hull = support_polygon([feet["left"], feet["right"]])
    middle = 0.5 * (feet["left"].position + feet["right"].position)
    none = np.zeros((0, 2))
    phase = Phase(ticks=knots, M=hull.M, h=hull.v, base=np.zeros(2), share=np.zeros(0), middle=middle)
    solution = solve(
        pendulum,
        x0,
        [phase],
        end_base=middle,
        end_share=np.zeros(0),
        nominal=none,
        reach=None,
        zmp_margin=zmp_margin,
    )
    reference = Reference.least_violated(
        pendulum=pendulum,
        xi=solution.xi,
        mu=solution.mu,
        supports=(hull,),
        support_of=np.zeros(len(solution.mu), dtype=np.intp),
        final=hull,
    )
    slack = float(reference.margins().min())
    return StepPlan(reference=reference, slack=slack, footholds=(), swing=(), landings=(), step_time=step_time)


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
