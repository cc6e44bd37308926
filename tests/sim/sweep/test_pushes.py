"""Trains and first pushes are of their size for the robot, and the same for all who are compared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from models.robot import load_robot
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.results.push_size import edge_distance
from sim.sweep.plan import PlannedEpisode, plan, scenario_of
from tests.sim.sweep.sweep_suites import suite
from tests.sim.sweep.test_plan import RANDOM, episodes

TRAIN = """
description = "x"
replicas = 3
[axes]
controller = ["supervisor", "statue"]
mass_scale = [0.9, 1.0]
body = ["trunk"]
start = [0.5]
[train]
count = 6
interval = 3.0
first = 0.5
growth = 0.1
[replica]
shift = 0.1
"""
FIRST = """
description = "x"
replicas = 5
[axes]
controller = ["supervisor", "statue"]
direction = [0, 90]
delta_v = [0.1, 0.2]
start = [1.0]
[first]
size = 1.2
gap = 0.25
duration = 0.2
[replica]
shift = 0.1
direction = 5.0
"""
# Directions and sizes are written with six digits.
WRITTEN = 1e-5


def scenarios(folder: Path, text: str) -> list[tuple[PlannedEpisode, Scenario]]:
    loaded = suite(folder, text)
    return [(episode, scenario_of(loaded, episode)) for series in plan(loaded) for episode in series.episodes]


def omega_d(push: Push) -> float:
    """Size of a push in units of omega d of its own direction."""
    robot = load_robot("utmu2")
    assert push.delta_v is not None
    return push.delta_v / robot.omega / edge_distance(robot, push.unit[:2])


def test_train_grows_at_its_pace_in_units_of_omega_d(tmp_path: Path) -> None:
    found = scenarios(tmp_path, TRAIN)
    assert len(found) == 12
    for episode, scenario in found:
        pushes = scenario.pushes
        begin = 0.5 + 0.1 * episode.parameters["replica"]
        assert [push.start for push in pushes] == pytest.approx([begin + 3.0 * i for i in range(6)])
        assert [omega_d(push) for push in pushes] == pytest.approx([0.5, 0.6, 0.7, 0.8, 0.9, 1.0], rel=WRITTEN)
        # What the base scenario's push says is kept, but for what a train decides.
        assert {(push.duration, push.body, push.vector, push.impulse) for push in pushes} == {
            (0.1, "trunk", None, None)
        }
        assert scenario.duration > pushes[-1].end + 5.0
        assert not {"direction", "delta_v"} & episode.parameters.keys()


def test_train_s_directions_are_the_replica_s_whoever_answers(tmp_path: Path) -> None:
    ways: dict[int, set[tuple[float | None, ...]]] = {}
    for episode, scenario in scenarios(tmp_path, TRAIN):
        ways.setdefault(episode.parameters["replica"], set()).add(tuple(p.direction for p in scenario.pushes))
    assert all(len(same) == 1 for same in ways.values())
    assert len(set.union(*ways.values())) == 3
    other = {tuple(p.direction for p in scenario.pushes) for _, scenario in scenarios(tmp_path, "seed = 1\n" + TRAIN)}
    assert not other & set.union(*ways.values())


def test_longer_train_begins_alike(tmp_path: Path) -> None:
    short, long = (scenarios(tmp_path, TRAIN.replace("count = 6", f"count = {n}")) for n in (6, 9))
    for (_, some), (_, more) in zip(short, long, strict=True):
        assert more.pushes[:6] == some.pushes
        assert len(more.pushes) == 9


def test_train_s_directions_are_all_around(tmp_path: Path) -> None:
    found = scenarios(tmp_path, TRAIN.replace("count = 6", "count = 40"))
    ways = np.array([push.direction for _, scenario in found for push in scenario.pushes])
    assert ((ways >= 0) & (ways <= 360)).all()
    # 120 different even draws leave an eighth of the circle empty with probability 8 (7/8)^120 = 1e-6; fixed seed.
    assert set((ways // 45).astype(int)) == set(range(8))


def test_other_trains_are_other_episodes(tmp_path: Path) -> None:
    names = set(episodes(tmp_path, TRAIN))
    assert not names & set(episodes(tmp_path, TRAIN.replace("growth = 0.1", "growth = 0.2")))


def test_first_push_is_of_its_size_and_ends_a_gap_before_the_one_asked_for(tmp_path: Path) -> None:
    for episode, scenario in scenarios(tmp_path, FIRST):
        first, asked = scenario.pushes
        assert asked.start == pytest.approx(1.0 + 0.1 * episode.parameters["replica"])
        assert asked.start - first.end == pytest.approx(0.25)
        assert first.duration == 0.2
        assert omega_d(first) == pytest.approx(1.2, rel=WRITTEN)
        assert asked.delta_v == episode.parameters["delta_v"]
        assert asked.direction is not None
        assert abs(asked.direction - episode.parameters["direction"]) <= 5.0
        assert scenario.duration > asked.end + 5.0


def test_first_push_is_the_same_whatever_follows_and_replicas_are_spread(tmp_path: Path) -> None:
    ways: dict[int, set[float | None]] = {}
    for episode, scenario in scenarios(tmp_path, FIRST):
        ways.setdefault(episode.parameters["replica"], set()).add(scenario.pushes[0].direction)
    assert all(len(same) == 1 for same in ways.values())
    around = np.sort([way for same in ways.values() for way in same if way is not None])
    assert len(around) == 5
    gaps = np.diff([*around, around[0] + 360.0])
    # Golden sections part a circle into gaps of at most two lengths for five points: 52.5 and 85 degrees.
    assert gaps.min() > 50
    assert gaps.max() < 90


def test_drawn_pushes_follow_first_pushes_of_their_own(tmp_path: Path) -> None:
    text = RANDOM.replace("[random]", "[first]\nsize = 1.0\ngap = 0.3\n[random]")
    found = scenarios(tmp_path, text)
    ways = {scenario.pushes[0].direction for _, scenario in found}
    assert len(ways) == 40  # of 80 episodes, each push in two worlds
