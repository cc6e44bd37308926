"""The command line does what it says, and refuses in one line, with exit code 2 and nothing written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios.catalogue import shipped
from sim.cli.app import main
from sim.episode.run_folder import DECISIONS, FIGURE, OUTCOME, SCENARIO, TRACE, VIDEO
from sim.record.trace import load_trace
from sim.viz.video import missing_renderer

# The statue: working out the sets that the others' figures show would be most of the time.
SHORT = """\
description = "a small push, soon over"
world = "pendulum"
controller = "statue"
duration = 4.0
[[pushes]]
start = 0.5
direction = 0.0
delta_v = 0.05
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(SHORT)
    return tmp_path


def test_run_leaves_its_folder_and_says_so(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "short.toml", "--no-video"]) == 0
    folder = here / "out" / "short-pendulum"
    assert {path.name for path in folder.iterdir()} == {SCENARIO, TRACE, OUTCOME, DECISIONS, FIGURE}
    output = capsys.readouterr().out
    assert "0.05 m/s" in output
    assert "recovered: at rest" in output
    assert f"open out/short-pendulum/{FIGURE}" in output


def test_options_replace_what_the_scenario_says(here: Path) -> None:
    options = ["--controller", "regulator", "--whole-body", "ik", "--seed", "9", "--world", "pendulum"]
    assert main(["run", "short.toml", *options, "--out", "mine", "--no-video"]) == 0
    outcome = json.loads((here / "mine" / OUTCOME).read_text())
    changed = {"controller": "regulator", "whole_body": "ik", "seed": 9, "world": "pendulum"}
    assert {name: outcome[name] for name in changed} == changed


def test_scenario_as_run_gives_the_same_trace_again(here: Path) -> None:
    assert main(["run", "short.toml", "--seed", "5", "--out", "first", "--no-video"]) == 0
    assert main(["run", f"first/{SCENARIO}", "--out", "second", "--no-video"]) == 0
    first, second = (load_trace(here / name / TRACE) for name in ("first", "second"))
    assert first.values.tobytes() == second.values.tobytes()


def test_second_run_does_not_take_the_place_of_the_first(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):
        assert main(["run", "short.toml", "--no-video"]) == 0
    assert (here / "out" / "short-pendulum-2" / TRACE).exists()
    again = ["run", "short.toml", "--no-video", "--out", "out/short-pendulum"]
    assert main(again) == 2
    assert "pass --overwrite" in capsys.readouterr().err
    assert main([*again, "--overwrite"]) == 0


def test_run_films_and_render_films_again(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    why_not = missing_renderer()
    assert main(["run", "short.toml", "--out", "mine"]) == 0
    film = here / "mine" / VIDEO
    if why_not:  # a machine without EGL: everything else is there, and the remedy is named
        assert why_not in capsys.readouterr().err
        assert not film.exists()
        return
    size = film.stat().st_size
    capsys.readouterr()
    assert main(["render", "mine", "--size", "320x240", "--fps", "10", "--camera", "side"]) == 0
    assert capsys.readouterr().out.split() == [f"mine/{VIDEO}"]
    assert 0 < film.stat().st_size < size


def test_list_describes_every_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    output = capsys.readouterr().out
    assert all(name in output for name in shipped())


@pytest.mark.parametrize("command", [[], ["run"], ["render"], ["list"]])
def test_help_teaches(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*command, "--help"]) == 0
    assert "okiagari" in capsys.readouterr().out


REFUSED = {
    "misspelt scenario": (["run", "three_push"], ["'three_push'", "three_pushes", "quiet"]),
    "missing file": (["run", "none.toml"], ["none.toml"]),
    "misspelt robot": (["run", "robot.toml"], ["robot.toml: robot", "'utmu3'", "'utmu2'"]),
    "robot that is no robot": (["run", "body.toml"], ["body.xml"]),
    "robot that is no MJCF": (["run", "text.toml"], ["text.xml"]),
    "body that does not exist": (["run", "torso.toml"], ["torso.toml: pushes[0].body", "'torso'", "trunk"]),
    "step longer than the legs": (["run", "stride.toml"], ["stride.toml: stepping.max_stride", "0.5 m", "legs"]),
    "gain that is too strong": (["run", "gain.toml"], ["gain.toml: gain", "5000", "between 1 and"]),
    "negative seed": (["run", "short.toml", "--seed", "-1"], ["seed", "-1", ">= 0"]),
    "seed that is none": (["run", "short.toml", "--seed", "x"], ["--seed", "'x'", "whole number"]),
    "speed that is none": (["render", ".", "--slow", "much"], ["--slow", "'much'", "number"]),
    "unknown controller": (["run", "short.toml", "--controller", "brace"], ["--controller", "'brace'", "'statue'"]),
    "unknown option": (["run", "short.toml", "--controler", "statue"], ["--controler", "--controller"]),
    "unknown command": (["push"], ["'push'"]),
    "no scenario": (["run"], ["scenario"]),
    "occupied folder": (["run", "short.toml", "--out", "."], ["--out", "the folder that you are in"]),
    "file as folder": (["run", "short.toml", "--out", "short.toml"], ["--out", "is a file"]),
    "render nothing": (["render", "nowhere"], ["'nowhere'", "folder of a run"]),
    "render no run": (["render", "."], ["trace.parquet", "No such file"]),
    "render a damaged trace": (["render", "damaged"], ["damaged/trace.parquet", "not a readable trace"]),
    "size that is none": (["render", "damaged", "--size", "big"], ["--size", "'big'", "WxH"]),
}
FILES = {
    "robot.toml": 'robot = "utmu3"\n' + SHORT,
    "body.toml": 'robot = "body.xml"\n' + SHORT,
    "body.xml": "<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>",
    "text.toml": 'robot = "text.xml"\n' + SHORT,
    "text.xml": "a robot",
    "torso.toml": SHORT + 'body = "torso"\n',
    "stride.toml": SHORT + "[stepping]\nmax_stride = 0.5\n",
    "gain.toml": SHORT + "[gain]\nk = 5e3\n",
    "damaged/trace.parquet": "PAR1",
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_done_is_refused_in_one_line(what: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in FILES.items():
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).write_text(text)
    before = sorted(here.rglob("*"))
    arguments, words = REFUSED[what]
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("okiagari: ")
    assert captured.err.count("\n") == 1
    for word in words:
        assert word in captured.err
    assert sorted(here.rglob("*")) == before
