"""Probabilities of recovery on tables whose truth is known, and the numbers by which they are scored."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models.errors import InputError
from sim.analysis.calibration import Calibration, Model, as_text, calibrate, calibrations_for, probabilities
from sim.analysis.prediction_score import prediction_score, probability_score
from sim.analysis.statistics import auc, brier, fit_logistic, is_parted
from sim.analysis.summary import summarise, summary_of
from sim.report.report import write_report
from tests.sim.analysis.sweep_tables import folder_of, frame, row, sweep_facts, train_row
from tests.sim.program import call

HASH = "a" * 64
TUNING: dict[str, Any] = {"seed": 1000, "robots": {"utmu2": HASH}}
LEVEL, SLOPE, UPRIGHT = 0.5, 0.8, 0.3


def pushed(
    stepping: float | None, standing: float | None, *, well: bool, number: int = 0, **parameters: Any
) -> dict[str, Any]:
    """An episode that ends a push with these slacks [m]."""
    one = row(lambda _: well, delta_v=0.1 + 1e-4 * number, **parameters)
    one |= {"tracking_slack_end": stepping, "regulator_slack_end": standing}
    one |= {"in_tracking_set_end": stepping is not None and stepping >= 0.0}
    return one | {"in_regulator_set_end": standing is not None and standing >= 0.0}


def drawn(count: int, seed: int) -> list[dict[str, Any]]:
    """Pushes that are recovered by a known law; every other one ends with a foot in the air."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        stepping, standing = rng.uniform(-6.0, 6.0), rng.uniform(-4.0, 4.0)
        known = number % 2 == 0
        odds = LEVEL + SLOPE * stepping + (UPRIGHT * standing if known else 0.0)
        well = bool(rng.random() < 1.0 / (1.0 + math.exp(-odds)))
        rows.append(pushed(0.01 * stepping, 0.01 * standing if known else None, well=well, number=number))
    return rows


def simple(level: float = 0.0, slope: float = 1.0, **changes: Any) -> Model:
    """A law by the slack of steps alone."""
    made = Model(
        robot="utmu2",
        robot_hash=HASH,
        world="humanoid",
        controller="supervisor",
        source=None,
        terms=("stepping",),
        coefficients=(level, slope),
        covariance=((0.0, 0.0), (0.0, 0.0)),
        episodes=10,
        recovered=5,
        ridge=0.0,
    )
    return replace(made, **changes)


def of(*models: Model, suite_hash: str = "e" * 16) -> Calibration:
    return Calibration(
        suite="tuning", suite_hash=suite_hash, seed=1000, anyway=False, commit="0" * 40, models=tuple(models)
    )


def odds(p: float) -> float:
    """The slack of steps [m] to which `simple` gives a probability."""
    return 0.01 * math.log(p / (1.0 - p))


def test_the_law_that_made_a_table_is_found_again(tmp_path: Path) -> None:
    (model,) = calibrate(folder_of(tmp_path / "sweep", drawn(4000, 1), **TUNING)).models
    assert model.terms == ("stepping", "standing")
    assert (model.episodes, model.ridge, model.robot_hash) == (4000, 0.0, HASH)
    deviations = np.sqrt(np.diag(model.covariance))
    assert (deviations < 0.1).all()
    assert (np.abs(np.array(model.coefficients) - (LEVEL, SLOPE, UPRIGHT)) < 3.5 * deviations).all()


def test_the_covariance_is_what_other_draws_scatter_by(tmp_path: Path) -> None:
    models = [calibrate(folder_of(tmp_path / str(seed), drawn(300, seed), **TUNING)).models[0] for seed in range(30)]
    scatter = np.std([model.coefficients for model in models], axis=0, ddof=1)
    told = np.mean([np.sqrt(np.diag(model.covariance)) for model in models], axis=0)
    # The scatter of 30 draws is itself known to 13 %; three times that.
    assert scatter == pytest.approx(told, rel=0.4)


def test_outcomes_that_a_slack_parts_need_the_ridge(tmp_path: Path) -> None:
    rows = [pushed(0.01 * (i - 9.5), None, well=i > 9, number=i) for i in range(20)]
    (model,) = calibrate(folder_of(tmp_path / "parted", rows, **TUNING)).models
    assert model.ridge > 0.0
    assert np.isfinite([*model.coefficients, *np.ravel(model.covariance)]).all()
    # By symmetry the odds are even on the rim, and both slacks next to it are as far from certain.
    assert model.coefficients[0] == pytest.approx(0.0, abs=1e-9)
    assert 0.5 < model.probability(np.array([[1.0, 0.5]]))[0] < 1.0
    mixed = [*rows, pushed(-0.03, None, well=True, number=30)]
    assert calibrate(folder_of(tmp_path / "mixed", mixed, **TUNING)).models[0].ridge == 0.0


def test_a_touching_plane_parts_too() -> None:
    x = np.array([-1.0, 0.0, 0.0, 1.0])
    design = np.column_stack([np.ones(4), x])
    assert is_parted(design, np.array([0.0, 0.0, 1.0, 1.0]))
    assert not is_parted(design, np.array([1.0, 0.0, 1.0, 0.0]) * (x <= 0) + (x > 0) * 1.0)


def test_a_fit_of_two_groups_has_their_odds() -> None:
    # With one slack of two values the largest likelihood is known: the groups' own shares.
    design = np.column_stack([np.ones(20), np.repeat([0.0, 1.0], 10)])
    well = np.array([1.0] * 2 + [0.0] * 8 + [1.0] * 7 + [0.0] * 3)
    coefficients, covariance = fit_logistic(design, well, 0.0)
    assert coefficients == pytest.approx([math.log(2 / 8), math.log(7 / 3) - math.log(2 / 8)])
    assert covariance[0, 0] == pytest.approx(1 / 2 + 1 / 8)
    assert covariance[1, 1] == pytest.approx(1 / 2 + 1 / 8 + 1 / 7 + 1 / 3)


def test_brier_by_hand() -> None:
    assert brier(np.array([0.8, 0.3, 0.5]), np.array([1.0, 0.0, 0.0])) == pytest.approx((0.04 + 0.09 + 0.25) / 3)


def test_auc_counts_pairs() -> None:
    rng = np.random.default_rng(3)
    scores, well = rng.integers(0, 12, 80) / 12, (rng.random(80) < 0.7).astype(float)
    good, bad = scores[well > 0.5], scores[well < 0.5]
    pairs = [(g > b) + 0.5 * (g == b) for g in good for b in bad]
    found = auc(scores, well)
    assert found is not None
    assert found["value"] == pytest.approx(np.mean(pairs))
    low, high = found["interval"]
    assert 0.0 < low < found["value"] < high < 1.0
    assert auc(scores, np.ones(80)) is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_perfect_auc_of_few_is_not_sure(sign: float) -> None:
    found = auc(sign * np.array([0.1, 0.2, 0.8, 0.9, 0.95]), np.array([0.0, 0.0, 1.0, 1.0, 1.0]))
    assert found is not None
    assert found["value"] == (sign > 0)
    low, high = found["interval"]
    assert (low, high) == ((pytest.approx(low), 1.0) if sign > 0 else (0.0, pytest.approx(high)))
    assert 0.1 < high - low < 0.9


def test_the_interval_of_auc_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    well = np.repeat([0.0, 1.0], [15, 60])
    # Two normals a standard deviation apart: P(good > bad) is known.
    true, held = 0.5 * (1.0 + math.erf(1.0 / math.sqrt(2.0) / math.sqrt(2.0))), 0
    for _ in range(400):
        found = auc(rng.normal(well, 1.0), well)
        assert found is not None
        held += found["interval"][0] <= true <= found["interval"][1]
    assert held / 400 == pytest.approx(0.95, abs=0.035)  # three standard deviations of 400 draws


def test_a_score_by_hand() -> None:
    told = [(0.9, True), (0.9, False), (0.6, True), (0.2, True), (0.2, False)]
    rows = [pushed(odds(p), None, well=well, number=i) for i, (p, well) in enumerate(told)]
    rows.append(pushed(None, None, well=True, number=9) | {"in_tracking_set_end": None})
    found = probability_score(frame(rows), simple())
    assert found is not None
    assert (found["n"], found["without"], found["recovered"]["count"]) == (5, 1, 3)
    assert found["brier"] == pytest.approx((0.01 + 0.81 + 0.16 + 0.64 + 0.04) / 5)
    assert found["brier_base"] == pytest.approx(0.6 * 0.4)
    assert found["expected"]["count"] == pytest.approx(2.8)
    spread = 1.959964 * math.sqrt(2 * 0.09 + 0.24 + 2 * 0.16)
    assert found["expected"]["interval"] == pytest.approx([2.8 - spread, 2.8 + spread])
    assert found["auc"]["value"] == pytest.approx((0.5 + 1 + 0 + 1 + 0 + 0.5) / 6)
    assert [(one["low"], one["recovered"]["count"], one["recovered"]["n"]) for one in found["bins"]] == [
        (0.2, 1, 2),
        (0.6, 1, 1),
        (0.9, 1, 2),
    ]
    assert (found["false_safe"]["count"], found["false_safe"]["n"]) == (1, 3)
    assert (found["false_alarm"]["count"], found["false_alarm"]["n"]) == (1, 2)


def test_doubt_in_the_coefficients_widens_what_is_expected() -> None:
    rows = [pushed(odds(0.5), None, well=i % 2 == 0, number=i) for i in range(100)]
    sure = probability_score(frame(rows), simple())
    unsure = probability_score(frame(rows), simple(covariance=((0.25, 0.0), (0.0, 0.0))))
    assert sure is not None
    assert unsure is not None
    # 100 coins vary by 25; a level that varies by 0.25 moves all of them: (100 / 4)² 0.25.
    ratio = (np.ptp(unsure["expected"]["interval"]) / np.ptp(sure["expected"]["interval"])) ** 2
    assert ratio == pytest.approx((25 + 25**2 * 0.25) / 25)


def test_no_step_within_reach_is_the_least_slack_of_all() -> None:
    rows = [pushed(slack, None, well=False, number=i) for i, slack in enumerate([-math.inf, -5.0, -0.2, 0.0])]
    told = probabilities(frame(rows), [of(simple())])
    assert told.iloc[0] == told.iloc[1] == told.iloc[2] < 1e-8
    assert told.iloc[3] == 0.5


def test_whom_no_model_speaks_of_has_no_probability() -> None:
    rows = [pushed(0.01, None, well=True, controller=name) for name in ("regulator", "supervisor")]
    rows.append(pushed(0.01, None, well=True, world="pendulum"))
    rows.append(pushed(0.01, None, well=True, number=4) | {"outcome": "crashed"})
    assert probabilities(frame(rows), [of(simple())]).notna().tolist() == [False, True, False, False]
    assert prediction_score(frame(rows[:1]), [of(simple())])["probability"] == []


def test_each_push_of_a_train_has_its_own(tmp_path: Path) -> None:
    rows = [train_row(survived, replica=i) for i, survived in enumerate((3, 5, 4, 6))]
    (entry,) = summarise(frame(rows), sweep_facts(rows), [of(simple())])["prediction_score"]["probability"]
    assert entry["n"] == 4 + 6 + 5 + 7
    assert entry["recovered"]["count"] == 18


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


def test_the_shipped_calibration_is_of_the_robot_as_it_is() -> None:
    from models.robot import load_robot

    robot = load_robot("utmu2")
    sweep = {"robots": {"utmu2": robot.sha256}, "controllers": {"supervisor": {"source": None}}}
    (one,) = calibrations_for(sweep)
    assert one.seed >= 1000
    assert not one.anyway
    # More slack is safer.
    assert one.models[0].coefficients[1] > 0.0
