"""`okiagari adopt` as a stranger meets it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from sim.cli.app import main
from sim.viz.video import missing_renderer
from tests.models.adopt.biped_files import TEXT, put, with_text, write

HOUSE = Path(__file__).resolve().parents[3]


def test_it_is_adopted_tried_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["adopt", str(write(tmp_path / "in")), "--out", str(out)]) == 0
    told, wrong = capsys.readouterr()
    assert wrong == ""
    report = (out / "ADOPTED.md").read_text(encoding="utf-8")
    # Into a pipe goes the report as it is.
    assert told == f'{report}written to {out}; use it with  robot = "{out / "small.xml"}"\n'
    assert "It stands: " in report
    assert "after 5 s under the built-in supervisor, nobody pushing." in report
    files = {"small.xml", "ADOPTED.md"}
    if missing_renderer() is None:
        files.add("stand.png")
        assert Image.open(out / "stand.png").size == (640, 640)
    else:
        assert "No picture: " in report
    assert {each.name for each in out.iterdir()} == files
    scenario = tmp_path / "mine.toml"
    scenario.write_text(f'description = "x"\nworld = "humanoid"\nduration = 0.2\nrobot = "{out / "small.xml"}"\n')
    assert main(["run", str(scenario), "--out", str(tmp_path / "run"), "--no-video"]) == 0


def test_who_does_not_stand_is_told_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    weak = put(tmp_path / "in", TEXT, hints='[motors."*"]\ntorque = 0.2')
    assert main(["adopt", str(weak), "--out", str(out)]) == 0
    assert "It does not stand: " in capsys.readouterr().out
    assert (out / "small.xml").is_file()


def test_hints_may_lie_elsewhere(tmp_path: Path) -> None:
    hints = tmp_path / "mine.toml"
    hints.write_text('name = "other"')
    path = put(tmp_path / "in", TEXT, hints='name = "unused"')
    assert main(["adopt", str(path), "--out", str(tmp_path / "out"), "--hints", str(hints)]) == 0
    assert (tmp_path / "out" / "other.xml").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.xml"], "SOURCE: no file 'nowhere.xml'"),
        (["robot.urdf"], "'robot.urdf' is neither a path to an .xml file nor one of op3, t1, g1, bh, h1, apollo"),
        (["small.xml", "--hints", "gone.toml"], "gone.toml: cannot be read: No such file or directory"),
        (["small.xml", "--hints", "bad.toml"], "bad.toml: colour: Extra inputs are not permitted, not 3"),
        (["small.xml", "--out", "full"], "full: exists and is not an empty folder; choose another one"),
        (["looped.xml"], "looped.xml: has the equality constraint 'grip'"),
        ([], "Missing argument"),
    ],
)  # fmt: skip
def test_a_refusal_is_one_line_and_code_2(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(write(tmp_path).parent)
    grip = '<equality><weld name="grip" body1="left_arm" body2="right_arm"/></equality></mujoco>'
    (tmp_path / "looped.xml").write_text(with_text(("</mujoco>", grip)))
    (tmp_path / "bad.toml").write_text("colour = 3")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    before = sorted(tmp_path.rglob("*"))
    given = arguments if "--out" in arguments else [*arguments, "--out", "out"]
    assert main(["adopt", *given]) == 2
    told, wrong = capsys.readouterr()
    assert told == ""
    assert words in wrong
    assert wrong.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    path, deep = write(tmp_path / "in"), tmp_path / "deep"
    process = subprocess.Popen(
        [sys.executable, "-m", "sim", "adopt", str(path), "--out", str(deep / "out")],
        cwd=HOUSE,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 60
    while not list(tmp_path.glob("deep/.adopting-*/out/small.xml")) and time.monotonic() < end:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    told, wrong = process.communicate(timeout=60)
    assert (process.returncode, told, wrong) == (130, "", "okiagari: stopped; nothing was written\n")
    assert not deep.exists()
