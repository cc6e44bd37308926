"""What is mistyped about a sweep is refused in one line with exit code 2, before anything is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sim.analysis.baseline import of_sweep, write_baseline
from sim.cli.app import main
from sim.results.table import SWEEP
from sim.sweep.plan import suite_hash
from sim.sweep.store import describe
from tests.sim.analysis.sweep_tables import adaptive, folder_of, row, sweep_facts, threshold_law
from tests.sim.sweep.sweep_suites import PENDULUM, suite

LAW = threshold_law({"supervisor": 1.5, "regulator": 0.8})


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of sweeps and what else a command may be pointed at; nothing may change there."""
    folder = tmp_path_factory.mktemp("refusals")
    rows = adaptive(LAW, controllers=("supervisor", "regulator"), directions=(0.0, 90.0))
    write_baseline(of_sweep(folder_of(folder / "done", rows)), folder / "done.json")
    write_baseline(of_sweep(folder_of(folder / "alien", rows, name="alien")), folder / "alien.json")
    folder_of(folder / "half", rows, finished=0)
    folder_of(folder / "single", [row(LAW)])
    (folder / "empty").mkdir()
    (folder / "norows").mkdir()
    (folder / "norows" / SWEEP).write_text(json.dumps(sweep_facts(rows)))
    folder_of(folder / "broken", rows)
    (folder / "broken" / SWEEP).write_text("{")
    (folder / "thesis").mkdir()
    (folder / "thesis" / "thesis.tex").touch()
    # Of `short`, of its file before it was changed, and of the worlds of its file.
    (folder / "then").mkdir()
    describe(suite(folder, PENDULUM.replace("seed = 7", "seed = 8")), folder / "then", planned=16, finished=0)
    short = suite(folder)
    assert json.loads((folder / "then" / SWEEP).read_text())["suite_hash"] != suite_hash(short)
    (folder / "worlds").mkdir()
    describe(short, folder / "worlds", planned=16, finished=0)
    return folder


REFUSED = {
    "misspelt suite": (
        "sweep trunk_pus",
        "'trunk_pus' is neither one of ablation, calibration, cog_push|'trunk_push'?",
    ),
    "scenario as suite": ("sweep quiet", "suite: 'quiet' is a scenario: okiagari run quiet"),
    "suite as scenario": ("run smoke", "scenario: 'smoke' is a suite: okiagari sweep smoke"),
    "missing suite": ("sweep gone.toml", "suite: no file 'gone.toml'"),
    "folder as suite": ("sweep done", "suite: 'done' is neither one of|nor a path to a .toml file"),
    "unknown world": ("sweep smoke --world pendulun", "'--world': 'pendulun' is not one of 'humanoid', 'pendulum'"),
    "no workers": ("sweep smoke --workers 0", "--workers|'0' is not allowed; it must be >= 1"),
    "fewer workers": ("sweep smoke --workers -2", "--workers|'-2' is not allowed; it must be >= 1"),
    "half a worker": ("sweep smoke --workers 1.5", "--workers|'1.5' is not a whole number"),
    "folder of another suite": (
        "sweep short.toml --out done",
        "'done' holds results of the suite 'made_up', not of 'short'; choose another folder with --out",
    ),
    "folder of the suite as it was": ("sweep short.toml --out then", "'then' holds results of the suite 'short' as it"),
    "folder of other worlds": (
        "sweep short.toml --world humanoid --out worlds",
        "'worlds' holds results of the suite 'short' in the worlds of its file, not in the world humanoid only",
    ),
    "foreign folder": ("sweep short.toml --out thesis", "'thesis' holds 'thesis.tex', which no sweep writes"),
    "file as folder": ("sweep short.toml --out done.json", "--out: 'done.json' cannot be written: File exists"),
    "ablation of no variants": ("ablation done", "'done' is of the suite 'made_up', which has no variants to compare"),
    "ablation of a suite without": ("ablation --suite smoke", "smoke.toml: variants: is missing"),
    "ablation of nothing": ("ablation gone", "'gone' is not the folder of a sweep: there is no such folder"),
    "ablation by nobody": ("ablation --workers -1", "--workers|'-1' is not allowed; it must be >= 1"),
    "bars of no kind": ("ablation --picture x.pdf", "--picture: 'x.pdf' must end in .png or .svg"),
    "bars in a file": (
        "ablation --picture done.json/x.png",
        "--picture: 'done.json/x.png' cannot be made|is not a folder",
    ),
    "envelope of nothing": ("envelope gone", "'gone' is not the folder of a sweep: there is no such folder"),
    "envelope of a file": ("envelope done.json", "'done.json' is not the folder of a sweep: it is a file"),
    "envelope of a folder": ("envelope empty", "'empty' is not the folder of a sweep: it has no sweep.json"),
    "envelope of no episode": ("envelope norows", "'norows' holds no finished episode yet"),
    "envelope of one push": ("envelope single", "there are no thresholds"),
    "envelope of no kind": ("envelope done --out x.gif", "--out: 'x.gif' must end in .png or .svg"),
    "envelope as a folder": ("envelope done --out empty", "--out: 'empty' must end in .png or .svg"),
    "case of one": ("envelope done --case x", "--case: 'x' is not needed; the suite has only one case"),
    "hardest of nothing": ("hardest gone", "'gone' is not the folder of a sweep: there is no such folder"),
    "hardest of nobody": ("hardest done --controller statue", "--controller: 'statue' is none of the sweep's; choose"),
    "hardest of one push": ("hardest single", "there are no thresholds"),
    "report of nothing": ("report gone", "'gone' is not the folder of a sweep: there is no such folder"),
    "report of a damaged sweep": ("report broken", "broken/sweep.json: damaged; delete it and repeat the sweep"),
    "report of fewer failures": ("report done --failures -1", "--failures|'-1' is not allowed; it must be >= 0"),
    "report as a folder": ("report done --out empty", "--out: 'empty' is a folder; it must be a file"),
    "report in a file": (
        "report done --out done.json/x.html",
        "--out: 'done.json/x.html' cannot be made|is not a folder",
    ),
    "report against nothing": ("report done --baseline gone.json", "gone.json: cannot be read: No such file"),
    "report against another": ("report done --baseline alien.json", "baseline is of suite 'alien', the sweep of 'mad"),
    "check against another": ("check done --baseline alien.json", "baseline is of suite 'alien', the sweep of 'mad"),
    "check against no baseline": ("check done --baseline short.toml", "short.toml: not a baseline"),
    "check of a half sweep": ("check half --baseline done.json", "'half': the sweep is not finished; repeat the comm"),
    "baseline of a half sweep": ("baseline half", "'half': the sweep is not finished; repeat the command"),
    "baseline as a folder": ("baseline done --out empty", "--out: 'empty' is a folder; it must be a file"),
    "replay of nothing": ("replay gone a", "'gone' is not the folder of a sweep: there is no such folder"),
    "replay of no episode": ("replay done zz", "'done' has no episode 'zz'"),
}


def contents(folder: Path) -> dict[Path, bytes | None]:
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*") if path.name != ".lock"}


@pytest.mark.parametrize("what", REFUSED)
def test_mistake_is_told_in_one_line(
    what: str, files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(files)
    before = contents(files)
    arguments, words = REFUSED[what]
    assert main(arguments.split()) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("okiagari: ")
    assert captured.err.count("\n") == 1
    for word in words.split("|"):
        assert word in captured.err
    assert contents(files) == before
    # A lock is left in the folder of a sweep only.
    assert not (files / "thesis" / ".lock").exists()


@pytest.mark.parametrize("command", ["summary half", "envelope half --out half.png"])
def test_what_is_shown_of_half_a_sweep_says_so(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = adaptive(LAW, controllers=("supervisor",), directions=(0.0,))
    for name, finished in (("half", 0), ("whole", len(rows))):
        folder_of(tmp_path / name, rows, finished=finished, planned=len(rows) + 5)
    assert main(command.split()) == 0
    assert f"okiagari: not finished: {len(rows)} of {len(rows) + 5} episodes\n" in capsys.readouterr().err
    assert main(command.replace("half", "whole").split()) == 0
    assert "not finished" not in capsys.readouterr().err
