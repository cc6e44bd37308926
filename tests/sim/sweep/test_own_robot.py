"""Sweeps of a robot of the user's own: named by its model, known by the hash of its file, wherever that lies."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from models.robot import MODELS
from sim.cli.app import main
from sim.results.table import read_results, read_sweep

SUITE = """description = "a body of my own"
scenario = { robot = "bodies/mine.xml" }
after = 1.0
[axes]
world = ["pendulum"]
controller = ["regulator"]
direction = [0.0]
delta_v = [0.05, 0.1]
start = [0.2]
"""


def folder_of(where: Path) -> Path:
    """A folder with a suite and its robot."""
    (where / "bodies").mkdir(parents=True)
    text = (MODELS / "utmu2.xml").read_text(encoding="utf-8")
    (where / "bodies" / "mine.xml").write_text(text.replace('model="utmu2"', 'model="mine"'), encoding="utf-8")
    (where / "suite.toml").write_text(SUITE, encoding="utf-8")
    return where


def test_a_sweep_does_not_go_on_after_its_robot_was_edited_and_replay_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    here = folder_of(tmp_path / "here")
    sweep = ["sweep", str(here / "suite.toml"), "--out", str(here / "out"), "--workers", "1"]
    assert main(sweep) == 0
    rows = read_results(here / "out").to_pylist()
    assert {row["robot"] for row in rows} == {"mine"}
    assert list(read_sweep(here / "out")["robots"]) == ["mine"]
    assert main(["baseline", str(here / "out"), "--out", str(tmp_path / "base.json")]) == 0
    assert str(tmp_path) not in (tmp_path / "base.json").read_text()
    capsys.readouterr()

    # The same suite and robot in another folder is compared with it.
    there = folder_of(tmp_path / "there")
    assert main(["sweep", str(there / "suite.toml"), "--out", str(there / "out"), "--workers", "1"]) == 0
    assert main(["check", str(there / "out"), "--baseline", str(tmp_path / "base.json")]) == 0
    assert "0 lost, 0 gained" in capsys.readouterr().out

    body = here / "bodies" / "mine.xml"
    body.write_text(body.read_text(encoding="utf-8") + "<!-- edited -->\n", encoding="utf-8")
    assert main(sweep) == 2
    assert "'mine' as its file was then, and it has changed since" in capsys.readouterr().err


def test_two_robots_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    here = folder_of(tmp_path / "here")
    shutil.copy(here / "bodies" / "mine.xml", here / "mine.xml")
    text = SUITE.replace('world = ["pendulum"]', 'world = ["pendulum"]\nrobot = ["bodies/mine.xml", "mine.xml"]')
    (here / "suite.toml").write_text(text, encoding="utf-8")
    assert main(["sweep", str(here / "suite.toml"), "--out", str(here / "out")]) == 2
    assert "two are called 'mine'" in capsys.readouterr().err
