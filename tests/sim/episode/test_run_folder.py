"""A run's folder is complete or absent, and never takes the place of what is not a run."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest

from models.errors import InputError
from scenarios.catalogue import load
from sim.episode.episode import EpisodeResult, run_episode
from sim.episode.push_record import _member
from sim.episode.run_folder import (
    DECISIONS,
    FILES,
    LOCK,
    OUTCOME,
    SCENARIO,
    TRACE,
    TargetTakenError,
    claimed,
    claimed_free,
    write_records,
)
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
    assert {"python", "okiagari", "mujoco", "dm_control", "placo", "numpy", "scipy", "numba", "daqp"} == set(
        outcome["versions"]
    )
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
    with claimed(target) as stage:
        (stage / SCENARIO).write_text("x")
        assert not target.exists()
    assert (target / SCENARIO).read_text() == "x"
    assert os.listdir(target.parent) == ["run"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_nothing_stays_of_a_run_that_fails(failure: type[BaseException], tmp_path: Path) -> None:
    def fail() -> None:
        with claimed(tmp_path / "run") as stage:
            (stage / SCENARIO).write_text("half of it")
            raise failure

    with pytest.raises(failure):
        fail()
    assert os.listdir(tmp_path) == []


def test_failure_leaves_the_former_run(tmp_path: Path) -> None:
    def fail() -> None:
        with claimed(tmp_path / "run", overwrite=True) as stage:
            (stage / SCENARIO).write_text("half of it")
            raise RuntimeError

    with claimed(tmp_path / "run") as stage:
        (stage / SCENARIO).write_text("former")
    with pytest.raises(RuntimeError):
        fail()
    assert (tmp_path / "run" / SCENARIO).read_text() == "former"
    assert os.listdir(tmp_path) == ["run"]


def test_former_run_is_replaced_as_a_whole_and_only_if_asked(tmp_path: Path) -> None:
    target = tmp_path / "run"
    with claimed(target) as stage:
        for name in FILES:
            (stage / name).write_text("former")
    with pytest.raises(InputError, match=r"holds a run already; .* pass --overwrite"), claimed(target):
        pass
    with claimed(target, overwrite=True) as stage:
        (stage / SCENARIO).write_text("new")
    assert os.listdir(target) == [SCENARIO]
    assert os.listdir(tmp_path) == ["run"]


def test_empty_folder_is_taken(tmp_path: Path) -> None:
    with claimed(tmp_path) as stage:
        (stage / SCENARIO).write_text("x")
    assert os.listdir(tmp_path) == [SCENARIO]


@pytest.mark.parametrize("overwrite", [False, True])
def test_folder_with_anything_else_is_never_touched(overwrite: bool, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    (tmp_path / SCENARIO).write_text("x")
    with (
        pytest.raises(InputError, match=r"holds 'thesis\.tex', which no run writes"),
        claimed(tmp_path, overwrite=overwrite),
    ):
        pass
    assert (tmp_path / "thesis.tex").read_text() == "precious"


def test_file_cannot_be_the_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"), claimed(tmp_path / "file"):
        pass
    with pytest.raises(InputError, match="cannot be made"), claimed(tmp_path / "file" / "run"):
        pass


def test_the_first_name_that_nobody_has_is_claimed(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / SCENARIO).write_text("mine")
    (tmp_path / "run-2").write_text("a file")
    (tmp_path / "run-3").symlink_to("nowhere")
    with claimed_free("run", tmp_path) as (first, stage), claimed_free("run", tmp_path) as (second, _):
        assert (first, second) == (tmp_path / "run-4", tmp_path / "run-5")
        (stage / SCENARIO).write_text("x")
    assert (tmp_path / "run" / SCENARIO).read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == [f"run{n}" for n in ("", "-2", "-3", "-4", "-5")]


def test_a_target_is_claimed_from_the_beginning(tmp_path: Path) -> None:
    with claimed(tmp_path / "run") as stage:
        with pytest.raises(TargetTakenError, match="is being written by another run"), claimed(tmp_path / "run"):
            pass
        (stage / SCENARIO).write_text("first")
    assert (tmp_path / "run" / SCENARIO).read_text() == "first"
    assert os.listdir(tmp_path) == ["run"]


def test_what_a_killed_run_left_is_in_nobody_s_way(tmp_path: Path) -> None:
    with claimed(tmp_path / "run") as stage:
        left = stage
    (tmp_path / "run").rmdir()
    left.mkdir()
    (left / SCENARIO).write_text("half")
    with claimed(tmp_path / "run") as stage:
        assert os.listdir(stage) == [LOCK]
    assert os.listdir(tmp_path / "run") == []


def test_a_symbolic_link_is_followed_and_one_to_nothing_refused(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to("elsewhere")
    with claimed(tmp_path / "link") as stage:
        (stage / SCENARIO).write_text("x")
    assert (tmp_path / "link").is_symlink()
    assert os.listdir(tmp_path / "elsewhere") == [SCENARIO]
    (tmp_path / "dangling").symlink_to("nowhere")
    with (
        pytest.raises(InputError, match="symbolic link to 'nowhere', which is not there"),
        claimed(tmp_path / "dangling"),
    ):
        pass
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError, match="--out"), claimed(tmp_path / "loop"):
        pass


@pytest.mark.parametrize("name", ["n" * 256, "n" * 300, "a/" * 3000 + "n", "/proc/x", "/proc/x/y"])
def test_a_place_that_cannot_be_is_refused_before_anything_is_written(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--out: "), claimed(tmp_path / name):
        raise AssertionError("nothing must run for it")
    assert os.listdir(tmp_path) == []


def test_the_longest_name_there_is_is_written(tmp_path: Path) -> None:
    with claimed(tmp_path / ("n" * 255)) as stage:
        (stage / SCENARIO).write_text("x")
    assert os.listdir(tmp_path) == ["n" * 255]


def test_the_folder_one_is_in_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in (".", "..", str(tmp_path)):
        with pytest.raises(InputError, match="the folder that you are in"), claimed(Path(name), overwrite=True):
            pass


def test_of_a_foot_in_the_air_standing_is_out_and_a_set_that_could_not_be_asked_is_null() -> None:
    assert [_member(slack, unasked=False) for slack in (0.0, -1e-9, math.nan, None)] == [True, False, False, None]
    assert [_member(slack, unasked=None) for slack in (0.0, -math.inf, math.nan, None)] == [True, False, None, None]
