"""A controller that is a file of the user's, through every command; its page shows that file."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from scenarios.catalogue import load
from sim.cli.app import main
from sim.episode.episode import run_episode
from sim.record.outcome import Result
from sim.results.table import read_results

HOUSE = Path(__file__).resolve().parents[3]
EXAMPLE = HOUSE / "scenarios" / "examples" / "capture_point.py"
NAME = "capture_point.py:CapturePoint"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of the user's, with the example in it."""
    for path in (EXAMPLE, EXAMPLE.with_suffix(".toml")):
        shutil.copy(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_its_page_shows_the_file() -> None:
    blocks = re.findall(
        r"```python\n(.*?)```", (HOUSE / "docs" / "controllers.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert EXAMPLE.read_text(encoding="utf-8") in blocks
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) <= 27


def test_it_runs_by_its_path_and_its_scenario_runs_again(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "quiet", "--controller", NAME, "--world", "pendulum", "--out", "out", "--no-video"]) == 0
    assert NAME in capsys.readouterr().out
    first = json.loads((here / "out" / "outcome.json").read_text())
    assert (first["controller"], first["outcome"]) == (NAME, "recovered")
    assert main(["run", "out/scenario.toml", "--out", "again", "--no-video"]) == 0


def test_its_options_count(here: Path) -> None:
    push = [{"start": 0.5, "direction": 0.0, "delta_v": 0.15}]
    given = {"world": "pendulum", "duration": 8.0, "pushes": push}
    name = str(here / NAME)
    firm = run_episode(load("quiet", given | {"controller": name}), polygons=False)
    wide = run_episode(load("quiet", given | {"controller": {"name": name, "margin": 0.04}}), polygons=False)
    assert firm.outcome.result is Result.RECOVERED
    assert wide.outcome.result is Result.FELL


def test_it_is_swept_checked_reported_and_replayed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "capture_point.toml", "--world", "pendulum", "--out", "sweep", "--workers", "2"]) == 0
    rows = read_results(here / "sweep").to_pylist()
    own = [row for row in rows if row["controller"] == NAME]
    assert len(own) == len(rows) / 3
    assert json.loads(own[0]["versions"])[NAME]
    assert main(["baseline", "sweep", "--out", "base.json"]) == 0
    assert main(["check", "sweep", "--baseline", "base.json"]) == 0
    assert main(["report", "sweep", "--baseline", "base.json", "--failures", "0"]) == 0
    page = (here / "sweep" / "report.html").read_text(encoding="utf-8")
    assert "capture point" in page
    assert "supervisor" in page
    capsys.readouterr()
    assert main(["replay", "sweep", own[0]["episode"]]) == 0
    assert "bit-identical" in capsys.readouterr().out

    # The same name, another file: results of the two must not be mixed, and a replay says why it differs.
    (here / "capture_point.py").write_text(
        EXAMPLE.read_text(encoding="utf-8").replace("k: float = 1.5", "k: float = 2.5")
    )
    assert main(["sweep", "capture_point.toml", "--world", "pendulum", "--out", "sweep"]) == 2
    assert "its file was then, and it has changed since" in capsys.readouterr().err
    assert main(["replay", "sweep", own[0]["episode"]]) == 1
    assert f"{NAME} " in capsys.readouterr().out
    (here / "capture_point.py").unlink()
    assert main(["replay", "sweep", own[0]["episode"]]) == 2
    assert "there is no file" in capsys.readouterr().err


BAD = {
    "None": ("return None", "command is None; it must be a BalanceCommand"),
    "NaN": ("return BalanceCommand(zmp=seen.cog[:2] * float('nan'), feet=feet)", "zmp [nan, nan] is not finite"),
    "shape": (
        "return BalanceCommand(zmp=seen.cog, feet=feet)",
        "zmp has shape (3,); it must be an array of shape (2,)",
    ),
    "no feet": ("return BalanceCommand(zmp=seen.cog[:2], feet={})", "feet are []; they must be a FootReference each"),
    "raises": ("raise KeyError('left')", "command() raised KeyError: 'left'"),
}


@pytest.mark.parametrize("answer", BAD)
def test_a_bad_answer_is_one_line_with_controller_tick_and_field(
    answer: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, words = BAD[answer]
    lines = [
        "from controllers import BalanceCommand, FootReference",
        "class Mine:",
        "    def __init__(self, setting, options): pass",
        "    def command(self, seen):",
        "        feet = {side: FootReference.standing(foot, foot.yaw) for side, foot in seen.feet.items()}",
        "        if seen.time < 0.01: return BalanceCommand(zmp=seen.cog[:2], feet=feet)",
        f"        {code}",
    ]
    (here / "mine.py").write_text("\n".join(lines))
    for world in ("humanoid", "pendulum"):
        command = ["run", "quiet", "--world", world, "--controller", "mine.py:Mine", "--no-video", "--out", "bad"]
        assert main(command) == 2
        told = capsys.readouterr().err
        assert told.count("\n") == 1
        assert f"controller 'mine.py:Mine': tick 5: {words}" in told
        assert not (here / "bad").exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("suppervisor", "did you mean 'supervisor'?"),
        ("mine.py:Nobody", "has no class 'Nobody'"),
        ("nowhere.py:Mine", "there is no file"),
        ("broken.py:Mine", "line 2: ZeroDivisionError"),
        ("mine.py:NoController", "has no method command()"),
        ("mine.py:Loose", "Options must be a subclass of"),
    ],
)
def test_a_name_that_is_none_is_refused(name: str, words: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "broken.py").write_text("\n1 / 0\n")
    (here / "mine.py").write_text(
        "class NoController: pass\nclass Loose:\n    Options = dict\n    def command(self, seen): pass\n"
    )
    assert main(["run", "quiet", "--controller", name, "--no-video"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("okiagari: --controller: ")
    assert words in told
    assert told.count("\n") == 1
