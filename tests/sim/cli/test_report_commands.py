"""The commands that conclude from a sweep: baseline, check, summary, report."""

from __future__ import annotations

from pathlib import Path

import pytest

from models.errors import InputError
from sim.report.report import REPORT
from tests.sim.analysis.sweep_tables import LIMITS, adaptive, folder_of, threshold_law
from tests.sim.program import call


def test_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    some = {"directions": [0.0, 90.0]}
    sweep = folder_of(tmp_path / "sweep", adaptive(threshold_law(LIMITS), **some))
    weak = adaptive(threshold_law(LIMITS | {"supervisor": 1.0}), **some)
    weakened = folder_of(tmp_path / "weakened", weak)
    baseline = tmp_path / "baseline.json"
    assert call("baseline", sweep, "--out", baseline) == 0
    assert call("check", sweep, "--baseline", baseline) == 0
    assert "not worse" in capsys.readouterr().out
    assert call("check", weakened, "--baseline", baseline) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("worse")
    assert "more than one step" in printed
    lost = next(one for one in weak if one["episode"] in printed and one["outcome"] == "fell")
    assert f"okiagari replay {weakened} {lost['episode']} --video" in printed
    assert call("summary", sweep) == 0
    assert (sweep / "summary.json").is_file()
    assert call("report", sweep, "--failures", "0") == 0
    assert (sweep / REPORT).is_file()


def test_what_cannot_be_compared_is_refused(tmp_path: Path) -> None:
    sweep = folder_of(tmp_path / "sweep", adaptive(threshold_law(LIMITS)))
    with pytest.raises(InputError, match="cannot be read"):
        call("check", sweep, "--baseline", tmp_path / "none.json")
    with pytest.raises(InputError, match="not the folder of a sweep"):
        call("report", tmp_path)
    baseline = tmp_path / "baseline.json"
    call("baseline", sweep, "--out", baseline)
    other = folder_of(tmp_path / "other", adaptive(threshold_law(LIMITS), directions=[0.0]), name="other")
    with pytest.raises(InputError, match="suite"):
        call("check", other, "--baseline", baseline)
