"""Calibrations in files: what is refused, what the commands tell by them, and the one that is shipped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from models.errors import InputError
from models.robot import load_robot
from sim.analysis.calibration import EXACT, calibrate
from sim.analysis.calibration_files import as_text, calibrations_for
from sim.analysis.summary import summary_of
from sim.report.report import write_report
from tests.sim.analysis.calibrations import HASH, TUNING, drawn, of, pushed, simple
from tests.sim.analysis.sweep_tables import folder_of
from tests.sim.program import call


def test_suites_that_are_held_out_are_refused(tmp_path: Path) -> None:
    rows = drawn(60, 2)
    for name, changes, words in (
        ("told", {"tuned_on": "this suite's seed was held out"}, "is held out"),
        ("seed", {"seed": 999}, "has the seed 999"),
        ("rest", {"planned": 61, "finished": 60 - 1}, "not finished"),
    ):
        folder = folder_of(tmp_path / name, rows, **(TUNING | changes))
        with pytest.raises(InputError, match=words) as caught:
            call("calibrate", folder, "--out", tmp_path / "no.json")
        assert "\n" not in str(caught.value)
    assert not (tmp_path / "no.json").exists()
    assert calibrate(tmp_path / "told", anyway=True).anyway
    with pytest.raises(InputError, match="nothing to fit"):
        calibrate(folder_of(tmp_path / "all", [pushed(0.01, None, well=True)], **TUNING))


def test_a_calibration_of_another_robot_is_refused_in_a_line(tmp_path: Path) -> None:
    rows = drawn(60, 2)
    folder, file = folder_of(tmp_path / "sweep", rows, **TUNING), tmp_path / "fit.json"
    for model, words in (
        (simple(robot_hash="b" * 64), f"with the hash {'b' * 12}, the sweep's has {'a' * 12}"),
        (simple(robot="op3"), "of the robot 'op3'"),
        (simple(controller="paper"), "of the controller 'paper'"),
        (simple(source="c" * 64), "with the hash cccccccccccc, the sweep's has no file"),
    ):
        file.write_text(as_text(of(model)))
        with pytest.raises(InputError, match=words) as caught:
            call("summary", folder, "--calibration", file)
        assert str(caught.value).startswith(f"{file}: ")
        assert "\n" not in str(caught.value)
    # Those of the checkout are of another robot of this name, and so say nothing.
    assert summary_of(folder)["prediction_score"]["probability"] == []


@pytest.mark.parametrize(
    "change",
    [
        lambda one: one["models"][0].pop("terms"),
        lambda one: one["models"][0].update(coefficients=[1.0]),
        lambda one: one["models"][0].update(covariance=[[-1.0, 0.0], [0.0, 1.0]]),
        lambda one: one["models"][0].update(coefficients=["x", 1.0]),
        lambda one: one["models"][0].update(terms=["sitting"]),
        lambda one: one["models"][0].update(robot=["utmu2"]),
        lambda one: one["models"][0].update(source=3),
        lambda one: one["models"][0].pop("senses"),
        lambda one: one.update(version=1),
        lambda one: one["models"][0].update(ridge="much"),
        lambda one: one.update(commit=None),
        lambda one: one.update(models=3),
        lambda one: one.update(kind="okiagari baseline"),
        lambda one: one.pop("seed"),
    ],
)
def test_damaged_calibrations_are_named(change: Any, tmp_path: Path) -> None:
    content, file = json.loads(as_text(of(simple()))), tmp_path / "fit.json"
    change(content)
    file.write_text(json.dumps(content))
    with pytest.raises(InputError, match="calibration") as caught:
        calibrations_for(TUNING, file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


def test_commands_fit_tell_and_show(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tuning = folder_of(tmp_path / "tuning", drawn(400, 1), **TUNING)
    file = tmp_path / "fit.json"
    assert call("calibrate", tuning, "--out", file) == 0
    assert "ridge" not in capsys.readouterr().out
    first = file.read_bytes()
    with pytest.raises(InputError, match="--overwrite"):
        call("calibrate", tuning, "--out", file)
    assert call("calibrate", tuning, "--out", file, "--overwrite") == 0
    assert file.read_bytes() == first
    held_out = folder_of(tmp_path / "held_out", drawn(500, 7), robots={"utmu2": HASH}, suite_hash="d" * 16)
    capsys.readouterr()
    assert call("summary", held_out, "--calibration", file) == 0
    assert "Probability of recovery from the slacks" in capsys.readouterr().out
    (entry,) = json.loads((held_out / "summary.json").read_text())["prediction_score"]["probability"]
    assert not entry["by"]["same_suite"]
    assert entry["brier"] < 0.8 * entry["brier_base"]
    # The law is the true one, so what was expected came.
    low, high = entry["expected"]["interval"]
    assert low < entry["recovered"]["count"] < high
    assert call("episodes", held_out, "--calibration", file, "--json") == 0
    told = [one["probability"] for one in json.loads(capsys.readouterr().out)]
    assert sum(told) == pytest.approx(entry["expected"]["count"])
    write_report(held_out, tmp_path / "page.html", failures=0, calibration=file)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for words in (
        "Brier score of the probability of recovery",
        "Recovery by the probability that was told",
        "seed 1000",
    ):
        assert words in page
    write_report(held_out, tmp_path / "plain.html", failures=0)
    assert "Brier" not in (tmp_path / "plain.html").read_text(encoding="utf-8")
    assert "do not trust it" not in page
    # Far more sure than the law that made the table.
    file.write_text(as_text(of(simple(level=3.0))))
    capsys.readouterr()
    assert call("summary", held_out, "--calibration", file) == 0
    assert "do not trust it" in " ".join(capsys.readouterr().out.split())
    call("calibrate", tuning, "--out", file, "--overwrite")
    (own,) = summary_of(tuning, file)["prediction_score"]["probability"]
    assert own["by"]["same_suite"]


def test_the_shipped_calibrations_are_of_the_robot_as_it_is() -> None:
    robot = load_robot("utmu2")
    sweep = {"robots": {"utmu2": robot.sha256}, "controllers": {"supervisor": {"source": None}}}
    shipped = calibrations_for(sweep)
    assert {model.senses for one in shipped for model in one.models} == {
        EXACT,
        "typical, 4 ms late, body errors x 1",
    }
    for one in shipped:
        assert one.seed >= 1000
        assert not one.anyway
        # More slack is safer.
        assert one.models[0].coefficients[1] > 0.0
