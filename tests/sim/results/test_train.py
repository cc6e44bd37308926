"""Trains and second pushes from suite to row: who survived what, and which push a row is about."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from models.robot import load_robot
from scenarios.catalogue import load
from sim.analysis.frame import each_push, load_rows, records, score
from sim.episode.episode import run_episode
from sim.results.table import read_results
from sim.results.train import train_columns
from sim.sweep.replay import replay
from sim.sweep.sweep import run_sweep
from sim.sweep.worker import happened
from tests.sim.sweep.sweep_suites import HERE, SECOND, TRAIN, suite

INTERVAL = 1.5


def swept(folder: Path, text: str) -> Path:
    run_sweep(suite(folder, text), folder / "out", HERE)
    return folder / "out"


@pytest.fixture(scope="module")
def trains(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("trains"), TRAIN)


@pytest.fixture(scope="module")
def seconds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("seconds"), SECOND)


def rows(folder: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read_results(folder).to_pylist()
    return found


def test_survived_are_those_that_it_stood_through_until_the_next(trains: Path) -> None:
    found = rows(trains)
    assert len(found) == 6
    fell = [row for row in found if row["outcome"] == "fell"]
    assert {row["controller"] for row in fell} >= {"regulator", "statue"}
    for row in fell:
        # The pushes begin at 0.2 s, 1.7 s ...; the n-th is survived if the fall is not before the start of the next.
        begun = int((row["time_of_fall"] - 0.2) / INTERVAL)
        assert row["pushes_survived"] == begun
    for row in found:
        assert row["train"] == 9
        assert row["push_start"] == 0.2
        assert [row[name] for name in ("direction_deg", "delta_v", "impulse", "d_edge", "mid_step")] == [None] * 5


def test_train_is_scored_by_its_pushes_and_else_by_its_end(trains: Path, seconds: Path) -> None:
    assert score(load_rows(trains)).tolist() == [row["pushes_survived"] for row in rows(trains)]
    assert score(load_rows(seconds)).tolist() == [int(row["outcome"] == "recovered") for row in rows(seconds)]


def test_survived_impulse_is_that_of_the_survived_pushes(trains: Path) -> None:
    for row in rows(trains):
        pushes = json.loads(row["pushes"])
        asked = [push["impulse"] for push in pushes if push["survived"]]
        assert len(asked) == row["pushes_survived"] < len(pushes)
        # Delivered is summed over physics steps.
        assert row["total_impulse"] == pytest.approx(sum(asked), rel=1e-9)
        assert row["total_impulse"] < row["delivered_impulse"]


def test_each_push_is_a_row_of_its_own(trains: Path) -> None:
    found = rows(trains)
    pushes = records(each_push(load_rows(trains, all_columns=True)))
    assert len(pushes) == sum(row["pushes_survived"] + 1 for row in found)
    for row in found:
        own = [push for push in pushes if push["episode"] == row["episode"]]
        assert [push["push_start"] for push in own] == pytest.approx([0.2 + INTERVAL * i for i in range(len(own))])
        sizes = [0.5 + 0.4 * i for i in range(len(own))]
        assert [push["delta_v_over_omega_d"] for push in own] == pytest.approx(sizes, rel=1e-5)  # six digits
        assert [push["outcome"] for push in own] == ["recovered"] * (len(own) - 1) + ["fell"]
        assert own[0].keys() == row.keys()
    regulated = [push for push in pushes if push["controller"] == "regulator"]
    assert {push["in_regulator_set_end"] for push in regulated} == {True, False}
    assert all(push["delta_v_over_omega_d"] > 0.5 for push in regulated if push["outcome"] == "fell")
    # The sets of the pendulum predict the pendulum.
    safe = [push for push in pushes if push["controller"] == "regulator" and push["in_regulator_set_end"]]
    assert {push["outcome"] for push in safe} == {"recovered"}


def test_other_rows_are_left_as_they_are(seconds: Path) -> None:
    found = load_rows(seconds)
    assert each_push(found).equals(found)


def weak_train(**fields: Any) -> Any:
    pushes = [{"start": 0.1 + 0.4 * i, "direction": 90.0 * i, "delta_v": 0.02} for i in range(3)]
    return run_episode(load("quiet", {"world": "pendulum", "duration": 3.0, "pushes": pushes} | fields), polygons=False)


def test_whoever_never_falls_survived_them_all() -> None:
    found = train_columns(weak_train())
    assert found["pushes_survived"] == 3
    assert found["total_impulse"] == found["delivered_impulse"] == pytest.approx(3 * 0.02 * load_robot("utmu2").mass)


def test_rest_between_the_pushes_does_not_end_a_train() -> None:
    pushes = [{"start": 0.1 + 2.5 * i, "direction": 0.0, "delta_v": 0.02} for i in range(2)]
    result = weak_train(pushes=pushes, duration=8.0)
    # It rests for a second long before the second push, and ends a second after it.
    assert 2.7 + 1.0 <= result.trace.time[-1] < 6.0
    assert all(push.reached for push in result.pushes)


def test_fall_in_the_pause_is_the_push_s_before_it() -> None:
    hard = [{"start": 0.1, "direction": 0.0, "delta_v": 0.02}, {"start": 0.5, "direction": 0.0, "delta_v": 2.0}]
    hard += [{"start": 6.0, "direction": 0.0, "delta_v": 0.02}]
    result = weak_train(pushes=hard, duration=9.0, controller="regulator")
    found = train_columns(result)
    assert found["pushes_survived"] == 1
    assert [push["survived"] for push in json.loads(found["pushes"])] == [True, False]
    assert found["total_impulse"] == result.pushes[0].delivered_impulse


def test_second_push_is_the_one_that_its_row_is_about(seconds: Path) -> None:
    for row in rows(seconds):
        scenario = json.loads(row["scenario"])
        first, asked = scenario["pushes"]
        assert row["delta_v"] == asked["delta_v"]
        assert row["direction_deg"] == 0.0
        assert row["push_direction_deg"] == pytest.approx(asked["direction"])
        assert row["push_start"] == asked["start"] == pytest.approx(first["start"] + 0.2)
        assert row["first_direction_deg"] == pytest.approx(first["direction"])
        assert row["first_delta_v"] == first["delta_v"]
        assert row["train"] is None
        assert row["pushes_survived"] is None


def test_prediction_is_of_the_second_push(seconds: Path) -> None:
    stepping = [row for row in rows(seconds) if row["controller"] == "supervisor"]
    assert any(row["mid_step"] for row in stepping)
    for row in stepping:
        scenario = json.loads(row["scenario"])
        result = run_episode(load("quiet", scenario), polygons=False)
        second = result.pushes[1]
        assert row["tracking_slack_end"] == second.tracking_slack != result.pushes[0].tracking_slack
        assert row["in_tracking_set_end"] == second.in_tracking_set
        assert row["delivered_impulse"] == second.delivered_impulse
        assert happened(result, train=False)["trace_hash"] == row["trace_hash"]


def test_who_cannot_step_falls_by_the_first(seconds: Path) -> None:
    still = [row for row in rows(seconds) if row["controller"] == "statue"]
    assert {row["outcome"] for row in still} == {"fell"}
    assert not any(row["mid_step"] for row in still)


@pytest.mark.parametrize("kind", ["trains", "seconds"])
def test_every_bit_comes_back(kind: str, request: pytest.FixtureRequest) -> None:
    folder = request.getfixturevalue(kind)
    row = rows(folder)[0]
    assert replay(folder, row["episode"]).identical
