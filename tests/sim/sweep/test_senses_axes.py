"""Suites that cross senses and bodies: the same pushes, named apart, and rows as before where nothing is said."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from models.errors import InputError
from scenarios.suite_catalogue import LoadedSuite
from sim.results.columns import COLUMNS, LATER, SCHEMA
from sim.results.table import read_file, write_table
from sim.sweep.plan import PlannedEpisode, plan, scenario_of
from sim.sweep.worker import Job, run_job
from tests.sim.analysis.sweep_tables import row
from tests.sim.program import call
from tests.sim.sweep.sweep_suites import HUMANOID, suite

SHORT = HUMANOID.replace('["supervisor", "statue"]', '["supervisor"]').replace("after = 1.0", "after = 0.1")
CROSSED = SHORT + 'sensing = ["exact", "typical"]\nlatency = [0.0, 0.003]\nbody_error = [0.0, 1.0]\n'


def planned(loaded: LoadedSuite) -> list[PlannedEpisode]:
    return [episode for series in plan(loaded) for episode in series.episodes]


def test_senses_and_bodies_meet_the_same_pushes(tmp_path: Path) -> None:
    loaded = suite(tmp_path, CROSSED)
    found = planned(loaded)
    assert len({episode.name for episode in found}) == 8
    scenarios = [scenario_of(loaded, episode) for episode in found]
    told = {(one.sensing.preset, one.sensing.latency, one.body.scale) for one in scenarios}
    assert len(told) == 8
    for latency in (0.0, 0.003):
        alike = [one for one in scenarios if one.sensing.latency == latency]
        assert len({(one.seed, one.pushes) for one in alike}) == 1
    # Who crosses nothing has the episode that there has always been.
    plain = suite(tmp_path, SHORT)
    assert {(one.name, one.seed) for one in planned(plain)} < {(one.name, one.seed) for one in found}


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, object]]:
    loaded = suite(tmp_path_factory.mktemp("senses"), CROSSED)
    jobs = [Job(episode=one, scenario=scenario_of(loaded, one)) for one in planned(loaded)]
    # The last is the first with a latency once more, by an estimator that has seen others meanwhile.
    return [run_job(job) for job in [*jobs, jobs[-1]]]


def test_rows_tell_senses_and_body_and_how_far_off_they_saw(rows: list[dict[str, object]]) -> None:
    for one in rows:
        assert one.keys() == COLUMNS.keys()
        seen_late = one["sensing"] == "typical" or one["latency"] != 0.0
        assert (one["dcm_error_rms"] is not None) == seen_late
    assert len({one["trace_hash"] for one in rows}) == 8


def test_an_estimator_that_is_used_again_gives_the_same_bits(rows: list[dict[str, object]]) -> None:
    assert rows[-1]["sensing"] == "typical"
    assert rows[-1]["trace_hash"] == rows[-2]["trace_hash"]


def test_tables_of_before_are_read(tmp_path: Path) -> None:
    table = pa.Table.from_pylist([row(lambda _: True)], schema=SCHEMA)
    former = table.drop_columns([name for name in LATER if name != "variant"])
    names = ["delay" if name == "latency" else name for name in former.schema.names]
    path = tmp_path / "rows.parquet"
    write_table(former.rename_columns(names), path)
    assert "delay" in pq.read_schema(path).names
    assert read_file(path).to_pylist() == table.to_pylist()


def test_more_latency_than_the_estimator_makes_up_for_is_refused_before_any_episode(tmp_path: Path) -> None:
    (tmp_path / "late.toml").write_text(SHORT + 'sensing = ["typical"]\nlatency = [0.004, 0.2]\n')
    with pytest.raises(InputError, match=r"late\.toml.*sensing\.latency: 0\.2 s is more than the 0\.1 s that 'ekf'"):
        call("sweep", tmp_path / "late.toml", "--out", tmp_path / "out", "--workers", "1")
    assert not (tmp_path / "out").exists()
