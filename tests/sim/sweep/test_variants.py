"""Variants answer the same pushes; sizes in units of omega d are those of their direction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from models.errors import InputError
from models.robot import load_robot
from sim.results.columns import SCHEMA
from sim.results.push_size import edge_distance
from sim.results.table import ROWS, SWEEP, read_results, write_table
from sim.sweep.plan import PlannedEpisode, plan, scenario_of, suite_hash
from sim.sweep.sweep import run_sweep
from sim.sweep.worker import Job, run_job
from tests.sim.sweep.sweep_suites import HERE, PENDULUM, Counting, lasting, suite

SMALL = PENDULUM.replace('controller = ["statue", "regulator"]\n', "")
VARIANTS = (
    SMALL
    + """
[variants]
"full" = { controller = "regulator" }
"stiff" = { controller = "regulator", "gain.k" = 3.0 }
"statue" = { controller = "statue", "sensing.latency" = 0.01 }
"""
)


def planned(folder: Path, text: str) -> list[PlannedEpisode]:
    return [episode for series in plan(suite(folder, text)) for episode in series.episodes]


def test_variants_answer_the_same_pushes(tmp_path: Path) -> None:
    loaded = suite(tmp_path, VARIANTS)
    found = planned(tmp_path, VARIANTS)
    assert len(found) == loaded.suite.episodes == 3 * 8
    by_seed: dict[int, list[PlannedEpisode]] = {}
    for episode in found:
        by_seed.setdefault(episode.seed, []).append(episode)
    assert len(by_seed) == 8
    for same in by_seed.values():
        scenarios = {str(episode.parameters["variant"]): scenario_of(loaded, episode) for episode in same}
        assert set(scenarios) == {"full", "stiff", "statue"}
        assert scenarios["full"].pushes == scenarios["stiff"].pushes == scenarios["statue"].pushes
        assert scenarios["stiff"].as_dict()["gain"]["k"] == 3.0
        assert scenarios["full"].as_dict()["gain"]["k"] == 1.5
        assert [scenarios[name].controller.name for name in scenarios] == ["regulator", "regulator", "statue"]
        assert [scenarios[name].sensing.latency for name in scenarios] == [0.0, 0.0, 0.01]


def test_variants_come_side_by_side_so_that_a_part_of_a_sweep_can_be_read(tmp_path: Path) -> None:
    # An episode of every variant, each of both replicas, before the next push.
    first = [(e.parameters["variant"], e.parameters["replica"]) for e in planned(tmp_path, VARIANTS)[:6]]
    assert first == [(name, replica) for name in ("full", "stiff", "statue") for replica in (0, 1)]


def test_another_variant_changes_no_other_episode_and_another_change_is_another_episode(tmp_path: Path) -> None:
    few = {episode.name: episode for episode in planned(tmp_path, VARIANTS)}
    many = {episode.name: episode for episode in planned(tmp_path, VARIANTS + '"ik" = { whole_body = "ik" }\n')}
    assert {name: many[name] for name in few} == few
    other = {episode.name for episode in planned(tmp_path, VARIANTS.replace("3.0", "4.0"))}
    assert len(other & set(few)) == 16
    assert suite_hash(suite(tmp_path, VARIANTS)) != suite_hash(suite(tmp_path, VARIANTS.replace("3.0", "4.0")))


def test_an_episode_without_variants_is_as_before_there_were_any(tmp_path: Path) -> None:
    # Name and seed by the version before; baselines are paired by them.
    first = planned(tmp_path, PENDULUM)[0]
    assert (first.name, first.seed) == ("8fcad19f9a03", 1206745530)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("variants")
    run_sweep(suite(folder, VARIANTS), folder / "out", HERE)
    return folder / "out"


def test_rows_name_their_variant_and_what_it_does_is_done(swept: Path) -> None:
    rows = read_results(swept).to_pylist()
    assert len(rows) == 24
    assert {(row["variant"], row["controller"], row["latency"]) for row in rows} == {
        ("full", "regulator", 0.0),
        ("stiff", "regulator", 0.0),
        ("statue", "statue", 0.01),
    }
    traces = {(row["seed"], row["variant"]): row["trace_hash"] for row in rows}
    assert all(traces[seed, "full"] != traces[seed, "stiff"] for seed, _ in traces)


def test_sweep_of_variants_goes_on_where_it_was(swept: Path, tmp_path: Path) -> None:
    table = read_results(swept)
    (tmp_path / "out" / ROWS).mkdir(parents=True)
    for name in (SWEEP, "suite.toml"):
        (tmp_path / "out" / name).write_bytes((swept / name).read_bytes())
    write_table(table.slice(3), tmp_path / "out" / ROWS / "bundle-a.parquet")
    ran: list[str] = []
    run_sweep(suite(tmp_path, VARIANTS), tmp_path / "out", replace(HERE, make=lambda: Counting(ran)))
    assert sorted(ran) == sorted(table["episode"].to_pylist()[:3])
    assert lasting(read_results(tmp_path / "out")).equals(lasting(table))


def test_a_variant_that_the_robot_cannot_be_is_refused_before_anything_runs(tmp_path: Path) -> None:
    loaded = suite(tmp_path, VARIANTS + '"long" = { "stepping.max_stride" = 2.0 }\n')
    with pytest.raises(InputError) as caught:
        plan(loaded)
    assert f'{loaded.path}: variants."long": stepping.max_stride: 2.0 m is longer' in str(caught.value)


def test_tables_from_before_there_were_variants_are_read(swept: Path, tmp_path: Path) -> None:
    table = read_results(swept)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / SWEEP).write_text("{}")
    write_table(table.drop_columns(["variant"]), tmp_path / "old" / "results.parquet")
    old = read_results(tmp_path / "old")
    assert old.schema.names == SCHEMA.names
    assert old["variant"].null_count == old.num_rows
    assert old.drop_columns(["variant"]).equals(table.drop_columns(["variant"]))
    write_table(pa.table({"episode": ["a"]}), tmp_path / "old" / "results.parquet")
    with pytest.raises(InputError, match="not a table of a sweep of this version"):
        read_results(tmp_path / "old")


def test_relative_sizes_are_in_units_of_omega_d_of_their_direction(tmp_path: Path) -> None:
    text = SMALL.replace("delta_v = [0.1, 0.5]", "relative = [0.5, 1.5]").replace("[0, 90]", "[0, 60, 90]")
    loaded, robot = suite(tmp_path, text), load_robot("utmu2")
    episodes = planned(tmp_path, text)
    assert len(episodes) == 12
    for episode in episodes:
        (push,) = scenario_of(loaded, episode).pushes
        angle = np.radians(episode.parameters["direction"])
        # Of the direction that was asked for, before the replica turned it.
        unit = np.array([np.cos(angle), np.sin(angle)])
        size = episode.parameters["relative"] * robot.omega * edge_distance(robot, unit)
        assert push.delta_v == pytest.approx(size, abs=1e-6)  # it is written with six digits
    sizes = {e.parameters["direction"]: scenario_of(loaded, e).pushes[0].delta_v for e in episodes}
    assert len(set(sizes.values())) == 3


def test_rows_of_relative_sizes_have_them_in_every_unit(tmp_path: Path) -> None:
    text = SMALL.replace("delta_v = [0.1, 0.5]", "relative = [0.5]").replace("replicas = 2", "replicas = 1")
    loaded = suite(tmp_path, text)
    (first, *_) = planned(tmp_path, text)
    row = run_job(Job(episode=first, scenario=scenario_of(loaded, first)))
    assert row["delta_v_over_omega_d"] == pytest.approx(0.5, rel=1e-5)  # six digits of some 0.1 m/s
    assert row["outcome"] == "recovered"


def test_relative_sizes_grow_in_a_series(tmp_path: Path) -> None:
    text = SMALL.replace("delta_v = [0.1, 0.5]", "relative = [0.9, 0.5]") + "[adaptive]\nstop_after = 2\n"
    series = plan(suite(tmp_path, text))
    assert len(series) == 4
    assert all([e.parameters["relative"] for e in one.episodes] == [0.5, 0.9] for one in series)
