"""The main job: the paper's falling avoidance, on the pendulum and on the whole body."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from scenarios.catalogue import load
from sim.episode.episode import EpisodeResult, run_episode
from sim.record.outcome import Result


@cache
def run(
    world: str, controller: str = "supervisor", whole_body: str = "dynamics", name: str = "three_pushes"
) -> EpisodeResult:
    overrides = {"world": world, "controller": controller, "whole_body": whole_body}
    return run_episode(load(name, overrides), polygons=False)


@pytest.mark.parametrize("world", ["pendulum", "humanoid"])
def test_two_pushes_are_stood_and_the_third_is_stepped(world: str) -> None:
    result = run(world)
    assert [push.chosen for push in result.pushes] == ["standing", "standing", "stepping"]
    assert [push.in_regulator_set for push in result.pushes] == [True, True, False]
    assert result.pushes[2].in_tracking_set
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken >= 1
    # Decided during the third push, not only after it.
    push = result.scenario.pushes[2]
    first = next(d for d in result.decisions if d["candidates"] and d["time"] >= push.start)
    assert first["time"] < push.end
    assert first["tracking_slack"] >= 0.0
    assert {candidate["name"].split()[0] for candidate in first["candidates"]} >= {"left", "right"}
    assert not any(d["outside_all"] for d in result.decisions)


def test_the_pendulum_keeps_its_zmp_inside_at_every_tick() -> None:
    trace = run("pendulum").trace
    # The polygon's corners and its edge lines are rounded separately.
    assert trace["support_slack"].min() >= -1e-12
    # The command itself was inside: nothing had to be clamped.
    commanded = np.column_stack([trace["zmp_cmd_x"], trace["zmp_cmd_y"]])
    measured = np.column_stack([trace["zmp_x"], trace["zmp_y"]])
    assert measured[1:] == pytest.approx(commanded[:-1], abs=1e-12)


@pytest.mark.parametrize("world", ["pendulum", "humanoid"])
@pytest.mark.parametrize("controller", ["regulator", "statue"])
def test_the_third_push_fells_who_does_not_step(world: str, controller: str) -> None:
    result = run(world, controller)
    if world == "humanoid":
        assert result.outcome.result is Result.FELL
        assert (result.outcome.time_of_fall or 0.0) > 9.0
    else:
        # A pendulum's height is fixed and it has no trunk: it tilts without end.
        assert result.outcome.result is not Result.RECOVERED
    assert result.outcome.steps_taken == 0


def test_the_other_whole_body_layer_recovers_too() -> None:
    outcome = run_episode(load("three_pushes", {"whole_body": "ik"}), polygons=False).outcome
    assert outcome.result is Result.RECOVERED
    assert outcome.steps_taken > 0


@pytest.mark.parametrize("name", ["quiet", "push_back", "push_left", "push_diagonal"])
def test_what_is_shipped_to_be_recovered_is(name: str) -> None:
    assert run("humanoid", name=name).outcome.result is Result.RECOVERED


def test_a_push_that_must_fell_does() -> None:
    result = run("humanoid", name="push_that_fells")
    assert result.outcome.result is Result.FELL
    assert any(d["outside_all"] for d in result.decisions)


def test_a_quiet_robot_stands_still() -> None:
    trace = run("humanoid", name="quiet").trace
    late = trace.time > 1.0  # the seeded pose has settled
    assert np.hypot(trace["cog_vx"], trace["cog_vy"])[late].max() < 0.005
    assert trace["steps"].max() == 0
    assert not trace["solver_failed"][:-1].any()
