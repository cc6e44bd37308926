"""Pushes that are added while an episode runs: the scenario that is left behind replays the same episode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.envs.dm_env import make_environment
from sim.episode.build import make_controller
from sim.episode.episode import Episode, EpisodeResult, run_episode
from sim.episode.plant import make_plant
from sim.episode.push_record import TorqueRecord
from sim.episode.run_folder import SCENARIO, write_records

LATER = {"start": 1.9, "direction": 200.0, "delta_v": 0.1}
# When the pushes are added [tick], and what.
ADDED = {
    151: Push(start=0.0, direction=90.0, delta_v=0.2),
    502: Push(start=99.0, vector=(1.0, 0.5, 0.0), impulse=1.5, shape="half_sine", duration=0.0803),
}
TWIST = Push(start=0.0, torque=(0.2, 0.0, -0.8), duration=0.3)


def scenario(world: str, *, pushes: tuple[dict[str, object], ...] = (LATER,)) -> Scenario:
    fields = {"description": "pushed by hand", "world": world, "duration": 5.0, "seed": 4, "pushes": pushes}
    return Scenario.model_validate(fields)


def by_hand(pushes: dict[int, Push]) -> Callable[[Episode], None]:
    def push(episode: Episode) -> None:
        if episode.ticks in pushes:
            now = episode.time
            added = episode.add_push(pushes[episode.ticks])
            assert added.start == pytest.approx(now, abs=1e-12)
            assert added in episode.scenario.pushes

    return push


def assert_same(one: EpisodeResult, other: EpisodeResult) -> None:
    assert one.trace.channels == other.trace.channels
    assert one.trace.values.tobytes() == other.trace.values.tobytes()
    assert one.trace.metadata["scenario"] == other.trace.metadata["scenario"]
    assert one.outcome == other.outcome
    assert one.decisions == other.decisions
    assert [asdict(push) for push in one.pushes] == [asdict(push) for push in other.pushes]
    assert [(p.push, p.name, p.vertices.tobytes()) for p in one.set_polygons] == [
        (p.push, p.name, p.vertices.tobytes()) for p in other.set_polygons
    ]


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_saved_scenario_replays_the_episode(world: str, tmp_path: Path) -> None:
    # While another push acts, and before one that is to begin later.
    third = (
        TWIST if world == "humanoid" else TWIST.model_copy(update={"torque": None, "direction": 9.0, "impulse": 0.4})
    )
    result = run_episode(scenario(world), on_tick=by_hand(ADDED | {515: third}))
    pushes = result.scenario.pushes
    assert [push.start for push in pushes] == [0.302, 1.004, 1.03, 1.9]
    assert [push.start for push in result.pushes] == [0.302, 1.004, 1.03, 1.9]
    for record, push in zip(result.pushes, pushes, strict=True):
        assert record.reached
        asked, given = np.linalg.norm(push.asked(result.robot.mass)), record.delivered_impulse
        if isinstance(record, TorqueRecord):
            given = record.delivered_angular_impulse
        assert given == pytest.approx(asked, rel=1e-9)
    write_records(tmp_path, result)
    again = load(tmp_path / SCENARIO)
    assert again == result.scenario
    assert_same(run_episode(again), result)


def test_last_push_decides_when_the_episode_ends() -> None:
    """A push added while it rests from the one before: both runs end at the same tick."""
    plain = run_episode(scenario("pendulum"))
    almost = len(plain.trace) - 5
    result = run_episode(scenario("pendulum"), on_tick=by_hand({almost: Push(start=0.0, direction=0.0, impulse=0.3)}))
    assert len(result.trace) > len(plain.trace) + 400
    assert_same(run_episode(result.scenario), result)


def test_push_shorter_than_a_tick_is_added_between_deciding_and_the_physics() -> None:
    asked, robot = scenario("pendulum", pushes=({"start": 0.1, "direction": 0.0, "impulse": 0.2},)), load_robot("utmu2")
    short = Push(start=0.0, direction=0.0, impulse=1e-3, duration=0.0005)

    def run(asked: Scenario, at: int | None) -> EpisodeResult:
        episode = Episode(asked, make_plant(asked, robot), make_controller(asked, robot))
        while True:
            episode.observe()
            if not episode.begin(episode._ask(episode.controller)):  # type: ignore[arg-type]
                return episode.result()
            if episode.ticks == at:
                episode.add_push(short)
            episode.plant.step()
            episode.end()

    ended = run(asked, None).trace
    result = run(asked, len(ended) - 2)
    assert_same(run_episode(result.scenario, polygons=False), result)


def test_refused_push_changes_nothing() -> None:
    asked, robot = scenario("humanoid"), load_robot("utmu2")
    episode = Episode(asked, make_plant(asked, robot))
    for push, line in (
        (Push(start=0.0, direction=0.0, impulse=1.0, body="torso"), "added push: pushes[0].body: utmu2 has no body"),
        (Push(start=0.0, direction=0.0, impulse=1e4), "added push: pushes[0].impulse: 10000.0 N s gives"),
        (Push(start=0.0, direction=0.0, impulse=1.0, duration=5.0), "added push: duration: 5.0 s must be beyond"),
    ):
        with pytest.raises(InputError) as caught:
            episode.add_push(push)
        assert str(caught.value).startswith(line)
        assert "\n" not in str(caught.value)
    assert episode.scenario == asked
    assert len(episode.plant.impulse_log.scheduled) == 1


def test_next_episode_of_an_environment_is_not_pushed() -> None:
    environment = make_environment(scenario("humanoid"), "joints")
    action = np.zeros(environment.action_spec().shape)
    environment.reset()
    environment.step(action)
    environment.task.episode.add_push(ADDED[502])
    assert len(environment.task.episode.scenario.pushes) == 2
    environment.reset()
    assert len(environment.task.episode.scenario.pushes) == 1
    assert len(environment.task.episode.plant.impulse_log.scheduled) == 1
