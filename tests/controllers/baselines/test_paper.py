"""The paper's controller: one fixed reference, entered from its set, and never planned anew."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.baselines.paper import STEP_TIME, STRIDE, PaperSupervisor
from controllers.baselines.tracker import Tracker
from controllers.interface import Phase, Predictor
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import EpisodeResult, run_episode
from sim.episode.set_polygons import admissible_polygons
from sim.record.outcome import Result

DT = 0.002
LQR = {"kind": "lqr", "q": [1.0, 1.0], "r": 1.0}
# Jumps forward from rest that this gain's regulator does not hold, and the reference does [m/s].
BETWEEN = 0.052


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def scenario(*pushes: tuple[float, float, float], **fields: object) -> Scenario:
    """Sudden pushes of (start, direction, delta_v) on the pendulum: each within one tick, as the paper's are."""
    given = {
        "description": "pushes of the pendulum",
        "world": "pendulum",
        "controller": "paper",
        "duration": pushes[-1][0] + 6.0,
        "gain": LQR,
        "variation": {"pose": 0.0},
        "pushes": [
            {"start": start, "direction": float(way), "delta_v": dv, "duration": DT} for start, way, dv in pushes
        ],
    }
    return Scenario.model_validate(given | fields)


def run(*pushes: tuple[float, float, float], **fields: object) -> EpisodeResult:
    return run_episode(scenario(*pushes, **fields), polygons=False)


def test_between_the_sets_it_steps_as_planned() -> None:
    result = run((0.1, 0.0, BETWEEN))
    push, trace = result.pushes[0], result.trace
    assert (push.in_regulator_set, push.in_tracking_set, push.chosen) == (False, True, "stepping")
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken == 2
    # Neither the time nor the place heeds the push: two steps, and the feet together a stride ahead.
    assert (trace["phase"] == Phase.STEPPING.value).sum() == round(2 * STEP_TIME / DT)
    for side in SIDES:
        moved = trace[f"{side}_x"][-1] - trace[f"{side}_x"][0]
        # The foot coasts over the last two ticks.
        assert moved == pytest.approx(STRIDE, abs=2e-4)
    # Nothing that a set promised had to be clamped.
    assert trace["support_slack"].min() >= -1e-12
    commanded = np.column_stack([trace["zmp_cmd_x"], trace["zmp_cmd_y"]])[:-1]
    assert np.column_stack([trace["zmp_x"], trace["zmp_y"]])[1:] == pytest.approx(commanded, abs=1e-12)
    assert np.nanmin(trace["tracking_slack"]) >= 0.0


def test_the_first_foot_is_the_right_one_and_its_time_is_the_plans() -> None:
    trace = run((0.1, 0.0, BETWEEN)).trace
    first = trace.time[np.flatnonzero(trace["phase"])[0]]
    up = {side: trace.time[trace[f"{side}_stance"] == 0.0] - first for side in SIDES}
    # 0.1 s of double support at either end of a step.
    assert (up["right"].min(), up["right"].max()) == pytest.approx((0.1, 0.4 - DT), abs=1e-9)
    assert (up["left"].min(), up["left"].max()) == pytest.approx((0.6, 0.9 - DT), abs=1e-9)


def test_in_the_regulators_set_it_does_not_step() -> None:
    result = run((0.1, 0.0, 0.03))
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken == 0
    assert [d["reason"] for d in result.decisions] == ["start"]


def test_outside_all_sets_the_least_violated_is_taken_and_said() -> None:
    ahead, back = run((0.1, 0.0, 0.5)), run((0.1, 180.0, 0.12))
    for result in (ahead, back):
        said = next(d for d in result.decisions if d["outside_all"])
        assert said["time"] == pytest.approx(0.1 + DT)
        tracker = said["phase"] == "stepping"
        assert tracker == (said["tracking_slack"] > said["regulator_slack"])
    # The reference reaches ahead, so that it is the regulator that a push back violates least.
    assert ahead.outcome.steps_taken > 0
    first = next(d for d in back.decisions if d["outside_all"])
    assert first["phase"] == "standing"


def test_leaving_the_tracking_set_is_recorded() -> None:
    result = run((0.1, 0.0, BETWEEN), (0.4, 90.0, 0.4))
    left = [d for d in result.decisions if d["reason"] == "the state left the tracking set"]
    assert len(left) == 1
    assert left[0]["outside_all"]
    assert left[0]["phase"] == "stepping"


def test_no_member_is_lost() -> None:
    """At the end of a push of any size and direction, in a set means recovered."""
    rng, found = np.random.default_rng(0), set()
    for seed in range(24):
        gain = LQR if seed % 2 else {"kind": "dcm", "k": 1.5}
        size = rng.uniform(0.01, 0.07) if seed % 2 else rng.uniform(0.1, 0.3)
        push = {"start": 0.1, "direction": float(rng.normal(0.0, 60.0)), "delta_v": size, "duration": 0.05}
        result = run((0.1, 0.0, 0.1), gain=gain, seed=seed, variation={"pose": 0.002}, pushes=[push])
        record = result.pushes[0]
        if record.in_regulator_set or record.in_tracking_set:
            assert result.outcome.result is Result.RECOVERED, push
        found.add((record.in_regulator_set, record.in_tracking_set))
    # The draws were of each kind.
    assert {(True, True), (False, True), (False, False)} <= found


def test_a_later_push_finds_the_same_reference_where_the_feet_are() -> None:
    result = run((0.1, 0.0, BETWEEN), (4.0, 0.0, BETWEEN))
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken == 4
    assert [push.chosen for push in result.pushes] == ["stepping", "stepping"]
    assert result.trace["left_x"][-1] - result.trace["left_x"][0] == pytest.approx(2 * STRIDE, abs=4e-4)


def test_reset_forgets_and_its_word_is_recorded(robot: Robot) -> None:
    given = scenario((0.1, 0.0, BETWEEN))
    controller = make_controller(given, robot)
    assert isinstance(controller, PaperSupervisor)
    assert isinstance(controller, Predictor)
    first = run_episode(given, controller=controller, polygons=False).trace
    again = run_episode(given, controller=controller, polygons=False).trace
    assert np.array_equal(first.values, again.values, equal_nan=True)


def test_its_polygons_are_slices_of_its_own_sets(robot: Robot) -> None:
    given = scenario((0.1, 0.0, BETWEEN))
    controller = make_controller(given, robot)
    run_episode(given, controller=controller, polygons=False)
    assert isinstance(controller, PaperSupervisor)
    assert controller.tracker is not None
    assert controller.regulator is not None
    # After the step, where the reference stands a stride ahead of where it was planned.
    rest = controller.regulator.softest.x_C
    tracking = next(p for p in admissible_polygons(controller, robot, rest, push=1) if p.name == "tracking")
    middle = tracking.vertices.mean(axis=0)
    for corner in tracking.vertices:
        for share, inside in ((0.999, True), (1.001, False)):
            x = rest.copy()
            x[[0, 1]] = middle + share * (corner - middle)
            assert (controller.tracker.slack(controller.seen(x)) >= 0.0) == inside


def test_the_reference_waits_for_a_foot_that_is_late(robot: Robot) -> None:
    controller = make_controller(scenario((0.1, 0.0, BETWEEN)), robot)
    run_episode(scenario((0.1, 0.0, BETWEEN)), controller=controller, polygons=False)
    assert isinstance(controller, PaperSupervisor)
    assert controller.tracker is not None
    tracker = Tracker(controller.tracker.walk, controller.tracker.sets.gain)
    first, second = tracker.walk.strides
    for _ in range(first.landing + 7):
        tracker.advance()
    assert tracker.phase == first.landing - 1
    assert tracker.stride is first
    tracker.land()
    assert tracker.k == tracker.phase == first.landing
    # And goes on by the clock after one that is early.
    for _ in range(second.landing - first.landing - 20):
        tracker.advance()
    assert tracker.stride is second
    tracker.land()
    assert tracker.k == second.landing - 20
    assert tracker.stride is None
    assert not tracker.finished
    for _ in range(tracker.walk.reference.m - tracker.k):
        tracker.advance()
    assert tracker.finished
