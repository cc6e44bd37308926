"""Names and seeds of episodes follow from their own parameters, whatever else the suite holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.push_size import edge_distance
from sim.sweep_plan import Episode, plan, scenario_of, suite_hash
from tests.sim.sweep_suites import PENDULUM, suite

RANDOM = """
description = "x"
[axes]
world = ["pendulum", "humanoid"]
[random]
count = 40
direction = [0, 360]
delta_v = [0.1, 0.5]
height = [-0.05, 0.05]
"""
ADAPTIVE = """
description = "x"
replicas = 3
[axes]
direction = [0, 90]
delta_v = [0.3, 0.1, 0.2]
[adaptive]
stop_after = 2
"""
TRAIN = """
description = "x"
replicas = 3
scenario = "push_left"
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


def episodes(folder: Path, text: str) -> dict[str, Episode]:
    return {episode.name: episode for series in plan(suite(folder, text)) for episode in series.episodes}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("direction = [0, 90]", "direction = [45, 90, 0]"),
        ("delta_v = [0.1, 0.5]", "delta_v = [0.1, 0.2, 0.5]"),
        ("replicas = 2", "replicas = 4"),
        ('controller = ["statue", "regulator"]', 'controller = ["supervisor", "regulator", "statue"]'),
        ("start = [0.2]", "start = [0.2]\nmass_scale = [1.0, 1.1]"),
        ("start = [0.2]", "start = [0.2]\nduration = [0.1, 0.2]"),
        ("start = [0.2]", "start = [0.2]\nnoise_velocity = [0.0, 0.01]"),
    ],
)
def test_more_values_change_no_other_episode(old: str, new: str, tmp_path: Path) -> None:
    assert old in PENDULUM
    few, many = episodes(tmp_path, PENDULUM), episodes(tmp_path, PENDULUM.replace(old, new))
    assert len(few) == 16
    assert len(many) > len(few)
    assert {name: many[name] for name in few} == few


def test_more_random_pushes_change_no_other(tmp_path: Path) -> None:
    few, many = episodes(tmp_path, RANDOM), episodes(tmp_path, RANDOM.replace("40", "50"))
    assert (len(few), len(many)) == (80, 100)
    assert {name: many[name] for name in few} == few


def test_random_pushes_fill_their_ranges_and_are_the_same_in_both_worlds(tmp_path: Path) -> None:
    found = [episode.parameters for episode in episodes(tmp_path, RANDOM).values()]
    pushes = {
        world: [(p["direction"], p["delta_v"], p["height"]) for p in found if p["world"] == world]
        for world in ("pendulum", "humanoid")
    }
    assert pushes["pendulum"] == pushes["humanoid"]
    low, high = np.array([0, 0.1, -0.05]), np.array([360, 0.5, 0.05])
    share = (np.array(pushes["humanoid"]) - low) / (high - low)
    assert ((share >= 0) & (share <= 1)).all()
    # 40 even draws leave the lowest fifth empty with probability 0.8^40 = 1e-4; the seed is fixed.
    assert (share.min(axis=0) < 0.2).all()
    assert (share.max(axis=0) > 0.8).all()


def test_suite_s_seed_changes_every_episode(tmp_path: Path) -> None:
    one, other = episodes(tmp_path, PENDULUM), episodes(tmp_path, PENDULUM.replace("seed = 7", "seed = 8"))
    assert not set(one) & set(other)
    assert not {e.seed for e in one.values()} & {e.seed for e in other.values()}


def test_who_answers_does_not_change_what_is_drawn(tmp_path: Path) -> None:
    loaded = suite(tmp_path)
    by_push: dict[tuple[object, ...], list[Episode]] = {}
    for series in plan(loaded):
        for episode in series.episodes:
            key = tuple(episode.parameters[name] for name in ("direction", "delta_v", "replica"))
            by_push.setdefault(key, []).append(episode)
    for one, other in by_push.values():
        assert one.parameters["controller"] != other.parameters["controller"]
        assert one.seed == other.seed
        assert scenario_of(loaded, one).pushes == scenario_of(loaded, other).pushes
    assert len({pair[0].seed for pair in by_push.values()}) == len(by_push)


def test_replicas_differ_by_the_sizes_in_the_suite(tmp_path: Path) -> None:
    text = PENDULUM.replace("replicas = 2", "replicas = 30").replace(
        "time = 0.05", "time = 0.05\nshift = 0.1\npose = 0.003"
    )
    loaded = suite(tmp_path, text)
    late, turned = [], []
    for series in plan(loaded):
        (episode,) = series.episodes
        scenario = scenario_of(loaded, episode)
        (push,) = scenario.pushes
        assert scenario.seed == episode.seed
        assert scenario.variation.pose == 0.003
        late.append(push.start - 0.2 - 0.1 * episode.parameters["replica"])
        assert push.direction is not None
        turned.append(push.direction - episode.parameters["direction"])
        # Judged 5 s after the push at the latest: the last row of the trace must be that late.
        assert (scenario.ticks - 1) * scenario.timing.control >= push.end + 5.0 - 1e-9
    for drawn, most in ((late, 0.05), (turned, 5.0)):
        assert np.abs(drawn).max() <= most + 1e-6  # they are rounded to so many digits
        assert np.abs(drawn).max() > 0.9 * most
        assert len(set(drawn)) > 100


def test_series_grow_and_keep_replicas_apart(tmp_path: Path) -> None:
    series = plan(suite(tmp_path, ADAPTIVE))
    assert len(series) == 6
    for one in series:
        assert one.stop_after == 2
        assert [e.parameters["delta_v"] for e in one.episodes] == [0.1, 0.2, 0.3]
        assert len({(e.parameters["direction"], e.parameters["replica"]) for e in one.episodes}) == 1
        assert {e.series for e in one.episodes} == {one.name}


def test_series_may_take_all_replicas_of_a_size_first(tmp_path: Path) -> None:
    series = plan(suite(tmp_path, ADAPTIVE + "each_replica = false\n"))
    assert len(series) == 2
    for one in series:
        sizes = [(e.parameters["delta_v"], e.parameters["replica"]) for e in one.episodes]
        assert sizes == [(size, replica) for size in (0.1, 0.2, 0.3) for replica in range(3)]


def test_hash_is_of_what_is_run(tmp_path: Path) -> None:
    plain = suite_hash(suite(tmp_path))
    assert suite_hash(suite(tmp_path, PENDULUM.replace("short", "brief"))) == plain
    assert suite_hash(suite(tmp_path, PENDULUM.replace("seed = 7", "seed = 8"))) != plain
    assert suite_hash(suite(tmp_path, PENDULUM.replace("control = 0.01", "control = 0.02"))) != plain


def scenarios(folder: Path, text: str) -> list[tuple[Episode, Scenario]]:
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


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('body = ["trunc"]', "no body 'trunc'; did you mean 'trunk'?"),
        ('robot = ["utmu3"]', "did you mean 'utmu2'?"),
        ("friction = [0.5]", "disturbance.friction"),
        ('body = ["trunk", "cog"]\nheight = [0.1]', "pushes[0].height"),
        ("delay = [0.0, 0.003]", "disturbance.delay"),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_runs(more: str, words: str, tmp_path: Path) -> None:
    loaded = suite(tmp_path, PENDULUM.replace("start = [0.2]", f"start = [0.2]\n{more}"))
    with pytest.raises(InputError) as caught:
        plan(loaded)
    assert words in str(caught.value)
    assert str(loaded.path) in str(caught.value)
