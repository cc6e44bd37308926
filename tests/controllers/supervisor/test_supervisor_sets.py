"""The supervisor's word: what its sets say of a state comes true, and is what it decides by."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from controllers.admissible.limits import recoverable_delta_v
from controllers.supervisor.momentum_state import momentum_state
from controllers.supervisor.supervisor import Supervisor
from models.robot import Robot, load_robot
from sim.episode.build import make_controller
from sim.episode.plant import PendulumPlant
from sim.record.outcome import Result
from tests.controllers.pushed import assert_zmp_was_inside, lift_offs, push, run, scenario


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


@pytest.mark.parametrize("direction", range(0, 360, 45))
def test_in_the_regulators_sets_nobody_steps(direction: int) -> None:
    result = push(direction, 0.15)
    assert result.outcome.steps_taken == 0
    assert not result.trace["phase"].any()
    assert result.trace["regulator_slack"].min() >= 0.0


def test_without_the_early_trigger_the_whole_of_the_regulators_set_is_stood(robot: Robot) -> None:
    late = {"early_trigger": 0.0}
    given = scenario((0.1, 0, 0.2), stepping=late)
    controller = make_controller(given, robot)
    assert isinstance(controller, Supervisor)
    controller.command(PendulumPlant(given, robot).observe())
    assert controller.regulator is not None
    limit = recoverable_delta_v(controller.regulator.softest, 0.0)
    # A push that lasts no longer than a tick; sudden to within a tenth of a percent.
    assert not lift_offs(run((0.1, 0, 0.99 * limit, 0.002), stepping=late))
    assert lift_offs(run((0.1, 0, 1.01 * limit, 0.002), stepping=late))


def test_outside_all_sets_the_least_violated_is_taken_and_said() -> None:
    result = push(0, 4.0)
    outside = [d for d in result.decisions if d["outside_all"]]
    assert outside
    assert all(d["phase"] == "stepping" for d in outside)
    assert any(max(c["slack"] for c in d["candidates"]) < 0.0 for d in lift_offs(result) if d["outside_all"])
    assert result.outcome.result is not Result.RECOVERED
    assert not result.pushes[0].in_regulator_set
    assert not result.pushes[0].in_tracking_set


def test_the_fewest_steps_that_suffice_are_taken_with_the_largest_slack() -> None:
    for way in (0, 60, 90, 200):
        first = next(d for d in push(way, 0.6).decisions if d["phase"] == "stepping")
        held = [c for c in first["candidates"] if c["slack"] >= 0.0]
        assert held

        def steps(candidate: dict[str, Any]) -> int:
            return int(candidate["name"].split()[-2])

        fewest = min(steps(c) for c in held)
        best = max((c for c in held if steps(c) == fewest), key=lambda c: c["slack"])
        side, time = best["name"].split()[:2]
        assert first["plan"].startswith(f"{side} {time} s,")


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


def test_the_early_trigger_lifts_a_foot_sooner() -> None:
    lifted = {}
    for lead in (0.0, 0.05, 0.1):
        result = run((0.1, 0, 0.6), stepping={"early_trigger": lead})
        assert result.outcome.result is Result.RECOVERED
        lifted[lead] = next(d for d in result.decisions if d["phase"] == "stepping")
    assert lifted[0.1]["time"] < lifted[0.05]["time"] < lifted[0.0]["time"]
    # Without it not before the state has left the regulator's sets, with it while they still hold it.
    assert lifted[0.0]["regulator_slack"] < 0.0 <= lifted[0.1]["regulator_slack"]


def test_spin_counts_as_state_if_it_is_asked_for(robot: Robot) -> None:
    given = scenario((0.1, 0, 0.3))
    still = PendulumPlant(given, robot).observe()
    spun = replace(still, angular_momentum=np.array([0.2, 0.3, 0.0]))
    lever = robot.mass * robot.cog_height
    # Pitching forward is momentum about the feet as moving forward is, rolling to the right as moving to the right.
    gained = [0.0, 0.3 / lever, 0.0, -0.2 / lever]
    assert momentum_state(spun, robot) - momentum_state(still, robot) == pytest.approx(gained, abs=1e-15)
    commands = {}
    for counted in (True, False):
        for name, seen in (("spun", spun), ("still", still)):
            controller = make_controller(scenario((0.1, 0, 0.3), stepping={"angular_momentum": counted}), robot)
            commands[counted, name] = controller.command(seen).zmp
    assert np.array_equal(commands[False, "spun"], commands[False, "still"])
    assert commands[True, "spun"][0] > commands[True, "still"][0]


def test_decided_by_sets_that_withstand_an_error_it_steps_earlier_and_still_recovers() -> None:
    def first_step(error: float) -> tuple[Result, float]:
        result = run((0.1, 0, 0.5), stepping={"zmp_error": error, "early_trigger": 0.0})
        return result.outcome.result, next(d["time"] for d in result.decisions if d["phase"] == "stepping")

    exact, robust = first_step(0.0), first_step(0.005)
    assert exact[0] is robust[0] is Result.RECOVERED
    assert robust[1] < exact[1]
