"""The walk of Section IV-C, whose tracking sets are Fig. 5."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference
from controllers.reference.reference_program import Phase, PlanningError, knot_ticks, solve
from models.arena import Side
from models.robot import other

_KNOT = 0.025


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Stride:
    """One foot of a walk in the air.

    Attributes:
        side: which.
        lift, landing: ticks k; it carries no weight from the one on and carries it again from the other on.
        foothold: where it lands.
    """

    side: Side
    lift: int
    landing: int
    foothold: Foot


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class WalkPlan:
    """A reference with the feet that it stands on.

    Attributes:
        reference: xi, mu and supports (26).
        strides: in order of time, with both feet on the floor before, between and after them.
    """

    reference: Reference
    strides: tuple[Stride, ...]


def walk_plan(
    pendulum: Pendulum,
    feet: Mapping[Side, Foot],
    stride: float = 0.1,
    steps: int = 4,
    step_time: float = 0.5,
    *,
    double_support: float = 0.1,
    first: Side = "right",
    zmp_margin: float = 0.005,
) -> WalkPlan:
    """Walk straight ahead from rest to rest (Section IV-C); the last step closes the feet.

    Each step of `step_time` begins and ends with `double_support`, so a step from rest can shift the COG
    before it lifts a foot.

    Args:
        pendulum: model and period.
        feet: both feet, on the floor; the COG starts over their middle.
        stride: distance of a foothold ahead of the stance foot along its heading [m].
        steps: number of steps, at least one.
        step_time: from the middle of one double support to the middle of the next [s].
        double_support: double support at each end of a step [s].
        first: the foot that steps first.
        zmp_margin: margin to every support edge that is aimed at [m].

    Raises:
        PlanningError: the times do not fit, or no motion keeps the ZMP inside.
    """
    dt = pendulum.dt
    double, single = round(double_support / dt), round((step_time - 2.0 * double_support) / dt)
    if steps < 1 or double < 1 or single < 1:
        raise PlanningError(f"a walk needs steps with both single and double support, got {steps} of {step_time} s")
    knot = max(1, round(_KNOT / dt))
    down = dict(feet)
    middle = 0.5 * (feet["left"].position + feet["right"].position)
    x0, rests = pendulum.rest(middle), middle
    phases, supports, lasts, strides = [], [], [], []

    def hold(on: Sequence[Foot], ticks: int, rest: np.ndarray, goal: np.ndarray) -> None:
        polygon, knots = support_polygon(on), knot_ticks(ticks, knot)
        progress = ((np.cumsum(knots) - 0.5 * np.array(knots)) / ticks)[:, None]
        nowhere, nothing = np.zeros(2), np.zeros(0)
        target = rest + progress * (goal - rest)
        phases.append(Phase(ticks=knots, M=polygon.M, h=polygon.v, base=nowhere, share=nothing, middle=target))
        supports.append(polygon)
        lasts.append(ticks)

    side = first
    for step in range(steps):
        stance = down[other(side)]
        hold(list(down.values()), double, rests, stance.position)
        hold([stance], single, stance.position, stance.position)
        heading = np.array([math.cos(stance.yaw), math.sin(stance.yaw)])
        # Beside the stance foot as far as at the start, and one stride ahead of it but for the last step.
        beside = feet[side].position - feet[other(side)].position
        ahead = (0.0 if step == steps - 1 else stride) - beside @ heading
        down[side] = down[side].moved(stance.position + beside + ahead * heading)
        landing = sum(lasts)
        strides.append(Stride(side=side, lift=landing - single, landing=landing, foothold=down[side]))
        goal = 0.5 * (down["left"].position + down["right"].position)
        hold(list(down.values()), double, stance.position, goal)
        side, rests = other(side), goal
    solution = solve(
        pendulum,
        x0,
        phases,
        end_base=rests,
        end_share=np.zeros(0),
        nominal=np.zeros((0, 2)),
        reach=None,
        zmp_margin=zmp_margin,
    )
    if solution.margin < 0.0:
        raise PlanningError(f"the walk leaves its supports by {-solution.margin:.3g} m at best")
    reference = Reference(
        pendulum=pendulum,
        xi=solution.xi,
        mu=solution.mu,
        supports=tuple(supports),
        support_of=np.repeat(np.arange(len(lasts)), lasts),
        final=supports[-1],
    )
    return WalkPlan(reference=reference, strides=tuple(strides))
