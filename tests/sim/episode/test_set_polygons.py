"""The outlines of the sets behind a push, held to the sets themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controllers.interface import Regional
from controllers.nstep.step_sets import StepSets
from controllers.stepping.regions import dcm_polytope
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import Heading, Lift
from controllers.supervisor.supervisor import Supervisor
from models.robot import Robot, load_robot, other
from scenarios.catalogue import load
from sim.episode.build import make_controller
from sim.episode.plant import PendulumPlant
from sim.episode.set_polygons import PLANES, Plane, admissible_polygons
from sim.set_study.set_report import standing


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def slack_of(lift: Lift, supervisor: Supervisor, sets: StepSets, heading: Heading) -> Callable[[np.ndarray], float]:
    """Slack of a state in the set of a step [m of DCM], told from the sets alone."""
    assert supervisor.regulator is not None
    feet = supervisor.regulator.feet
    origin = feet[other(lift.side)].position
    swing = heading.local(feet[lift.side].position, origin)

    def slack(state: np.ndarray) -> float:
        point = heading.local(sets.pendulum.dcm(state), origin)
        slacks = sets.slacks(point, other(lift.side), lift.step_time, swing, lift.step_time)
        return float(slacks[lift.steps - 1])

    return slack


@pytest.mark.parametrize(("plane", "pushed"), [("x-xdot", [0.01, 0.5, 0.0, 0.05]), ("y-ydot", [0.0, 0.1, 0.01, 0.5])])
def test_a_corner_is_where_the_slack_is_zero(plane: Plane, pushed: list[float], robot: Robot) -> None:
    supervisor, sets = standing(load("three_pushes"), robot)
    assert supervisor.regulator is not None
    x = sets.pendulum.rest(supervisor.regulator.bank.centre) + pushed
    lift = supervisor.best_step(x)
    stepping = slack_of(lift, supervisor, sets, Heading(0.0))
    slack = {"tracking": stepping, "regulator": supervisor.regulator.softest.slack}
    found = {one.name: one for one in admissible_polygons(supervisor, robot, x, push=1, planes=(plane,))}
    assert set(found) == {"regulator", "tracking"}
    axes = list(PLANES[plane])
    for name, polygon in found.items():
        # Halfway along an edge too: an edge of the box is inside, any other on the rim.
        corners = polygon.vertices
        for point in np.vstack([corners, 0.5 * (corners + np.roll(corners, 1, axis=0))]):
            state = x.copy()
            state[axes] = point
            # The corners are found from the same rows.
            assert slack[name](state) >= -1e-9
        values = []
        for corner in corners:
            state = x.copy()
            state[axes] = corner
            values.append(slack[name](state))
        assert min(values) == pytest.approx(0.0, abs=1e-9)
    # The state itself is in the steppers' set: it is what best_step said.
    assert stepping(x) == pytest.approx(lift.slack, abs=1e-12)
    assert lift.slack > 0.0


def test_an_edge_is_cut_where_the_legs_end_and_else_on_the_rim(robot: Robot) -> None:
    supervisor, sets = standing(load("three_pushes"), robot)
    assert supervisor.regulator is not None
    centre = supervisor.regulator.bank.centre
    x = sets.pendulum.rest(centre) + np.array([0.01, 0.5, 0.0, 0.05])
    for polygon in admissible_polygons(supervisor, robot, x, push=1):
        following = np.roll(polygon.vertices, -1, axis=0)
        reach = np.abs(0.5 * (polygon.vertices + following)[:, 0] - centre[0])
        # In x the legs end, and the speed is within what they allow.
        np.testing.assert_array_equal(polygon.cut, reach > robot.hip_reach - 1e-6)
        assert polygon.cut.sum() == 2


def test_feet_that_landed_turned_do_not_turn_the_outline(robot: Robot) -> None:
    """The robot steps the way it faced at first, and so must the sets that are drawn for it."""
    scenario = load("three_pushes", {"world": "pendulum"})
    supervisor, sets = standing(scenario, robot)
    seen = PendulumPlant(scenario, robot).observe()
    ahead = np.array([0.01, 0.0, 0.0])
    feet = {side: replace(foot, yaw=0.3, position=foot.position + ahead) for side, foot in seen.feet.items()}
    supervisor.command(replace(seen, feet=feet))
    assert supervisor.regulator is not None
    assert [foot.yaw for foot in supervisor.regulator.feet.values()] == [0.3, 0.3]
    assert supervisor.heading.yaw == 0.0
    x = sets.pendulum.rest(supervisor.regulator.bank.centre) + np.array([0.0, 0.5, 0.0, 0.05])
    slack = slack_of(supervisor.best_step(x), supervisor, sets, Heading(0.0))
    polygons = admissible_polygons(supervisor, robot, x, push=1)
    (outline,) = (one.vertices for one in polygons if one.name == "tracking")
    assert len(outline)
    # Corners are found from the same rows.
    rim = [slack(np.array([position, speed, *x[2:]])) for position, speed in outline]
    assert min(rim) == pytest.approx(0.0, abs=1e-9)


def test_a_polygon_of_the_plane_is_turned_and_moved_with_the_foot(robot: Robot) -> None:
    _, sets = standing(load("three_pushes"), robot)
    heading, origin = Heading(0.8), np.array([0.3, -0.2])
    polygon = sets.polygon(2, "left", sets.step_times[0], step_time=sets.step_times[0])
    whole = dcm_polytope(sets.pendulum, polygon, heading, origin)
    rng = np.random.default_rng(0)
    for x in rng.uniform(-0.3, 0.3, (50, 4)) * [1.0, 4.0, 1.0, 4.0]:
        local = heading.local(sets.pendulum.dcm(x), origin)
        assert whole.slack(x) == pytest.approx(polygon.slack(local), abs=1e-12)


def test_who_has_no_sets_has_no_polygons(robot: Robot) -> None:
    for name, stepping, names in (
        ("regulator", {}, {"regulator"}),
        ("supervisor", {"rule": "polygon"}, {"regulator"}),
    ):
        scenario = load("three_pushes", {"world": "pendulum", "controller": name, "stepping": stepping})
        controller = make_controller(scenario, robot)
        controller.command(PendulumPlant(scenario, robot).observe())
        assert isinstance(controller, Supervisor)
        assert not isinstance(controller.rule, SetPolicy)
        assert {one.name for one in admissible_polygons(controller, robot, np.zeros(4), push=1)} == names
    assert not isinstance(make_controller(load("quiet", {"controller": "statue"}), robot), Regional)
