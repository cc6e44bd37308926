"""A run's folder is complete or absent, and never takes the place of what is not a run."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from models.errors import InputError
from scenarios.catalogue import load
from sim.episode.episode import EpisodeResult, run_episode
from sim.episode.run_folder import DECISIONS, FILES, OUTCOME, SCENARIO, TRACE, free_folder, staged, write_records
from sim.record.outcome import judge
from sim.record.trace import load_trace


@pytest.fixture(scope="module")
def result() -> EpisodeResult:
    scenario = load("push_left", {"world": "pendulum", "seed": 4})
    return run_episode(scenario, polygons=False)


def test_records_hold_the_run(result: EpisodeResult, tmp_path: Path) -> None:
    write_records(tmp_path, result)
    assert load(tmp_path / SCENARIO) == result.scenario
    trace = load_trace(tmp_path / TRACE)
    assert trace.values.tobytes() == result.trace.values.tobytes()
    assert judge(trace) == result.outcome
    decisions = json.loads((tmp_path / DECISIONS).read_text())
    assert [decision["time"] for decision in decisions] == [decision["time"] for decision in result.decisions]


def test_outcome_holds_what_is_promised(result: EpisodeResult, tmp_path: Path) -> None:
    write_records(tmp_path, result)
    outcome = json.loads((tmp_path / OUTCOME).read_text())
    promised = {"outcome", "reason", "time_of_fall", "steps_taken", "robot", "mass", "omega", "seed", "versions"}
    assert promised | {"real_time_factor", "pushes", "commit"} <= set(outcome)
    assert (outcome["outcome"], outcome["robot"], outcome["seed"]) == ("recovered", "utmu2", 4)
    assert {"python", "okiagari", "mujoco", "dm_control", "placo", "numpy", "scipy"} == set(outcome["versions"])
    (push,) = outcome["pushes"]
    promised = {"start", "direction_deg", "asked_impulse", "delivered_impulse", "delta_v", "cog_velocity_after"}
    assert promised | {"in_regulator_set", "in_tracking_set", "chosen"} <= set(push)
    # The issue's own bound on the delivered impulse.
    assert push["delivered_impulse"] == pytest.approx(push["asked_impulse"], abs=1e-9)


def test_what_is_not_finite_is_null_in_json(result: EpisodeResult, tmp_path: Path) -> None:
    write_records(tmp_path, result)

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    for name in (OUTCOME, DECISIONS):
        json.loads((tmp_path / name).read_text(), parse_constant=refuse)


def test_folder_appears_when_it_is_complete(tmp_path: Path) -> None:
    target = tmp_path / "new" / "run"
    with staged(target) as stage:
        (stage / SCENARIO).write_text("x")
        assert not target.exists()
    assert (target / SCENARIO).read_text() == "x"
    assert os.listdir(target.parent) == ["run"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_nothing_stays_of_a_run_that_fails(failure: type[BaseException], tmp_path: Path) -> None:
    def fail() -> None:
        with staged(tmp_path / "run") as stage:
            (stage / SCENARIO).write_text("half of it")
            raise failure

    with pytest.raises(failure):
        fail()
    assert os.listdir(tmp_path) == []


def test_failure_leaves_the_former_run(tmp_path: Path) -> None:
    def fail() -> None:
        with staged(tmp_path / "run", overwrite=True) as stage:
            (stage / SCENARIO).write_text("half of it")
            raise RuntimeError

    with staged(tmp_path / "run") as stage:
        (stage / SCENARIO).write_text("former")
    with pytest.raises(RuntimeError):
        fail()
    assert (tmp_path / "run" / SCENARIO).read_text() == "former"
    assert os.listdir(tmp_path) == ["run"]


def test_former_run_is_replaced_as_a_whole_and_only_if_asked(tmp_path: Path) -> None:
    target = tmp_path / "run"
    with staged(target) as stage:
        for name in FILES:
            (stage / name).write_text("former")
    with pytest.raises(InputError, match=r"holds a run already; .* pass --overwrite"), staged(target):
        pass
    with staged(target, overwrite=True) as stage:
        (stage / SCENARIO).write_text("new")
    assert os.listdir(target) == [SCENARIO]
    assert os.listdir(tmp_path) == ["run"]


def test_empty_folder_is_taken(tmp_path: Path) -> None:
    with staged(tmp_path) as stage:
        (stage / SCENARIO).write_text("x")
    assert os.listdir(tmp_path) == [SCENARIO]


@pytest.mark.parametrize("overwrite", [False, True])
def test_folder_with_anything_else_is_never_touched(overwrite: bool, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    (tmp_path / SCENARIO).write_text("x")
    with (
        pytest.raises(InputError, match=r"holds 'thesis\.tex', which no run writes"),
        staged(tmp_path, overwrite=overwrite),
    ):
        pass
    assert (tmp_path / "thesis.tex").read_text() == "precious"


def test_file_cannot_be_the_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"), staged(tmp_path / "file"):
        pass
    with pytest.raises(InputError, match="cannot be made"), staged(tmp_path / "file" / "run"):
        pass


def test_free_folder_counts_on(tmp_path: Path) -> None:
    assert free_folder("run", tmp_path) == tmp_path / "run"
    (tmp_path / "run").mkdir()
    (tmp_path / "run-2").mkdir()
    assert free_folder("run", tmp_path) == tmp_path / "run-3"
