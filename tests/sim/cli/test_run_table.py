"""The table of a run: what each push was, and what became of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.schema import Scenario
from sim.cli.run import direction_words, endings, impulse_words
from sim.episode.episode import run_episode
from tests.sim.program import call

LONG = {"start": 0.3, "duration": 1.0, "direction": 0.0, "delta_v": 0.02}
TWICE = (LONG, {"start": 0.5, "direction": 90.0, "delta_v": 0.02})
LATER = {"start": 2.0, "direction": 0.0, "delta_v": 0.02}


def test_pushes_that_overlap_share_an_ending() -> None:
    robot = load_robot("utmu2")
    found = []
    for pushes in (TWICE, (*TWICE, LATER), (*TWICE, LATER | {"start": 20.0})):
        fields = {"description": "at once", "world": "pendulum", "duration": 30.0, "pushes": pushes}
        found.append(endings(run_episode(Scenario.model_validate(fields), robot=robot, polygons=False)))
    assert found[0] == ["recovered", "recovered"]
    assert found[1] == ["stood", "stood", "recovered"]
    assert found[2] == ["stood", "stood", "recovered"]


def test_machines_are_told_what_the_folder_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    asked = ("push_left", "--world", "pendulum", "--set", "duration=4", "--no-video", "--out", out, "--json")
    assert call("run", *asked) == 0
    told = json.loads(capsys.readouterr().out)
    assert told.pop("folder") == str(out)
    assert told == json.loads((out / "outcome.json").read_text())
    assert told["outcome"] in ("recovered", "not_settled")


def test_a_torque_is_named_as_such() -> None:
    robot = load_robot("utmu2")
    pushes = [{"start": 0.1, "torque": [0.0, -3.0, 0.0]}, {"start": 0.15, "direction": 30.0, "impulse": 0.2}]
    fields = {"description": "x", "controller": "statue", "duration": 0.4, "pushes": pushes}
    result = run_episode(Scenario.model_validate(fields), robot=robot, polygons=False)
    assert [direction_words(push) for push in result.scenario.pushes] == ["torque 3 N m about -y", "30°"]
    assert [impulse_words(push) for push in result.pushes] == ["0.30 N m s", "0.20 N s"]


def test_the_pendulum_refuses_a_torque_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        call("run", "push_and_twist", "--world", "pendulum", "--out", tmp_path / "run")
    line = str(caught.value)
    assert "pushes[0].torque: torque 1.5 N m about z on trunk: the pendulum is a point" in line
    assert "\n" not in line
    assert list(tmp_path.iterdir()) == []
