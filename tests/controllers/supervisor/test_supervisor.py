"""The supervisor, closed on the pendulum: the ZMP stays inside at every tick, and every choice has its grounds."""

from __future__ import annotations

import numpy as np
import pytest

from models.robot import load_robot
from sim.episode.build import make_controller
from sim.episode.episode import run_episode
from sim.record.outcome import Result
from tests.controllers.pushed import assert_zmp_was_inside, push, run, scenario

DIRECTIONS = tuple(range(0, 360, 45))
GAINS = (
    {"kind": "dcm", "k": 1.5},
    {"kind": "lqr", "q": [1.0, 0.1], "r": 1.0},
    {"kind": "poles", "poles": [-2.0, -5.0]},
)
# Beyond the no-step limit of every direction, and far within what steps can answer [m/s].
NEEDS_A_STEP = 0.5
CASES = [(0, direction) for direction in DIRECTIONS] + [(gain, direction) for gain in (1, 2) for direction in (45, 180)]


@pytest.mark.parametrize(("gain", "direction"), CASES)
def test_the_zmp_is_inside_at_every_tick_of_a_recovery(direction: int, gain: int) -> None:
    result = run((0.1, direction, NEEDS_A_STEP), gain=GAINS[gain])
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken >= 1
    assert_zmp_was_inside(result)


def test_every_change_is_recorded_with_its_grounds() -> None:
    result = push(0, 0.7)
    trace, decisions = result.trace, result.decisions
    changes = trace.time[1:][(np.diff(trace["phase"]) != 0.0) | (np.diff(trace["steps"]) != 0.0)]
    assert len(changes) >= 2
    assert set(changes) <= {d["time"] for d in decisions}
    for d in decisions:
        assert d["reason"]
        assert d["in_regulator_set"] == (d["regulator_slack"] >= 0.0)
        stepping = d["tracking_slack"]
        assert d["in_tracking_set"] == (stepping is not None and stepping >= 0.0)
        assert d["outside_all"] == (not d["in_regulator_set"] and not d["in_tracking_set"])
        assert d["tight"].startswith("the ZMP")
        assert (d["phase"] == "stepping") == bool(d["plan"])
        assert not d["candidates"] or d["plan"]


def test_the_null_regulator_never_steps_and_is_the_same_law_inside_its_set() -> None:
    assert push(0, 0.6, "regulator").outcome.steps_taken == 0
    inside = [push(0, 0.12, controller).trace for controller in ("supervisor", "regulator")]
    assert np.array_equal(inside[0]["cog_x"], inside[1]["cog_x"])


def test_the_supervisor_outdoes_the_others() -> None:
    def most(controller: str) -> float:
        held = 0.0
        for delta_v in (0.1, 0.2, 0.3, 0.5, 0.7):
            if push(0, delta_v, controller).outcome.result is not Result.RECOVERED:
                break
            held = delta_v
        return held

    limits = {controller: most(controller) for controller in ("supervisor", "paper", "regulator", "statue")}
    assert limits["supervisor"] == 0.7
    assert max(limits[name] for name in ("paper", "regulator", "statue")) <= 0.3


def test_reset_forgets_the_last_episode() -> None:
    given = scenario((0.1, 0, 0.7))
    controller = make_controller(given, load_robot("utmu2"))
    first = run_episode(given, controller=controller, polygons=False).trace
    again = run_episode(given, controller=controller, polygons=False).trace
    assert np.array_equal(first.values, again.values, equal_nan=True)
