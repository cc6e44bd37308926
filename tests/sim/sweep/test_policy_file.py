"""A policy's file belongs to the results: a sweep does not go on with another one, baseline and replay name it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from models.errors import InputError
from scenarios.suite_catalogue import load_suite
from sim.cli.app import main
from sim.episode.episode import run_episode
from sim.results.table import read_results, read_sweep
from sim.sweep.plan import plan, scenario_of
from tests.controllers.learned.tiny_network import TAKES, write_network

pytest.importorskip("onnxruntime", reason=TAKES)
pytest.importorskip("onnx", reason=TAKES)

COUNT = 20
SUITE = """description = "a policy"
after = 0.5
[scenario]
timing = { physics = 0.002 }
controller = { name = "onnx", policy = "nets/p.onnx", observation = ["command"] }
[axes]
direction = [0.0]
delta_v = [0.05]
start = [0.2]
"""
VARIANTS = """
[variants]
"as trained" = {}
other = { "controller.policy" = "nets/q.onnx" }
"""


def folder_of(where: Path, extra: str = "") -> Path:
    (where / "nets").mkdir(parents=True)
    (where / "suite.toml").write_text(SUITE + extra)
    write_network(where / "nets" / "p.onnx", np.zeros((COUNT, 3)))
    return where


def test_a_sweep_does_not_go_on_after_the_policy_was_trained_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    here = folder_of(tmp_path / "here")
    sweep = ["sweep", str(here / "suite.toml"), "--out", str(here / "out"), "--workers", "1"]
    assert main(sweep) == 0
    (source,) = read_sweep(here / "out")["files"].values()
    (row,) = read_results(here / "out").to_pylist()
    made = json.loads(row["versions"])
    assert made["p.onnx"] == source[:12]
    assert made["onnxruntime"] != "unknown"
    base = tmp_path / "base.json"
    assert main(["baseline", str(here / "out"), "--out", str(base)]) == 0
    assert json.loads(base.read_text())["versions"]["p.onnx"] == source[:12]
    assert str(tmp_path) not in base.read_text()
    assert main(["replay", str(here / "out"), row["episode"]]) == 0
    assert main(sweep) == 0
    capsys.readouterr()

    write_network(here / "nets" / "p.onnx", np.zeros((COUNT, 3)), 0.01)
    assert main(sweep) == 2
    told = capsys.readouterr().err
    assert "'p.onnx' as its file was then, and it has changed since; choose another folder" in told
    assert told.count("\n") == 1
    assert main(["replay", str(here / "out"), row["episode"]]) == 1
    assert f"p.onnx {source[:12]} then" in capsys.readouterr().out
    assert main([*sweep[:3], str(here / "new"), *sweep[4:]]) == 0
    assert main(["check", str(here / "new"), "--baseline", str(base)]) in (0, 1)
    assert f"p.onnx {source[:12]} then" in capsys.readouterr().out


def test_variants_may_name_policies_beside_the_suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = folder_of(tmp_path / "here", VARIANTS)
    write_network(here / "nets" / "q.onnx", np.zeros((COUNT, 3)), 0.01)
    monkeypatch.chdir(tmp_path)
    loaded = load_suite(here / "suite.toml")
    assert set(loaded.sources()) == {"p.onnx", "q.onnx"}
    scenarios = [scenario_of(loaded, one.episodes[0]) for one in plan(loaded)]
    assert [Path(each.controller.options["policy"]).name for each in scenarios] == ["p.onnx", "q.onnx"]
    files = [run_episode(each, polygons=False).trace.metadata["controller_files"]["policy"] for each in scenarios]
    assert files[0] != files[1]


def test_two_policies_of_one_name_are_refused(tmp_path: Path) -> None:
    here = folder_of(tmp_path / "here", VARIANTS.replace("nets/q.onnx", "p.onnx"))
    write_network(here / "p.onnx", np.zeros((COUNT, 3)), 0.01)
    with pytest.raises(InputError, match=r"controller: two files are called 'p.onnx'; rename one"):
        load_suite(here / "suite.toml").sources()


def test_a_policy_that_does_not_fit_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    here = folder_of(tmp_path / "here")
    write_network(here / "nets" / "p.onnx", np.zeros((COUNT, 4)))
    assert main(["sweep", str(here / "suite.toml"), "--out", str(here / "out")]) == 2
    told = capsys.readouterr().err
    assert "suite.toml: controller.observation: the terms are 3 numbers, and 'p.onnx' takes 4: command 3" in told
    assert told.count("\n") == 1
    assert not (here / "out").exists()
