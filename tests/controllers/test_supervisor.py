"""The supervisor, closed on the pendulum: the ZMP stays inside at every tick, and every choice has its grounds."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.signals import Controller
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.brain import make_brain
from sim.episode import EpisodeResult, run_episode
from sim.outcome import Result

DIRECTIONS = tuple(range(0, 360, 45))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def push(direction: float, delta_v: float, controller: str = "supervisor", **fields: object) -> EpisodeResult:
    scenario = {
        "description": "one push of the pendulum",
        "world": "pendulum",
        "controller": controller,
        "duration": 7.0,
        "variation": {"pose": 0.0},
        "pushes": [{"start": 0.1, "direction": float(direction), "delta_v": delta_v}],
    }
    return run_episode(Scenario.model_validate(scenario | fields), polygons=False)


GAINS = (
    {"kind": "dcm", "k": 1.5},
    {"kind": "lqr", "q": [1.0, 0.1], "r": 1.0},
    {"kind": "poles", "poles": [-2.0, -5.0]},
)


CASES = [(0, direction) for direction in DIRECTIONS] + [(gain, direction) for gain in (1, 2) for direction in (45, 180)]


@pytest.mark.parametrize(("gain", "direction"), CASES)
def test_the_zmp_is_inside_at_every_tick_of_a_recovery(direction: int, gain: int) -> None:
    result = push(direction, 0.35, gain=GAINS[gain])
    assert result.outcome.result is Result.RECOVERED
    # Of a recovery inside the sets nothing had to be clamped: command and what was held are the same.
    trace = result.trace
    assert trace["support_slack"].min() >= -1e-12
    commanded = np.column_stack([trace["zmp_cmd_x"], trace["zmp_cmd_y"]])[:-1]
    assert np.column_stack([trace["zmp_x"], trace["zmp_y"]])[1:] == pytest.approx(commanded, abs=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_in_the_regulators_set_nobody_steps(direction: int) -> None:
    result = push(direction, 0.15)
    assert result.outcome.steps_taken == 0
    assert [d["reason"] for d in result.decisions] == ["start"]
    assert result.trace["regulator_slack"].min() >= 0.0


def test_every_change_is_recorded_with_its_grounds() -> None:
    result = push(0, 0.4)
    trace, decisions = result.trace, result.decisions
    changes = trace.time[1:][np.diff(trace["controller"]) != 0.0]
    assert set(changes) <= {d["time"] for d in decisions}
    for d in decisions:
        assert d["in_regulator_set"] == (d["regulator_slack"] >= 0.0)
        assert d["outside_all"] == (not d["in_regulator_set"] and not d["in_tracking_set"])
        assert d["tight"].startswith("the ZMP")
    stepped = next(d for d in decisions if d["controller"] == "tracker")
    assert stepped["tracking_slack"] == max(c["slack"] for c in stepped["candidates"])


def test_outside_all_sets_the_least_violated_is_taken_and_said() -> None:
    result = push(0, 1.6)
    outside = [d for d in result.decisions if d["outside_all"]]
    assert outside
    for d in outside:
        assert d["controller"] == "tracker"
        assert d["tracking_slack"] == max(c["slack"] for c in d["candidates"]) < 0.0
    assert result.outcome.result is not Result.RECOVERED


def test_the_null_regulator_never_steps_and_is_the_same_law_inside_its_set() -> None:
    assert push(0, 0.6, "regulator").outcome.steps_taken == 0
    inside = [push(0, 0.15, controller).trace for controller in ("supervisor", "regulator")]
    assert np.array_equal(inside[0]["cog_x"], inside[1]["cog_x"])


def test_the_supervisor_outdoes_the_null_controllers() -> None:
    def most(controller: str) -> float:
        for delta_v in np.arange(0.1, 1.2, 0.1):
            if push(0, float(delta_v), controller).outcome.result is not Result.RECOVERED:
                return float(delta_v) - 0.1
        return 1.2

    limits = {controller: most(controller) for controller in ("supervisor", "regulator", "statue")}
    assert limits["supervisor"] > limits["regulator"] + 0.15
    assert limits["supervisor"] > limits["statue"] + 0.15


def test_reset_forgets_the_last_episode(robot: Robot) -> None:
    scenario = push(0, 0.4).scenario
    brain = make_brain(scenario, robot)
    first = run_episode(scenario, brain=brain, polygons=False).trace
    again = run_episode(scenario, brain=brain, polygons=False).trace
    assert np.array_equal(first.values, again.values, equal_nan=True)
    assert brain.controller is Controller.REGULATOR
