"""`make bench` is run by hand: that its tables can still be made is seen here, at the smallest size."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import pytest

from controllers.whole_body.inverse_dynamics import DynamicsOptions, DynamicsWholeBody
from models.robot import load_robot
from tests.benchmarks import layers, loop
from tests.benchmarks.__main__ import LONG, NAMES, WITHIN
from tests.controllers.recorded_layer import recorded


@pytest.mark.parametrize("name", NAMES + LONG)
def test_a_benchmark_can_be_run_by_name(name: str) -> None:
    module, function = WITHIN.get(name, (name, "main"))
    assert callable(getattr(importlib.import_module(f"tests.benchmarks.{module}"), function))


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop of one short episode a layer."""
    monkeypatch.setattr(loop, "REPEATS", 1)
    monkeypatch.setattr(loop, "SENSES", loop.SENSES[:1])
    monkeypatch.setattr(loop, "EPISODES", [(name, given | {"duration": 1.5}) for name, given in loop.EPISODES[:1]])


@pytest.mark.usefixtures("short")
def test_a_ratio_that_has_grown_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(loop, "KEPT", tmp_path / "loop.json")
    loop.keep()
    kept = json.loads(loop.KEPT.read_text(encoding="utf-8"))
    (ratios,) = kept.values()
    assert set(ratios) == {"standing, dynamics, exact", "standing, ik, exact"}
    ratios["standing, ik, exact"] = 0.1
    ratios["standing, dynamics, exact"] = 1000.0
    loop.KEPT.write_text(json.dumps(kept), encoding="utf-8")
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        loop.check()
    assert ended.value.code == 1
    assert "the loop of 'standing, ik, exact' costs" in (told := capsys.readouterr().out)
    assert "dynamics" not in told


@pytest.mark.usefixtures("short")
def test_the_loop_has_its_table(capsys: pytest.CaptureFixture[str]) -> None:
    loop.main()
    told = capsys.readouterr().out
    for words in ("dynamics", "ik", "ratio", "real time"):
        assert words in told


def test_the_layers_have_their_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(layers, "REPEATS", 1)
    layers.main()
    told = capsys.readouterr().out
    for words in ("dynamics, solved by placo", "ik", "standing (500 ticks)", "a foot in the air"):
        assert words in told


def test_the_layers_are_timed_on_ticks_of_both_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    push = {"start": 0.2, "direction": 80.0, "delta_v": 0.5}
    _, ticks = recorded({"duration": 1.0, "seed": 1000, "pushes": [push]})
    assert len(ticks) == 500
    swinging = sum(not tick.stands for tick in ticks)
    assert 30 < swinging < 300
    monkeypatch.setattr(layers, "REPEATS", 1)
    robot = load_robot("utmu2")
    (cost,) = layers.costs([DynamicsWholeBody(robot, 0.002, DynamicsOptions())], ticks[:3])
    assert 0.0 < cost < 1.0
