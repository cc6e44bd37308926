"""The supervisor, closed on the pendulum: the ZMP stays inside at every tick, and every choice has its grounds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from controllers.limits import recoverable_delta_v
from controllers.signals import Controller
from controllers.supervisor import EDGE, Supervisor
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.brain import make_brain
from sim.episode import EpisodeResult, run_episode
from sim.outcome import Result
from sim.plant import PendulumPlant

DIRECTIONS = tuple(range(0, 360, 45))
GAINS = (
    {"kind": "dcm", "k": 1.5},
    {"kind": "lqr", "q": [1.0, 0.1], "r": 1.0},
    {"kind": "poles", "poles": [-2.0, -5.0]},
)
# Beyond the no-step limit of every direction, and far within what steps can answer [m/s].
NEEDS_A_STEP = 0.5


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def scenario(*pushes: tuple[float, ...], controller: str = "supervisor", **fields: Any) -> Scenario:
    """Pushes of (start, direction, delta_v) that last 0.1 s on the pendulum, or as long as a fourth entry says."""
    given = {
        "description": "pushes of the pendulum",
        "world": "pendulum",
        "controller": controller,
        "duration": pushes[-1][0] + 5.0,
        "variation": {"pose": 0.0},
        "pushes": [
            dict(zip(("start", "direction", "delta_v", "duration"), map(float, push), strict=False)) for push in pushes
        ],
    }
    return Scenario.model_validate(given | fields)


def run(*pushes: Any, **fields: Any) -> EpisodeResult:
    return run_episode(scenario(*pushes, **fields), polygons=False)


@cache
def push(direction: float, delta_v: float, controller: str = "supervisor") -> EpisodeResult:
    return run((0.1, direction, delta_v), controller=controller)


def lift_offs(result: EpisodeResult) -> list[dict[str, Any]]:
    """Decisions to step because of a push; a step that only closes the feet has no candidates."""
    return [d for d in result.decisions if d["candidates"]]


def assert_zmp_was_inside(result: EpisodeResult) -> None:
    trace = result.trace
    # The corners of a polygon and its edge lines are rounded separately.
    assert trace["support_slack"].min() >= EDGE - 1e-12
    # Nothing had to be clamped by the world: command and what was held are the same.
    commanded = np.column_stack([trace["zmp_cmd_x"], trace["zmp_cmd_y"]])[:-1]
    assert np.column_stack([trace["zmp_x"], trace["zmp_y"]])[1:] == pytest.approx(commanded, abs=1e-12)


CASES = [(0, direction) for direction in DIRECTIONS] + [(gain, direction) for gain in (1, 2) for direction in (45, 180)]


@pytest.mark.parametrize(("gain", "direction"), CASES)
def test_the_zmp_is_inside_at_every_tick_of_a_recovery(direction: int, gain: int) -> None:
    result = run((0.1, direction, NEEDS_A_STEP), gain=GAINS[gain])
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken >= 1
    assert_zmp_was_inside(result)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_in_the_regulators_sets_nobody_steps(direction: int) -> None:
    result = push(direction, 0.15)
    assert result.outcome.steps_taken == 0
    assert not result.trace["controller"].any()
    assert result.trace["regulator_slack"].min() >= 0.0


def test_without_the_early_trigger_the_whole_of_the_regulators_set_is_stood(robot: Robot) -> None:
    late = {"early_trigger": 0.0}
    given = scenario((0.1, 0, 0.2), stepping=late)
    brain = make_brain(given, robot)
    assert isinstance(brain, Supervisor)
    brain.command(PendulumPlant(given, robot).observe())
    assert brain.regulator is not None
    limit = recoverable_delta_v(brain.regulator.softest, 0.0)
    # A push that lasts no longer than a tick; sudden to within a tenth of a percent.
    assert not lift_offs(run((0.1, 0, 0.99 * limit, 0.002), stepping=late))
    assert lift_offs(run((0.1, 0, 1.01 * limit, 0.002), stepping=late))


def test_every_change_is_recorded_with_its_grounds() -> None:
    result = push(0, 0.7)
    trace, decisions = result.trace, result.decisions
    changes = trace.time[1:][(np.diff(trace["controller"]) != 0.0) | (np.diff(trace["steps"]) != 0.0)]
    assert len(changes) >= 2
    assert set(changes) <= {d["time"] for d in decisions}
    for d in decisions:
        assert d["reason"]
        assert d["in_regulator_set"] == (d["regulator_slack"] >= 0.0)
        stepping = d["tracking_slack"]
        assert d["in_tracking_set"] == (stepping is not None and stepping >= 0.0)
        assert d["outside_all"] == (not d["in_regulator_set"] and not d["in_tracking_set"])
        assert d["tight"].startswith("the ZMP")
        assert (d["controller"] == "tracker") == bool(d["plan"])
        assert not d["candidates"] or d["plan"]


def test_the_fewest_steps_that_suffice_are_taken_with_the_largest_slack() -> None:
    for way in (0, 60, 90, 200):
        first = next(d for d in push(way, 0.6).decisions if d["controller"] == "tracker")
        held = [c for c in first["candidates"] if c["slack"] >= 0.0]
        assert held

        def steps(candidate: dict[str, Any]) -> int:
            return int(candidate["name"].split()[-2])

        fewest = min(steps(c) for c in held)
        best = max((c for c in held if steps(c) == fewest), key=lambda c: c["slack"])
        side, time = best["name"].split()[:2]
        assert first["plan"].startswith(f"{side} {time} s,")


def test_outside_all_sets_the_least_violated_is_taken_and_said() -> None:
    result = push(0, 4.0)
    outside = [d for d in result.decisions if d["outside_all"]]
    assert outside
    assert all(d["controller"] == "tracker" for d in outside)
    assert any(max(c["slack"] for c in d["candidates"]) < 0.0 for d in lift_offs(result) if d["outside_all"])
    assert result.outcome.result is not Result.RECOVERED
    assert not result.pushes[0].in_regulator_set
    assert not result.pushes[0].in_tracking_set


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


def test_a_member_is_never_lost() -> None:
    """In a set at the end of the push means recovered: any size, any direction, any lean at first."""
    rng, seen = np.random.default_rng(4), []
    for seed in range(30):
        result = run(
            (rng.uniform(0.05, 0.2), rng.uniform(0.0, 360.0), rng.uniform(0.05, 2.2)),
            variation={"pose": 0.004},
            seed=seed,
            duration=5.0,
        )
        record, well = result.pushes[0], result.outcome.result is Result.RECOVERED
        safe = bool(record.in_regulator_set or record.in_tracking_set)
        assert well or not safe, (seed, record)
        seen.append((safe, well))
    # The draws were of both kinds.
    assert 5 <= sum(safe for safe, _ in seen) <= 25


@pytest.mark.parametrize("direction", [0, 70, 180, 300])
def test_a_member_is_not_lost_on_the_rim(direction: int) -> None:
    """Found by halving: the hardest push whose state is in a set at its end is recovered."""

    def told(delta_v: float) -> bool:
        record = run((0.1, direction, delta_v), duration=0.21).pushes[0]
        return bool(record.in_regulator_set or record.in_tracking_set)

    inside, outside = 0.3, 4.0
    assert told(inside)
    assert not told(outside)
    while outside - inside > 1e-3:
        half = 0.5 * (inside + outside)
        inside, outside = (half, outside) if told(half) else (inside, half)
    result = run((0.1, direction, inside), duration=8.0)
    assert result.outcome.result is Result.RECOVERED
    assert_zmp_was_inside(result)


def test_after_a_landing_the_other_foot_steps() -> None:
    result = push(60, 1.5)
    steps = [d["plan"].split()[0] for d in lift_offs(result)]
    assert len(steps) >= 2
    assert all(one != following for one, following in pairwise(steps))


def test_reset_forgets_the_last_episode(robot: Robot) -> None:
    given = scenario((0.1, 0, 0.7))
    brain = make_brain(given, robot)
    first = run_episode(given, brain=brain, polygons=False).trace
    again = run_episode(given, brain=brain, polygons=False).trace
    assert np.array_equal(first.values, again.values, equal_nan=True)
    assert brain.controller is Controller.REGULATOR


def landing(result: EpisodeResult, after: float) -> np.ndarray:
    """(3,) of time and place of the first landing after a time."""
    trace = result.trace
    for side in ("left", "right"):
        up = trace[f"{side}_stance"] == 0.0
        if up[trace.time < after].any():
            down = np.flatnonzero(~up & (trace.time >= after))[0]
            return np.array([trace.time[down], trace[f"{side}_x"][down], trace[f"{side}_y"][down]])
    raise AssertionError("no foot was in the air")


def test_a_second_push_during_the_swing_moves_the_foothold() -> None:
    """Unless footholds stay as they were at the lift-off."""
    first, second = (0.1, 0.0, 0.5, 0.05), (0.17, 40.0, 0.25, 0.02)
    moved = {}
    for replan in (True, False):
        alone, both = (
            run(*pushes, stepping={"replan": replan}, duration=5.0) for pushes in ((first,), (first, second))
        )
        lifted = next(d for d in alone.decisions if d["controller"] == "tracker")["time"]
        assert lifted < second[0]
        one, other = landing(alone, second[0]), landing(both, second[0])
        assert one[0] == other[0] > second[0] + second[3]
        moved[replan] = float(np.hypot(*(other - one)[1:]))
        if replan:
            assert both.outcome.result is Result.RECOVERED
            assert_zmp_was_inside(both)
    assert moved[True] > 0.01
    # Of a foot that comes down a tick or two from the end of its way.
    assert moved[False] < 1e-9


def test_a_push_after_the_recovery_is_answered_from_the_new_stance() -> None:
    result = run((0.1, 30, 0.8), (3.0, 200, 0.6))
    assert result.outcome.result is Result.RECOVERED
    assert [record.chosen for record in result.pushes] == ["tracker", "tracker"]
    # Each was foretold by the sets of the stance it found.
    assert all(record.in_tracking_set for record in result.pushes)


def test_with_one_step_at_most_no_second_follows() -> None:
    many, one = (run((0.1, 0, 1.5), stepping={"max_steps": n}) for n in (8, 1))
    assert many.outcome.result is Result.RECOVERED
    assert len(lift_offs(many)) >= 2
    assert len(lift_offs(one)) == 1
    assert one.outcome.result is not Result.RECOVERED


def test_the_early_trigger_lifts_a_foot_sooner() -> None:
    lifted = {}
    for lead in (0.0, 0.05, 0.1):
        result = run((0.1, 0, 0.6), stepping={"early_trigger": lead})
        assert result.outcome.result is Result.RECOVERED
        lifted[lead] = next(d for d in result.decisions if d["controller"] == "tracker")
    assert lifted[0.1]["time"] < lifted[0.05]["time"] < lifted[0.0]["time"]
    # Without it not before the state has left the regulator's sets, with it while they still hold it.
    assert lifted[0.0]["regulator_slack"] < 0.0 <= lifted[0.1]["regulator_slack"]


def test_the_polygon_rule_steps_without_sets() -> None:
    result = run((0.1, 0, 0.6), stepping={"rule": "polygon"})
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken >= 1
    assert np.isnan(result.trace["tracking_slack"]).all()
    stepped = [d for d in result.decisions if d["controller"] == "tracker"]
    assert {d["tracking_slack"] for d in stepped} == {None}
    assert [c["name"].split()[0] for c in stepped[0]["candidates"]] == ["left", "right"]


def test_spin_counts_as_state_if_it_is_asked_for(robot: Robot) -> None:
    given = scenario((0.1, 0, 0.3))
    still = PendulumPlant(given, robot).observe()
    spun = replace(still, angular_momentum=np.array([0.2, 0.3, 0.0]))
    lever = robot.mass * robot.cog_height
    # Pitching forward is momentum about the feet as moving forward is, rolling to the right as moving to the right.
    gained = {True: [0.0, 0.3 / lever, 0.0, -0.2 / lever], False: [0.0, 0.0, 0.0, 0.0]}
    for counted, expected in gained.items():
        brain = make_brain(scenario((0.1, 0, 0.3), stepping={"angular_momentum": counted}), robot)
        assert isinstance(brain, Supervisor)
        assert brain.state(spun) - brain.state(still) == pytest.approx(expected, abs=1e-15)
