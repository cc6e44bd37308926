"""The rules for stepping: their frames, and which foot goes where."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.gains import dcm
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.polygon_policy import PolygonPolicy
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import OUTWARDS, Heading, natural_foothold, step_limits
from controllers.supervisor.regulator import Regulator
from models.arena import SIDES
from models.robot import Side, load_robot, other

ROBOT = load_robot("utmu2")
PENDULUM = Pendulum(ROBOT.omega, 0.002)
OPTIONS = Stepping(step_times=(0.12, 0.16), max_steps=4, swing_height=0.04)
LIMITS = step_limits(ROBOT, OPTIONS.max_stride)
GAIN_K = 1.2
coordinate = st.floats(-3.0, 3.0)
points = st.tuples(coordinate, coordinate).map(np.array)
angles = st.floats(-math.pi, math.pi)


@pytest.fixture(scope="module")
def sets() -> SetPolicy:
    return SetPolicy(ROBOT, PENDULUM, OPTIONS, GAIN_K)


@pytest.fixture(scope="module")
def polygon() -> PolygonPolicy:
    return PolygonPolicy(ROBOT, PENDULUM, OPTIONS)


def stance(heading: Heading, at: np.ndarray, ahead: float = 0.0) -> dict[Side, np.ndarray]:
    """Feet side by side, the left one `ahead` of the other."""
    half = 0.5 * ROBOT.stance_width
    return {
        "left": heading.world(np.array([ahead, half]), at),
        "right": heading.world(np.array([0.0, -half]), at),
    }


@given(points, points, angles)
def test_a_point_comes_back_from_the_frame_of_a_foot(point: np.ndarray, origin: np.ndarray, yaw: float) -> None:
    heading = Heading(yaw)
    local = heading.local(point, origin)
    assert heading.world(local, origin) == pytest.approx(point, abs=1e-12)
    assert math.hypot(*local) == pytest.approx(math.hypot(*(point - origin)), abs=1e-12)


def test_ahead_and_left_of_a_robot_that_faces_left() -> None:
    heading = Heading(math.pi / 2)
    assert heading.local(np.array([0.0, 1.0]), np.zeros(2)) == pytest.approx([1.0, 0.0], abs=1e-15)
    assert heading.local(np.array([-1.0, 0.0]), np.zeros(2)) == pytest.approx([0.0, 1.0], abs=1e-15)


def test_the_natural_foothold_is_outside_of_where_the_dcm_will_be() -> None:
    point, zmp, time = np.array([0.08, 0.02]), np.array([0.03, 0.01]), 0.14
    x = np.array([0.08, 0.0, 0.02, 0.0])
    for _ in range(round(time / PENDULUM.dt)):
        x = PENDULUM.step(x, zmp)
    landed = PENDULUM.dcm(x)
    growth = math.exp(PENDULUM.omega * time)
    for side in SIDES:
        outwards = np.array([0.0, OUTWARDS if side == "left" else -OUTWARDS])
        assert natural_foothold(point, zmp, growth, side) == pytest.approx(landed + outwards, abs=1e-12)


def test_the_reach_is_read_off_the_robot() -> None:
    limits = step_limits(ROBOT, 0.2)
    assert limits.max_stride == 0.2
    # No sole may touch the other.
    assert limits.min_width > ROBOT.sole_width
    assert limits.min_width <= ROBOT.stance_width == limits.stance_width < limits.max_width


@pytest.mark.parametrize("yaw", [0.0, 2.0])
@pytest.mark.parametrize("rule", ["sets", "polygon"])
def test_pushed_aside_the_foot_of_that_side_goes(
    rule: str, yaw: float, sets: SetPolicy, polygon: PolygonPolicy
) -> None:
    chosen, heading = (sets if rule == "sets" else polygon), Heading(yaw)
    at = np.array([0.7, -0.4])
    feet = stance(heading, at)
    for side, outward in (("left", 1.0), ("right", -1.0)):
        pushed = heading.world(np.array([0.0, outward * 0.09]), at)
        lift = chosen.lift(pushed, feet, heading, SIDES)
        assert lift.side == side
        # Unless that foot may not go.
        only: Side = "right" if side == "left" else "left"
        assert chosen.lift(pushed, feet, heading, (only,)).side == only


@pytest.mark.parametrize("rule", ["sets", "polygon"])
@given(x=st.floats(-0.15, 0.15), y=st.floats(-0.1, 0.1), ahead=st.floats(-0.1, 0.1), yaw=angles)
def test_what_is_aimed_at_is_within_reach(
    rule: str, x: float, y: float, ahead: float, yaw: float, sets: SetPolicy, polygon: PolygonPolicy
) -> None:
    chosen, heading = (sets if rule == "sets" else polygon), Heading(yaw)
    at = np.array([-0.3, 0.2])
    feet = stance(heading, at, ahead)
    point = heading.world(np.array([x, y]), at)
    lift = chosen.lift(point, feet, heading, SIDES)
    ground, swing = feet[other(lift.side)], feet[lift.side]
    aim = chosen.aim(point, ground, swing, heading, lift, round(lift.step_time / PENDULUM.dt), lift.steps)
    foothold, limits = heading.local(aim.foothold, ground), LIMITS
    aside = foothold[1] if lift.side == "left" else -foothold[1]
    # Micrometres are what the program for a foothold may leave.
    assert abs(foothold[0]) <= limits.max_stride + 1e-6
    assert limits.min_width - 1e-6 <= aside <= limits.max_width + 1e-6
    inner = SupportPolygon(ROBOT.sole_vertices["left"]).shrunk(OPTIONS.zmp_margin)
    assert inner.slack(heading.local(aim.zmp, ground)) >= -1e-9
    if rule == "polygon":
        assert math.isnan(lift.slack)
        assert math.isnan(aim.slack)


def test_the_same_robot_turned_and_moved_does_the_same(sets: SetPolicy, polygon: PolygonPolicy) -> None:
    here, there, moved = Heading(0.0), Heading(1.1), np.array([0.4, -0.2])
    point = np.array([0.09, 0.03])
    for rule in (sets, polygon):
        lifts = [
            rule.lift(heading.world(point, at), stance(heading, at), heading, SIDES)
            for heading, at in ((here, np.zeros(2)), (there, moved))
        ]
        assert lifts[0].side == lifts[1].side
        assert lifts[0].step_time == lifts[1].step_time
        assert [c.slack for c in lifts[0].candidates] == pytest.approx(
            [c.slack for c in lifts[1].candidates], abs=1e-12
        )


def test_a_step_of_the_polygon_rule_catches_the_capture_point(polygon: PolygonPolicy) -> None:
    """Run on the pendulum, one step forward ends with the DCM inside the feet's hull."""
    heading, at = Heading(0.0), np.zeros(2)
    feet = stance(heading, at)
    x = np.array([0.0, 0.6, 0.0, 0.0])
    lift = polygon.lift(PENDULUM.dcm(x), feet, heading, SIDES)
    ground = feet[other(lift.side)]
    for left in range(round(lift.step_time / PENDULUM.dt), 0, -1):
        aim = polygon.aim(PENDULUM.dcm(x), ground, feet[lift.side], heading, lift, left, lift.steps)
        x = PENDULUM.step(x, aim.zmp)
    sole = ROBOT.sole_vertices["left"]
    hull = support_polygon([Foot(position=p, yaw=0.0, sole=sole) for p in (ground, aim.foothold)])
    assert hull.slack(PENDULUM.dcm(x)) > 0.0
    # Which it was not before.
    assert (
        support_polygon([Foot(position=p, yaw=0.0, sole=sole) for p in feet.values()]).slack(
            [0.6 / PENDULUM.omega, 0.0]
        )
        < 0.0
    )


def test_the_number_of_steps_is_not_changed_lightly(sets: SetPolicy) -> None:
    """Fewer only with some slack to spare, more as soon as they are needed."""
    heading, at = Heading(0.0), np.zeros(2)
    feet = stance(heading, at)
    first = sets.lift(np.array([0.06, 0.0]), feet, heading, SIDES)
    ground, swing = feet[other(first.side)], feet[first.side]
    ticks = round(first.step_time / PENDULUM.dt)
    point, foot = heading.local(np.array([0.06, 0.0]), ground), heading.local(swing, ground)
    polygons = sets.sets.polygon(1, other(first.side), first.step_time, foot, step_time=first.step_time)
    # Along the way out of the set of one step, seen from the stance foot.
    row = int((polygons.a - polygons.S @ point).argmin())
    normal, rim = polygons.S[row], float(polygons.a[row] - polygons.S[row] @ point)
    just_inside, well_inside, outside = (point + (rim - gap) * normal for gap in (0.002, 0.01, -0.001))

    def steps(local: np.ndarray, meant: int) -> int:
        return sets.aim(heading.world(local, ground), ground, swing, heading, first, ticks, meant).steps

    assert steps(just_inside, 2) == 2
    assert steps(just_inside, 1) == 1
    assert steps(well_inside, 2) == 1
    assert steps(outside, 1) > 1


def test_sets_of_the_same_stepping_are_computed_once(sets: SetPolicy) -> None:
    assert SetPolicy(ROBOT, PENDULUM, OPTIONS.model_copy(update={"swing_height": 0.05}), GAIN_K).sets is sets.sets
    assert SetPolicy(ROBOT, PENDULUM, OPTIONS.model_copy(update={"max_steps": 3}), GAIN_K).sets is not sets.sets


def test_a_stand_that_the_regulator_holds_is_where_the_steps_end(sets: SetPolicy) -> None:
    """The sets end in the regulator's of the same gain: with no time left and the foot on its foothold they agree."""
    heading, feet = Heading(0.0), stance(Heading(0.0), np.zeros(2))
    inner = sets.sets.sole.vertices
    standing = Regulator.at(
        PENDULUM,
        (dcm(PENDULUM, GAIN_K),),
        {side: Foot(position=at, yaw=0.0, sole=inner) for side, at in feet.items()},
    )
    rng = np.random.default_rng(0)
    for _ in range(100):
        point = rng.uniform(-0.1, 0.1, 2)
        local, foot = heading.local(point, feet["right"]), heading.local(feet["left"], feet["right"])
        slack = sets.sets.slacks(local, "right", 0.0, foot, OPTIONS.step_times[0])[0]
        x = np.array([point[0], 0.0, point[1], 0.0])
        # The one in metres of DCM, the other of ZMP.
        assert (slack >= 0.0) == (standing.slack(x) >= 0.0)


def test_a_foot_that_must_go_far_is_given_the_time_to_get_there(sets: SetPolicy) -> None:
    """From rest 0.12 s take a foot 0.22 m, 0.16 s 0.38 m; without inertia the shorter step is the better one."""
    feet, heading = stance(Heading(0.0), np.zeros(2)), Heading(0.0)
    point = np.array([0.14, 0.0])
    lift = sets.lift(point, feet, heading, SIDES)
    assert lift.slack > 0.0
    assert lift.step_time == 0.16
    weightless = replace(LIMITS, swing_acceleration=math.inf)
    assert SetPolicy(ROBOT, PENDULUM, OPTIONS, GAIN_K, weightless).lift(point, feet, heading, SIDES).step_time == 0.12


def test_of_steps_that_no_foot_at_rest_makes_one_is_taken_that_a_faster_foot_would(sets: SetPolicy) -> None:
    feet: dict[Side, np.ndarray] = {"left": np.array([-0.14987, 0.042]), "right": np.array([0.0, -0.042])}
    heading, point = Heading(0.0), np.array([0.19342, -0.01201])
    lift = sets.lift(point, feet, heading, SIDES)
    assert lift.slack < 0.0
    # There is one that is less violated, but it would be too late even for a foot that needs no time to speed up.
    assert max(candidate.slack for candidate in lift.candidates) > lift.slack
    assert lift.step_time == 0.12

    def with_all_speed(side: Side, time: float) -> float:
        stance = feet[other(side)]
        return float(sets.sets.slacks(point - stance, other(side), time, feet[side] - stance, time).max())

    assert with_all_speed(lift.side, lift.step_time) >= 0.0 > with_all_speed(lift.side, 0.16)
