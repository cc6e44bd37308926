from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from controllers.footholds import StepLimits
from controllers.gains import dcm
from controllers.gait import StepPlan, plan_steps
from controllers.gait_program import PlanningError, knot_ticks
from controllers.pendulum import Pendulum
from controllers.support import Foot, support_polygon
from controllers.walk import walk_plan
from models.robot import Side

OMEGA = math.sqrt(9.81 / 0.26)
PENDULUM = Pendulum(OMEGA, 0.002)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
FRONT = 0.0495
LIMITS = StepLimits(max_stride=0.16, min_width=0.075, max_width=0.2, stance_width=0.084, swing_speed=2.0)
SEQUENCES: list[tuple[Side, ...]] = [(), ("left",), ("right", "left"), ("left", "right", "left")]
# The program's own tolerance is 1e-10; sums over a plan of a hundred variables of the order of one follow it.
SOLVER = 1e-8


def standing(ahead: float = 0.0, turn: float = 0.0) -> dict[Side, Foot]:
    return {
        "left": Foot(position=np.array([ahead, 0.042]), yaw=turn, sole=SOLE),
        "right": Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=SOLE),
    }


def pushed(speed: float, degrees: float = 0.0) -> np.ndarray:
    angle = math.radians(degrees)
    return np.array([0.0, speed * math.cos(angle), 0.0, speed * math.sin(angle)])


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


def feet_by_phase(plan: StepPlan, feet: dict[Side, Foot]) -> list[list[Foot]]:
    """Feet on the floor during each step, then in the final double support, told again from the plan."""
    down, phases = dict(feet), []
    for side, foothold in zip(plan.swing, plan.footholds, strict=True):
        phases.append([foot for other, foot in down.items() if other != side])
        down[side] = foothold
    return [*phases, list(down.values())]


@pytest.mark.parametrize("swing", SEQUENCES)
def test_random_plans_keep_every_promise(swing: tuple[Side, ...]) -> None:
    rng = np.random.default_rng(len(swing))
    kept = 0
    for _ in range(60):
        feet = standing(rng.uniform(-0.08, 0.08), rng.uniform(-0.3, 0.3))
        x0 = np.array([rng.uniform(-0.02, 0.04), rng.normal(0, 0.3), rng.uniform(-0.03, 0.03), rng.normal(0, 0.1)])
        step_time = rng.uniform(0.15, 0.4)
        plan = plan_steps(PENDULUM, x0, feet, swing, step_time, LIMITS)
        reference = plan.reference
        np.testing.assert_array_equal(reference.xi[0], x0)
        np.testing.assert_allclose(reference.xi, PENDULUM.rollout(x0, reference.mu), rtol=0, atol=0)

        ends = [*plan.landings, reference.m]
        margins = np.empty(reference.m)
        begin = 0
        for end, down in zip(ends, feet_by_phase(plan, feet), strict=True):
            margins[begin:end] = support_polygon(down).slacks(reference.mu[begin:end])
            begin = end
        # A hull may leave out a point a nanometre outside.
        np.testing.assert_allclose(margins, reference.margins(), rtol=0, atol=1e-8)
        assert plan.slack == reference.margins().min()
        assert reference.admissible == (plan.slack >= 0.0)
        kept += reference.admissible

        final = feet_by_phase(plan, feet)[-1]
        middle = np.mean([foot.position for foot in final], axis=0)
        np.testing.assert_allclose(reference.xi[-1], PENDULUM.rest(middle), rtol=0, atol=1e-6)
        assert reference.m == sum(round(step_time / 0.002) for _ in swing) + 300
        assert_within_reach(plan, feet, step_time)
    assert 5 < kept < 60, "the draw must contain plans on both sides"


def assert_within_reach(plan: StepPlan, feet: dict[Side, Foot], step_time: float) -> None:
    down = dict(feet)
    for side, foothold in zip(plan.swing, plan.footholds, strict=True):
        stance = down["right" if side == "left" else "left"]
        c, s = math.cos(stance.yaw), math.sin(stance.yaw)
        ahead, aside = np.array([[c, s], [-s, c]]) @ (foothold.position - stance.position)
        width = aside if side == "left" else -aside
        assert abs(ahead) <= LIMITS.max_stride + SOLVER
        assert LIMITS.min_width - SOLVER <= width <= LIMITS.max_width + SOLVER
        travel = np.linalg.norm(foothold.position - down[side].position)
        assert travel <= LIMITS.swing_speed * (step_time + 0.001) + SOLVER  # the step is rounded to ticks
        assert foothold.yaw == feet[side].yaw
        down[side] = foothold


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


@pytest.mark.parametrize("swing", SEQUENCES)
def test_an_impossible_push_is_outside_yet_exact(swing: tuple[Side, ...]) -> None:
    plan = plan_steps(PENDULUM, pushed(1.5, 20.0), standing(), swing, 0.3, LIMITS)
    assert plan.slack < -0.05
    assert not plan.reference.admissible
    assert len(plan.footholds) == len(swing)


def test_a_foot_under_way_reaches_only_what_it_can() -> None:
    now = np.array([0.03, 0.06])
    x0 = np.array([0.03, 0.35, 0.0, 0.02])
    farthest = 0.0
    for left in (0.002, 0.02, 0.06, 0.3):
        plan = plan_steps(PENDULUM, x0, standing(), ("left",), 0.3, LIMITS, swing_time_left=left, swing_position=now)
        travel = float(np.linalg.norm(plan.footholds[0].position - now))
        assert travel <= LIMITS.swing_speed * left + SOLVER
        assert plan.landings == (round(left / 0.002),)
        farthest = max(farthest, travel)
    assert farthest > 0.05, "with time the foot goes where the push wants it"


def test_a_foot_out_of_reach_lands_as_near_as_it_can() -> None:
    now = np.array([0.25, 0.042])  # 9 cm beyond the stride
    for left, landed in ((0.0, 0.25), (0.01, 0.25), (0.2, 0.16)):
        plan = plan_steps(
            PENDULUM,
            pushed(0.8),
            standing(),
            ("left",),
            0.3,
            LIMITS,
            swing_time_left=left,
            swing_position=now,
        )
        allowed = LIMITS.swing_speed * max(left, 0.002)
        assert np.linalg.norm(plan.footholds[0].position - now) <= allowed + SOLVER
        assert landed - allowed - SOLVER <= plan.footholds[0].position[0] <= landed + SOLVER


def test_the_second_step_starts_where_its_foot_stands() -> None:
    slow = replace(LIMITS, swing_speed=0.2)
    plan = plan_steps(PENDULUM, pushed(0.4), standing(), ("left", "right", "left"), 0.3, slow)
    begin = [np.array([0.0, 0.042]), np.array([0.0, -0.042]), plan.footholds[0].position]
    for start, foothold in zip(begin, plan.footholds, strict=True):
        assert np.linalg.norm(foothold.position - start) <= 0.2 * 0.3 + SOLVER


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


def test_tracking_from_the_plan_keeps_the_zmp_inside() -> None:
    """Closed loop (27) with xi_0 = x_0, hence e_0 = 0, then the regulator (18) around the end."""
    plan = plan_steps(PENDULUM, pushed(0.4), standing(), ("left", "right"), 0.3, LIMITS)
    reference, gain = plan.reference, dcm(PENDULUM, 1.5).F
    assert plan.slack > 0.0
    x = reference.xi[0]
    for k in range(reference.m):
        u = reference.mu[k] + gain @ (reference.xi[k] - x)
        assert reference.support(k).slack(u) >= plan.slack - 1e-6  # rounding, contracted by the loop
        x = PENDULUM.step(x, u)
    for _ in range(1000):
        u = reference.xi[-1, 0::2] - gain @ (x - reference.xi[-1])
        assert reference.final.contains(u)
        x = PENDULUM.step(x, u)
    np.testing.assert_allclose(x, reference.xi[-1], rtol=0, atol=1e-9)  # contracted for two seconds


def test_plans_do_not_know_where_the_world_begins() -> None:
    """The same push, turned and shifted with the feet, gives the same plan, turned and shifted."""
    angle, shift = 0.7, np.array([3.0, -2.0])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    x0 = np.array([0.01, 0.3, -0.005, 0.08])
    here = plan_steps(PENDULUM, x0, standing(0.02, 0.2), ("left", "right"), 0.3, LIMITS)
    moved = np.empty(4)
    moved[0::2], moved[1::2] = turn @ x0[0::2] + shift, turn @ x0[1::2]
    feet: dict[Side, Foot] = {
        side: Foot(position=turn @ foot.position + shift, yaw=foot.yaw + angle, sole=SOLE)
        for side, foot in standing(0.02, 0.2).items()
    }
    there = plan_steps(PENDULUM, moved, feet, ("left", "right"), 0.3, replace(LIMITS))
    assert there.slack == pytest.approx(here.slack, abs=1e-6)
    for a, b in zip(here.footholds, there.footholds, strict=True):
        # The octagon of the swing speed does not turn with the feet, but it does not bind here.
        np.testing.assert_allclose(turn @ a.position + shift, b.position, rtol=0, atol=1e-6)


def test_arguments_that_do_not_fit_are_typed_errors() -> None:
    x0 = pushed(0.3)
    with pytest.raises(PlanningError, match="alternate"):
        plan_steps(PENDULUM, x0, standing(), ("left", "left"), 0.3, LIMITS)
    for bad in (np.array([math.nan, 0, 0, 0]), np.array([0, -math.inf, 0, 0]), pushed(1e6), np.zeros(3)):
        with pytest.raises(PlanningError, match="robot in sight"):
            plan_steps(PENDULUM, bad, standing(), ("left",), 0.3, LIMITS)
    for step_time in (0.0, -0.3, math.nan):
        with pytest.raises(PlanningError):
            plan_steps(PENDULUM, x0, standing(), ("left",), step_time, LIMITS)
    for change in ({"min_width": 0.0}, {"max_width": 0.08}, {"swing_speed": 0.0}, {"max_stride": math.nan}):
        with pytest.raises(PlanningError, match="step limits"):
            replace(LIMITS, **change)


def test_footholds_that_exclude_each_other_are_a_planning_error() -> None:
    # The second foot starts 2 m away and may move 0.3 mm, so no foothold is beside the first.
    apart = standing()
    apart["right"] = apart["right"].moved((0.0, -2.0))
    crawl = replace(LIMITS, swing_speed=0.001)
    with pytest.raises(PlanningError, match="within reach"):
        plan_steps(PENDULUM, pushed(0.1), apart, ("left", "right"), 0.3, crawl)


def test_knots_fill_the_time_and_the_first_takes_the_remainder() -> None:
    for total in range(1, 200):
        ticks = knot_ticks(total, 12)
        assert sum(ticks) == total
        assert set(ticks[1:]) <= {12}
        assert 1 <= ticks[0] <= 18


@pytest.mark.parametrize("dt", [0.002, 0.005])
def test_walk_of_section_iv_c(dt: float) -> None:
    pendulum = Pendulum(OMEGA, dt)
    walk = walk_plan(pendulum, standing()).reference
    assert walk.duration == pytest.approx(2.0, abs=1e-12)  # four steps of 0.5 s
    assert walk.margins().min() >= 0.005 - 1e-6
    np.testing.assert_array_equal(walk.xi[0], np.zeros(4))
    # The last step closes the feet: three strides of 0.1 m.
    np.testing.assert_allclose(walk.xi[-1], [0.3, 0.0, 0.0, 0.0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(walk.final.centre, [0.3, 0.0], rtol=0, atol=1e-12)
    areas = [np.prod(np.ptp(walk.support(round(t / dt)).vertices, axis=0)) for t in (0.0, 0.25, 0.5, 0.75, 2.0)]
    # Box around both feet: aligned, one sole, a stride apart, one sole, aligned again.
    expected = [0.099 * 0.156, 0.099 * 0.072, 0.199 * 0.156, 0.099 * 0.072, 0.099 * 0.156]
    np.testing.assert_allclose(areas, expected, rtol=1e-12)
    assert walk.support(round(0.25 / dt)).contains((0.0, 0.042))  # the right foot steps first


def test_a_walk_that_cannot_be_is_a_planning_error() -> None:
    # A tick of double support cannot bring the ZMP to one foot before the other is lifted.
    with pytest.raises(PlanningError, match="leaves its supports"):
        walk_plan(PENDULUM, standing(), double_support=0.002)
    with pytest.raises(PlanningError, match="single and double"):
        walk_plan(PENDULUM, standing(), double_support=0.25)
