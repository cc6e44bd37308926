"""Names and seeds of episodes follow from their own parameters, whatever else the suite holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from models.errors import InputError
from scenarios.suite_catalogue import in_world
from sim.sweep.plan import PlannedEpisode, plan, scenario_of, suite_hash
from tests.sim.sweep.sweep_suites import PENDULUM, suite

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


def episodes(folder: Path, text: str) -> dict[str, PlannedEpisode]:
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
    by_push: dict[tuple[object, ...], list[PlannedEpisode]] = {}
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


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('body = ["trunc"]', "no body 'trunc'; did you mean 'trunk'?"),
        ('robot = ["utmu3"]', "did you mean 'utmu2'?"),
        ("friction = [0.5]", "disturbance.friction"),
        ('body = ["trunk", "cog"]\nheight = [0.1]', "pushes[0].height"),
        ("latency = [0.0, 0.003]", "sensing.latency"),
        ('sensing = ["typical"]', "the pendulum has no sensors"),
        ("body_error = [1.0]", "body.scale: 1.0 is not allowed"),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_runs(more: str, words: str, tmp_path: Path) -> None:
    loaded = suite(tmp_path, PENDULUM.replace("start = [0.2]", f"start = [0.2]\n{more}"))
    with pytest.raises(InputError) as caught:
        plan(loaded)
    assert words in str(caught.value)
    assert str(loaded.path) in str(caught.value)


def test_same_pushes_in_one_world(tmp_path: Path) -> None:
    loaded = suite(tmp_path, RANDOM.replace('"pendulum", "humanoid"', '"humanoid"'))
    plain, other = loaded, in_world(loaded, "pendulum")
    assert suite_hash(other) != suite_hash(plain)
    found = [[scenario_of(one, series.episodes[0]) for series in plan(one)] for one in (plain, other)]
    assert [scenario.pushes for scenario in found[0]] == [scenario.pushes for scenario in found[1]]
    assert [scenario.seed for scenario in found[0]] == [scenario.seed for scenario in found[1]]
    assert {scenario.world for scenario in found[1]} == {"pendulum"}
