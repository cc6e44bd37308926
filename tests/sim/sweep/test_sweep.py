"""A sweep writes each episode down once, and gives the same rows on any executor."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from models.robot import load_robot
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from sim.results import table as results
from sim.results.columns import COLUMNS, OUTCOME, PARAMETERS, SCHEMA
from sim.results.table import read_results
from sim.sweep import store as sweep_store
from sim.sweep.executors import Workers, local
from sim.sweep.plan import PlannedEpisode, Series, plan
from sim.sweep.scheduler import Scheduler
from sim.sweep.sweep import run_sweep
from sim.sweep.worker import trace_hash
from tests.sim.sweep.sweep_suites import HERE, HUMANOID, Counting, lasting, suite


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pa.Table:
    """The suite run in this process, without any interruption."""
    folder = tmp_path_factory.mktemp("whole")
    run_sweep(suite(folder), folder / "out", HERE)
    return read_results(folder / "out")


def test_every_episode_has_its_row(whole: pa.Table, tmp_path: Path) -> None:
    planned = {episode.name for series in plan(suite(tmp_path)) for episode in series.episodes}
    assert set(whole["episode"].to_pylist()) == planned
    assert whole.num_rows == len(planned) == 16


def test_rows_say_what_happened(whole: pa.Table) -> None:
    assert whole.schema.names == list(COLUMNS)
    for row in whole.to_pylist():
        assert row["outcome"] in ("recovered", "fell", "not_settled")
        assert row["delivered_impulse"] == pytest.approx(row["impulse"], abs=1e-9)
        assert row["delta_v_over_omega_d"] > 0
        missing = {"variant", "friction", "time_of_fall", "settle_time", "traceback", "dcm_error_rms", "dcm_error_peak"}
        missing |= {"first_direction_deg", "first_delta_v", "train", "pushes_survived", "total_impulse", "pushes"}
        missing |= {name for name in OUTCOME if name.startswith(("peak_", "saturated_"))}  # the pendulum has no motors
        missing |= {name for name in OUTCOME if row["controller"] == "statue" and "_set_" in name}
        missing |= {name for name in OUTCOME if row["controller"] == "statue" and "slack" in name}
        # Who never steps asks no tracking set.
        missing |= {name for name in OUTCOME if row["controller"] == "regulator" and "tracking_s" in name}
        missing |= {name for name in OUTCOME if row["controller"] == "regulator" and "in_tracking_set" in name}
        missing |= {"outside_all"} if row["controller"] == "statue" else set()
        assert {name for name, value in row.items() if value is None} <= missing
        assert (row["time_of_fall"] is None) == (row["outcome"] != "fell")
        assert (row["settle_time"] is None) == (row["outcome"] != "recovered")
        assert {"python", "mujoco", "placo"} <= json.loads(row["versions"]).keys()
    assert {"recovered", "fell"} <= set(whole["outcome"].to_pylist())


def test_limit_is_the_distance_to_the_edge(whole: pa.Table) -> None:
    robot = load_robot("utmu2")
    for row in whole.to_pylist():
        sole = robot.sole_vertices["left"]
        # The soles are parallel, side by side and as far forward as back: their hull is a rectangle.
        wide = 0.5 * robot.stance_width + sole[:, 1].max()
        expected = {0.0: sole[:, 0].max(), 90.0: wide}[row["direction_deg"]]
        assert row["d_edge"] == pytest.approx(expected, abs=1e-9)
        assert row["delta_v_over_omega_d"] == pytest.approx(row["delta_v"] / robot.omega / expected, rel=1e-9)


def test_table_on_disk_has_units(whole: pa.Table, tmp_path: Path) -> None:
    results.write_table(whole, tmp_path / "a.parquet")
    table = results.read_file(tmp_path / "a.parquet")
    assert table == whole
    assert table.schema.field("d_edge").metadata[b"unit"] == b"m"
    for name in COLUMNS:
        numeric = SCHEMA.field(name).type in (pa.float64(), pa.int64())
        assert bool(SCHEMA.field(name).metadata[b"unit"]) == numeric
    assert set(PARAMETERS) <= set(COLUMNS)


def test_processes_give_the_same_rows_bit_for_bit(whole: pa.Table, tmp_path: Path) -> None:
    loaded = suite(tmp_path)
    with local(2) as workers:
        run_sweep(loaded, tmp_path / "out", workers)
        assert workers.count == 2
    assert lasting(read_results(tmp_path / "out")).equals(lasting(whole))
    sweep = results.read_sweep(tmp_path / "out")
    assert (sweep["name"], sweep["planned"], sweep["finished"], list(sweep["robots"])) == ("short", 16, 16, ["utmu2"])
    assert (tmp_path / "out" / results.SUITE).read_text() == loaded.text


def test_humanoid_gives_the_same_rows_whatever_ran_before_in_its_process(tmp_path: Path) -> None:
    both = HUMANOID.replace('"statue"', '"regulator"').replace("[axes]", '[axes]\nwhole_body = ["dynamics", "ik"]')
    run_sweep(suite(tmp_path, both), tmp_path / "one", HERE)
    with local(1) as workers:
        run_sweep(suite(tmp_path, both), tmp_path / "two", workers)
    one, two = (read_results(tmp_path / name) for name in ("one", "two"))
    assert lasting(one).equals(lasting(two))
    for name in ("peak_torque", "peak_torque_use", "peak_torque_joint", "peak_speed", "saturated_time"):
        assert None not in one[name].to_pylist()
    # An episode with solvers of its own, as `run` and `replay` make them.
    for row in one.to_pylist():
        trace = run_episode(Scenario.model_validate(json.loads(row["scenario"])), polygons=False).trace
        assert trace_hash(trace.values, trace.channels) == row["trace_hash"]


def test_finished_sweep_runs_nothing(tmp_path: Path) -> None:
    run_sweep(suite(tmp_path), tmp_path / "out", HERE)
    content = (tmp_path / "out" / results.RESULTS).read_bytes()
    ran: list[str] = []
    run_sweep(suite(tmp_path), tmp_path / "out", Workers(count=1, make=lambda: Counting(ran)))
    assert ran == []
    assert (tmp_path / "out" / results.RESULTS).read_bytes() == content


def test_rows_are_bundled_and_none_is_counted_twice(
    whole: pa.Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep_store, "BUNDLE", 5)
    out = tmp_path / "out"
    run_sweep(suite(tmp_path), out, HERE)
    assert len(list((out / results.ROWS).iterdir())) == 4  # 5 + 5 + 5 rows, and the last
    single = next(path for path in (out / results.ROWS).iterdir() if not path.name.startswith("bundle"))
    # As if killed between writing a bundle and deleting what it holds.
    bundle = results.read_file(next((out / results.ROWS).glob("bundle-*")))
    results.write_table(bundle.slice(0, 1), single.with_name(f"{bundle['episode'][0]}.parquet"))
    assert lasting(read_results(out)).equals(lasting(whole))
    run_sweep(suite(tmp_path), out, HERE)
    assert not single.with_name(f"{bundle['episode'][0]}.parquet").exists()
    assert lasting(read_results(out)).equals(lasting(whole))


def series(name: str, length: int, stop_after: int | None) -> Series:
    episodes = tuple(
        PlannedEpisode(name=f"{name}{i}", suite="s", series=name, seed=0, parameters={}) for i in range(length)
    )
    return Series(name=name, episodes=episodes, stop_after=stop_after)


def played(scheduler: Scheduler, falls_from: int) -> list[str]:
    """Names in the order in which a single worker runs them."""
    ran = []
    while (episode := scheduler.next()) is not None:
        ran.append(episode.name)
        scheduler.finish(episode, "fell" if int(episode.name[1:]) >= falls_from else "recovered")
    return ran


def test_series_stops_after_straight_failures() -> None:
    scheduler = Scheduler([series("a", 20, 3)], {})
    assert played(scheduler, 4) == [f"a{i}" for i in range(7)]
    assert (scheduler.done, scheduler.skipped, scheduler.planned) == (7, 13, 20)


def test_a_recovery_between_starts_the_count_again() -> None:
    finished = dict.fromkeys(("a0", "a1", "a3"), "fell") | {"a2": "recovered"}
    scheduler = Scheduler([series("a", 20, 3)], finished)
    assert played(scheduler, 0) == ["a4", "a5"]
    assert Scheduler([series("a", 20, 3)], finished | {"a4": "not_settled", "a5": "fell"}).next() is None


def test_series_run_side_by_side_and_of_each_what_is_run_whatever_happens() -> None:
    scheduler = Scheduler([series("a", 9, 2), series("b", 9, 1)], {})
    first = [scheduler.next() for _ in range(3)]
    assert [one and one.name for one in first] == ["a0", "b0", "a1"]
    assert scheduler.next() is None  # two failures end "a", and one ends "b"
    a0, b0, a1 = (one for one in first if one is not None)
    scheduler.finish(a1, "recovered")  # before a0: whatever becomes of that, a2 and a3 are run
    assert [one and one.name for one in (scheduler.next(), scheduler.next(), scheduler.next())] == ["a2", "a3", None]
    scheduler.finish(b0, "fell")
    scheduler.finish(a0, "fell")
    assert (scheduler.next(), scheduler.done, scheduler.skipped) == (None, 3, 8)


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("seed", range(8))
def test_any_number_of_workers_runs_the_episodes_that_one_runs(workers: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    every = [series(letter, 12, stop) for letter, stop in (("a", 1), ("b", 2), ("c", 3), ("d", None))]
    fates = {one.name: ("recovered", "fell")[rng.integers(2)] for group in every for one in group.episodes}
    expected = set()
    for group in every:
        straight = 0
        for one in group.episodes:
            if straight == group.stop_after:
                break
            expected.add(one.name)
            straight = 0 if fates[one.name] == "recovered" else straight + 1
    finished: dict[str, str] = {}
    # Stopped in the middle, with gaps where somebody was at work, and taken up again.
    for limit in (8, 99):
        scheduler = Scheduler(every, finished)
        flying: list[PlannedEpisode] = []
        assert scheduler.done == len(finished)
        for _ in range(limit):
            while len(flying) < workers and (episode := scheduler.next()) is not None:
                assert episode.name not in finished
                flying.append(episode)
            if not flying:
                break
            ended = flying.pop(rng.integers(len(flying)))
            finished[ended.name] = fates[ended.name]
            scheduler.finish(ended, fates[ended.name])
    assert finished.keys() == expected
    assert (scheduler.done, scheduler.left) == (len(expected), 0)


ADAPTIVE = """
description = "x"
replicas = 2
[axes]
world = ["pendulum"]
controller = ["statue"]
direction = [0, 90]
delta_v = { first = 0.2, last = 2.0, step = 0.2 }
start = [0.1]
[adaptive]
stop_after = 2
[scenario.timing]
physics = 0.005
control = 0.01
"""


def test_adaptive_sweep_goes_on_in_the_middle_of_a_series(tmp_path: Path) -> None:
    loaded = suite(tmp_path, ADAPTIVE)
    run_sweep(loaded, tmp_path / "whole", HERE)
    whole = read_results(tmp_path / "whole")
    assert 8 < whole.num_rows < 40
    out = tmp_path / "part"
    (out / results.ROWS).mkdir(parents=True)
    first = {one.episodes[0].name for one in plan(loaded)}
    for i, name in enumerate(whole["episode"].to_pylist()):
        if name in first:
            results.write_table(whole.slice(i, 1), out / results.ROWS / f"{name}.parquet")
    run_sweep(loaded, out, HERE)
    assert lasting(read_results(out)).equals(lasting(whole))
