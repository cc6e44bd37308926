"""Plans are the best there are: Koolen's limits from inside, and the margins that linear programs find."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from controllers.gait import plan_steps
from controllers.support import support_polygon
from models.robot import Side
from tests.controllers.gait_stance import LIMITS, OMEGA, PENDULUM, SOLVER, pushed, standing

FRONT = 0.0495


def largest_push(swing: tuple[Side, ...], step_time: float, settle_time: float = 0.6) -> float:
    low, high = 0.0, 2.0
    while high - low > 1e-3:
        speed = 0.5 * (low + high)
        plan = plan_steps(
            PENDULUM,
            pushed(speed),
            standing(),
            swing,
            step_time,
            LIMITS,
            zmp_margin=0.0,
            settle_time=settle_time,
        )
        low, high = (speed, high) if plan.slack >= -SOLVER else (low, speed)
    return low


def test_margin_is_aimed_at_and_no_more() -> None:
    for margin in (0.002, 0.008):
        plan = plan_steps(PENDULUM, pushed(0.38), standing(), ("left",), 0.3, LIMITS, zmp_margin=margin)
        # This push is caught with little to spare, so the margin asked for is binding.
        assert plan.slack == pytest.approx(margin, abs=1e-6)


def test_one_step_push_approaches_the_capture_limit_from_inside() -> None:
    step_time = 0.3
    reach, decay = LIMITS.max_stride, math.exp(-OMEGA * step_time)
    koolen = OMEGA * (FRONT + reach * decay)  # d_1 = r + (l + d_0 - r) e^{-wT} with d_0 = r
    # Inside, because the DCM must come back from the front edge to the middle of the feet and the COG to rest
    # in a finite time, with the ZMP bound to the landed foot for 40 % of it.
    assert 0.95 * koolen < largest_push(("left",), step_time) < koolen
    # With more time to come to rest that reason fades; knots of 25 and 50 ms and the bisection are left.
    assert 0.985 * koolen < largest_push(("left",), step_time, settle_time=1.2) < koolen
    # The same two figures for standing still, whose limit is omega c.
    assert 0.9 * OMEGA * FRONT < largest_push((), step_time) < OMEGA * FRONT
    assert 0.985 * OMEGA * FRONT < largest_push((), step_time, settle_time=1.2) < OMEGA * FRONT


def test_shorter_steps_and_more_steps_catch_larger_pushes() -> None:
    assert largest_push(("left",), 0.2) > 1.1 * largest_push(("left",), 0.3)
    assert largest_push(("right", "left"), 0.3) > 1.05 * largest_push(("left",), 0.3)


def test_settling_reaches_what_a_linear_program_reaches() -> None:
    """In double support the hull is known: the largest margin from an independent solver and roll-out."""
    x0, feet = np.array([0.02, 0.3, 0.01, 0.1]), standing(0.05)
    plan = plan_steps(PENDULUM, x0, feet, (), 0.3, LIMITS, zmp_margin=0.1)
    hull = support_polygon(list(feet.values()))
    count, ticks = 12, 25
    state, effect = x0.copy(), np.zeros((4, 2 * count))
    for knot in range(count):
        for _ in range(ticks):
            state, effect = PENDULUM.A @ state, PENDULUM.A @ effect
            effect[:, 2 * knot : 2 * knot + 2] += PENDULUM.B
    best = linprog(
        np.r_[np.zeros(2 * count), -1.0],
        A_ub=np.hstack([np.kron(np.eye(count), hull.M), np.ones((count * len(hull.v), 1))]),
        b_ub=np.tile(hull.v, count),
        A_eq=np.hstack([effect, np.zeros((4, 1))]),
        b_eq=PENDULUM.rest((0.025, 0.0)) - state,
        bounds=(None, None),
    )
    assert plan.slack == pytest.approx(-best.fun, abs=1e-6)  # HiGHS stops at 1e-7
    assert 0.0 < plan.slack < 0.1


def test_no_foothold_gives_a_larger_margin() -> None:
    """One step as a linear program of its own: level feet, every inequality an interval, states by stepping."""
    knots = [12 + 6] + [12] * 11 + [25] * 12
    centres = (np.arange(12) + 0.5) / 12
    share = np.r_[np.zeros(12), 1.0 - 0.5 * np.clip((centres - 0.4) / 0.3, 0.0, 1.0)]
    size = 2 * len(knots) + 3  # ZMPs, foothold, margin
    for x0 in (pushed(0.5), pushed(0.3, 20.0), np.array([0.02, 0.35, 0.005, 0.06]), np.array([-0.01, -0.4, 0.0, 0.1])):
        state, effect = x0.copy(), np.zeros((4, size))
        rows, bounds = [], []
        for knot, ticks in enumerate(knots):
            for _ in range(ticks):
                state, effect = PENDULUM.A @ state, PENDULUM.A @ effect
                effect[:, 2 * knot : 2 * knot + 2] += PENDULUM.B
            for axis, half, stance in ((0, 0.0495, 0.0), (1, 0.036, -0.042)):
                for sign in (1.0, -1.0):
                    row = np.zeros(size)
                    row[2 * knot + axis], row[-3 + axis], row[-1] = sign, -sign * share[knot], 1.0
                    rows.append(row)
                    bounds.append(half + sign * (1.0 - share[knot]) * stance)
        rest = effect.copy()
        rest[0, -3] -= 0.5
        rest[2, -2] -= 0.5
        best = linprog(
            np.r_[np.zeros(size - 1), -1.0],
            A_ub=np.array(rows),
            b_ub=bounds,
            A_eq=rest,
            b_eq=PENDULUM.rest((0.0, -0.021)) - state,
            bounds=[(None, None)] * (size - 3) + [(-0.16, 0.16), (0.033, 0.158), (None, 0.02)],
        )
        plan = plan_steps(PENDULUM, x0, standing(), ("left",), 0.3, LIMITS, zmp_margin=0.02)
        # The hull of the feet contains the combination that both programs use, so the slack may only be larger.
        assert plan.slack >= -best.fun - 1e-6  # HiGHS stops at 1e-7
        # In single support both mean the same sole, and there these plans are tight.
        step = plan.reference.margins()[: plan.landings[0]]
        assert step.min() == pytest.approx(-best.fun, abs=1e-6)


def test_replanning_on_the_way_finds_nothing_worse() -> None:
    """The rest of a plan is itself a plan: the margin found later falls by no more than the knots' grid."""
    x0, feet = pushed(0.36), standing()
    plan = plan_steps(PENDULUM, x0, feet, ("left",), 0.3, LIMITS, zmp_margin=0.02)
    for k in (12, 24, 74, 125):
        later = plan_steps(
            PENDULUM,
            plan.reference.xi[k],
            feet,
            ("left",),
            0.3,
            LIMITS,
            swing_time_left=0.3 - 0.002 * k,
            swing_position=plan.footholds[0].position,
            zmp_margin=0.02,
        )
        # Knots of the two plans are shifted against each other by up to 12 ms of ZMP held constant.
        assert later.slack >= plan.slack - 1e-3
