"""What surprised people at the command line does not any more."""

from __future__ import annotations

import html
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from scenarios.suite_catalogue import shipped as shipped_suites
from sim.cli.app import main
from sim.record.trace import load_trace
from sim.results.table import read_results, read_sweep
from tests.sim.renderer import needs_renderer

SHORT = """\
description = "a [bold]small[/bold] push, soon over"
world = "pendulum"
controller = "regulator"
duration = 3.0
[[pushes]]
start = 0.5
vector = [0.0, 0.0, 1.0]
delta_v = 0.05
body = "cog"
"""
SUITE = """\
description = "two pushes"
after = 1.0
[axes]
world = ["pendulum"]
controller = ["regulator"]
direction = [0.0]
delta_v = [0.05, 0.1]
start = [0.2]
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(SHORT.replace("vector = [0.0, 0.0, 1.0]", "direction = 90.0"))
    (tmp_path / "suite.toml").write_text(SUITE)
    return tmp_path


def okiagari(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "sim", *arguments]


def in_house(here: Path, **environment: str) -> dict[str, str]:
    house = Path(__file__).resolve().parents[3]
    return os.environ | {"PYTHONPATH": str(house), "COLUMNS": "80"} | environment


def test_two_runs_at_once_by_default_make_two_folders(here: Path) -> None:
    runs = [
        subprocess.Popen(okiagari("run", "short.toml", "--no-video"), cwd=here, env=in_house(here)) for _ in range(2)
    ]
    assert [run.wait(60) for run in runs] == [0, 0]
    folders = sorted(path.name for path in (here / "out").iterdir())
    assert folders == ["short-pendulum", "short-pendulum-2"]
    assert all((here / "out" / name / "trace.parquet").exists() for name in folders)


def test_two_runs_into_one_folder_at_once_are_one_run_and_one_refusal(here: Path) -> None:
    command = okiagari("run", "short.toml", "--no-video", "--out", "mine")
    runs = [
        subprocess.Popen(command, cwd=here, env=in_house(here), stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    told = [run.communicate(timeout=60)[1] for run in runs]
    assert sorted(run.returncode for run in runs) == [0, 2]
    assert "--out: 'mine'" in "".join(told)
    assert sorted(path.name for path in here.iterdir()) == ["mine", "short.toml", "suite.toml"]


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_without_our_characters_gets_others(encoding: str, here: Path) -> None:
    for command in (["run", "short.toml", "--no-video"], ["list"], ["run", "short.toml", "--seed", "ä"]):
        done = subprocess.run(
            okiagari(*command),
            cwd=here,
            env=in_house(here, PYTHONIOENCODING=encoding),
            capture_output=True,
            check=False,
        )
        assert b"Traceback" not in done.stderr
        assert done.returncode == (2 if "ä" in command else 0)


def test_names_with_brackets_are_printed_as_they_are(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "[red]x[oops].toml").write_text(SHORT.replace("vector = [0.0, 0.0, 1.0]", "direction = 0.0"))
    assert main(["run", "[red]x[oops].toml", "--no-video", "--out", "[/b]"]) == 0
    told = capsys.readouterr().out
    assert "[red]x[" in told
    assert "[/b]/outcome.json" in told
    assert main(["sets", "short.toml"]) == 0
    assert "a [bold]small[/bold] push" in capsys.readouterr().out


def test_the_table_says_where_a_push_goes_and_what_it_acts_on(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "up.toml").write_text(SHORT.replace('"pendulum"', '"humanoid"').replace('"regulator"', '"statue"'))
    assert main(["run", "up.toml", "--no-video", "--controller", "statue"]) == 0
    told = capsys.readouterr().out
    assert " up " in told
    assert " cog " in told
    assert " 0.1 s " in told
    assert (here / "out" / "up-humanoid-statue").is_dir()
    assert main(["run", "short.toml", "--no-video"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if " cog " in line)
    assert " – " in row  # the regulator has no set of steps


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("stepping.max_step=2", "--set: stepping.max_step: unknown field; did you mean 'max_steps'?"),
        ("stepping.max_steps=0", "--set: stepping.max_steps: 0 is not allowed; it must be >= 1"),
        ("duration", "--set: 'duration' is not of the form field=value"),
        ("duration=2.0\nseed=3", "holds more than one field; give each a --set of its own"),
        ("controller=nobody", "--set: controller: 'nobody' is none of"),
    ],
)
def test_what_set_may_not_say_is_refused(assignment: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["run", "short.toml", "--no-video"], ["sweep", "suite.toml"]):
        assert main([*command, "--set", assignment]) == 2
        told = capsys.readouterr().err
        # A suite has a duration and controllers of its own.
        assert words in told or (command[0] == "sweep" and "the suite decides it" in told)
        assert told.count("\n") == 1


def test_set_changes_the_scenario_and_the_sweep(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "short.toml", "--set", "duration=2.5", "--set", "gain.k=1.7", "--out", "a", "--no-video"]) == 0
    scenario = load_trace(here / "a" / "trace.parquet").metadata["scenario"]
    assert (scenario["duration"], scenario["gain"]["k"]) == (2.5, 1.7)
    assert main(["sweep", "suite.toml", "--set", "gain.k=1.7", "--workers", "1"]) == 0
    folder = here / "out" / "sweep-suite-gain.k-1.7"
    assert '"k": 1.7' in read_results(folder)["scenario"][0].as_py()
    # ... and says how to run it again.
    assert main(["report", str(folder), "--failures", "0"]) == 0
    page = html.unescape((folder / "report.html").read_text(encoding="utf-8"))
    assert "okiagari sweep suite.toml --set gain.k=1.7 --out " in page
    assert main(["sweep", "suite.toml", "--set", "seed=3"]) == 2
    assert "the suite decides it" in capsys.readouterr().err


def test_the_folder_of_a_changed_sweep_has_a_name_that_can_be_typed(here: Path) -> None:
    gain = 'gain={kind = "poles", poles = [[-3.0, 1.0], [-3.0, -1.0]]}'
    assert main(["sweep", "suite.toml", "--set", gain, "--workers", "1"]) == 0
    (folder,) = (here / "out").iterdir()
    assert re.fullmatch(r"sweep-suite-gain-kind-poles-poles[-.\w]*", folder.name)
    assert len(folder.name) < 70


def test_what_goes_wrong_on_the_way_names_the_scenario_s_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "mine.py").write_text(CRASHES)
    assert main(["run", "short.toml", "--controller", "mine.py:Mine", "--no-video"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("okiagari: short.toml: controller 'mine.py:Mine': tick 0: command() raised KeyError")
    assert not (here / "out").exists()


def test_an_impulse_that_is_too_hard_for_the_robot_is_refused_wherever_it_stands(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "suite.toml").write_text(SUITE.replace("delta_v = [0.05, 0.1]", "impulse = [0.5, 1000.0]"))
    assert main(["sweep", "suite.toml", "--workers", "1"]) == 2
    assert "suite.toml: scenario: pushes[0].impulse: 1000.0 N s gives utmu2's" in capsys.readouterr().err
    assert not (here / "out").exists()


def test_a_sweep_by_other_controllers(here: Path) -> None:
    assert main(["sweep", "suite.toml", "--controller", "statue", "--controller", "paper", "--workers", "1"]) == 0
    folder = here / "out" / "sweep-suite-statue-paper"
    assert set(read_results(folder)["controller"].to_pylist()) == {"statue", "paper"}
    assert list(read_sweep(folder)["controllers"]) == ["statue", "paper"]


CRASHES = """\
class Mine:
    def __init__(self, setting, options): pass
    def command(self, seen): raise KeyError("left")
"""


def test_a_sweep_of_crashes_only_fails_and_says_how_to_look(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "mine.py").write_text(CRASHES)
    assert main(["sweep", "suite.toml", "--controller", "mine.py:Mine", "--workers", "1", "--out", "out"]) == 1
    assert "every episode crashed; `okiagari replay out ID` shows the traceback" in capsys.readouterr().err
    episode = read_results(here / "out")["episode"][0].as_py()
    assert main(["replay", "out", episode]) == 2
    assert "KeyError: 'left'" in "".join(capsys.readouterr())


def test_a_baseline_is_not_overwritten_in_silence(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "suite.toml", "--workers", "1", "--out", "out"]) == 0
    assert main(["baseline", "out", "--out", "base.json"]) == 0
    assert main(["baseline", "out", "--out", "base.json"]) == 2
    assert "is there already; name another file or pass --overwrite" in capsys.readouterr().err
    assert main(["baseline", "out", "--out", "base.json", "--overwrite"]) == 0


def test_seed_blames_no_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "short.toml", "--seed", "-1"]) == 2
    told = capsys.readouterr().err
    assert "--seed" in told
    assert ".toml" not in told


def test_version_and_suites_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("okiagari 0.")
    assert main(["sweep", "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert all(name in told for name in shipped_suites())


def test_ctrl_c_in_a_run_says_that_nothing_was_written(here: Path) -> None:
    (here / "long.toml").write_text(
        SHORT.replace("vector = [0.0, 0.0, 1.0]", "direction = 0.0").replace("3.0", "3000.0")
    )
    run = subprocess.Popen(
        ["env", "--default-signal=INT", *okiagari("run", "long.toml", "--no-video", "--set", "pushes=[]")],
        cwd=here, env=in_house(here), stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (here / "out").exists() and run.poll() is None:
        pass
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=30)[1].strip() == "okiagari: stopped; nothing was written"
    assert run.returncode == 130
    assert not (here / "out").exists()


def test_ctrl_c_in_figures_leaves_none(here: Path) -> None:
    run = subprocess.Popen(
        ["env", "--default-signal=INT", *okiagari("figures", "--out", "pictures")],
        cwd=here, env=in_house(here), stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (here / "pictures").exists() and run.poll() is None:
        pass
    with pytest.raises(subprocess.TimeoutExpired):  # it is drawing
        run.wait(0.3)
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=60)[1].strip() == "okiagari: stopped; nothing was written"
    # Python ends by the signal itself if that struck within an `exec` of words, as numba has: 130 for a shell, too.
    assert run.returncode in (130, -signal.SIGINT)
    assert not (here / "pictures").exists()


@needs_renderer
def test_a_part_of_a_run_is_filmed_into_another_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "short.toml", "--out", "a", "--no-video"]) == 0
    assert main(["render", "a", "--out", "part.mp4", "--from", "0.4", "--to", "0.8", "--fps", "10"]) == 0
    assert (here / "part.mp4").stat().st_size > 1000
    assert not (here / "a" / "video.mp4").exists()
    for options, words in (
        (["--from", "99"], "--from: 99 s is after the end of the run"),
        (["--from", "1", "--to", "0.5"], "--to: 0.5 s must be after --from, 1 s"),
        (["--out", "part.txt"], "must end with .mp4"),
    ):
        capsys.readouterr()
        assert main(["render", "a", *options]) == 2
        assert words in capsys.readouterr().err


def test_a_link_is_followed_and_a_replay_refused_before_it_runs(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "suite.toml", "--workers", "1", "--out", "out"]) == 0
    (here / "real.json").write_text("{}")
    (here / "link.json").symlink_to("real.json")
    assert main(["baseline", "out", "--out", "link.json", "--overwrite"]) == 0
    assert (here / "link.json").is_symlink()
    assert "okiagari baseline" in (here / "real.json").read_text()
    episode = read_results(here / "out")["episode"][0].as_py()
    capsys.readouterr()
    assert main(["replay", "out", episode, "--out", "/proc/x"]) == 2
    told = capsys.readouterr()
    assert "--out: " in told.err
    assert told.out == ""
