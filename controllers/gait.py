"""Stepping references planned from the measured state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from controllers.footholds import StepLimits, nominal_footholds
from controllers.gait_phases import StepPhases, step_phases
from controllers.gait_program import PlanningError, solve
from controllers.pendulum import Pendulum
from controllers.reference import Reference
from controllers.support import Foot, Point, SupportPolygon, support_polygon
from models.arena import Side
from models.robot import other

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
    if x0.shape != (4,) or not (np.abs(x0).max() < _FARTHEST and math.isfinite(zmp_margin)):
        raise PlanningError(f"a plan needs a finite margin and a state (4,) of a robot in sight, got {x0!r}")
    shape = step_phases(
        pendulum,
        feet,
        swing,
        step_time,
        limits,
        swing_time_left=swing_time_left,
        swing_position=swing_position,
        settle_time=settle_time,
    )
    nominal = (
        nominal_footholds(pendulum, x0, feet, swing, shape.ticks, shape.soles, limits) if swing else np.zeros((0, 2))
    )
    solution = solve(
        pendulum,
        x0,
        shape.phases,
        end_base=shape.end_base,
        end_share=shape.end_share,
        nominal=nominal,
        reach=shape.reach,
        zmp_margin=zmp_margin,
    )
    footholds = tuple(feet[side].moved(p) for side, p in zip(swing, solution.footholds, strict=True))
    supports = true_supports(shape, feet, swing, footholds)
    reference = Reference.least_violated(
        pendulum=pendulum,
        xi=solution.xi,
        mu=solution.mu,
        supports=supports,
        support_of=np.repeat(np.arange(len(swing) + 1), [*shape.ticks, shape.settle]),
        final=supports[-1],
    )
    return StepPlan(
        reference=reference,
        slack=float(reference.margins().min()),
        footholds=footholds,
        swing=swing,
        landings=tuple(int(k) for k in np.cumsum(shape.ticks)),
        step_time=step_time,
    )


def true_supports(
    shape: StepPhases, feet: Mapping[Side, Foot], swing: Sequence[Side], footholds: Sequence[Foot]
) -> tuple[SupportPolygon, ...]:
    """Support polygon of each step and of the final double support, which is the whole hull of both feet."""
    if not swing:
        return (support_polygon([feet["left"], feet["right"]]),)
    stances = [other(side) for side in swing]
    places = [shape.standing, *(foothold.position for foothold in footholds)]
    steps = [shape.soles[side].moved(place) for side, place in zip(stances, places, strict=False)]
    last = feet[stances[0]] if len(swing) == 1 else footholds[-2]
    return (*steps, support_polygon([last, footholds[-1]]))
