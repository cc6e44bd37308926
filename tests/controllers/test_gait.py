"""Plans from a measured state: each keeps its promises, whatever state and feet it is made from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers.gains import dcm
from controllers.gait import StepPlan, plan_steps
from controllers.gait_program import PlanningError, knot_ticks
from controllers.support import Foot, support_polygon
from models.robot import Side
from tests.controllers.gait_stance import LIMITS, PENDULUM, SOLE, SOLVER, pushed, standing

SEQUENCES: list[tuple[Side, ...]] = [(), ("left",), ("right", "left"), ("left", "right", "left")]


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
