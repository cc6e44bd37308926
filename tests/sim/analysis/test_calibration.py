"""The probability of recovery is fitted, and asked, on tables whose law is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from models.errors import InputError
from sim.analysis.calibration import EXACT, calibrate, probabilities, senses
from sim.analysis.prediction_score import prediction_score
from sim.analysis.statistics import fit_logistic, is_parted
from sim.analysis.summary import summarise
from tests.sim.analysis.calibrations import HASH, LEVEL, SLOPE, TUNING, UPRIGHT, drawn, of, pushed, simple
from tests.sim.analysis.sweep_tables import folder_of, frame, sweep_facts, train_row


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


def test_a_slack_that_speaks_against_recovery_is_left_out(tmp_path: Path) -> None:
    rows = drawn(400, 3)
    (model,) = calibrate(folder_of(tmp_path / "sound", rows, **TUNING)).models
    assert model.terms == ("stepping", "standing")
    # Of pushes that end on both feet all are recovered but some of the most slack.
    odd = [
        {**one, "outcome": "fell" if (one["regulator_slack_end"] or 0.0) > 0.03 else "recovered"}
        for one in rows
        if one["regulator_slack_end"] is not None
    ]
    (model,) = calibrate(folder_of(tmp_path / "odd", [*rows[1::2], *odd], **TUNING)).models
    assert model.terms == ("stepping",)
    assert model.coefficients[1] > 0.0


def test_a_controller_whose_every_slack_speaks_against_recovery_has_no_law(tmp_path: Path) -> None:
    rows = [pushed(0.01 * (i - 9.5), None, well=i < 10 or i == 15, number=i) for i in range(20)]
    with pytest.raises(InputError, match="the more often the less slack; nothing to fit"):
        calibrate(folder_of(tmp_path / "against", rows, **TUNING))


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


REAL = {"sensing": "typical", "latency": 0.004, "body_error": 1.0}
WORDS = "typical, 4 ms late, body errors x 1"


def test_what_was_seen_is_told_in_words() -> None:
    noisy = {"noise_position": 0.001, "noise_velocity": 0.02}
    rows = [pushed(0.01, None, well=True, **seen) for seen in ({}, REAL, noisy)]
    rows.append(pushed(0.01, None, well=True, number=1) | {"dcm_error_rms": 0.001})
    assert senses(frame(rows)).tolist() == [EXACT, WORDS, "exact, 1 mm of noise, 2 cm/s of noise", "estimated"]
    assert senses(frame(rows)[:0]).empty


def test_each_senses_have_their_own_law(tmp_path: Path) -> None:
    rows = [*drawn(300, 3), *drawn(300, 3, **REAL)]
    exact, real = calibrate(folder_of(tmp_path / "sweep", rows, **TUNING)).models
    assert (exact.senses, real.senses) == (EXACT, WORDS)
    assert exact.coefficients == pytest.approx(real.coefficients)


def test_a_push_is_told_by_the_law_of_its_senses_or_for_want_of_one_of_the_exact_state() -> None:
    late = REAL | {"latency": 0.01}
    rows = [pushed(0.0, None, well=True, number=i, **seen) for i, seen in enumerate(({}, REAL, late))]
    table = frame(rows)
    laws = [of(simple(2.0, senses=WORDS)), of(simple(1.0))]
    told = 1.0 / (1.0 + np.exp([-1.0, -2.0, -1.0]))
    assert probabilities(table, laws).tolist() == pytest.approx(told.tolist())
    assert probabilities(table, laws[:1]).tolist() == pytest.approx(3 * [told[1]])
    found = [(one["senses"], one["by"]["senses"], one["n"]) for one in prediction_score(table, laws)["probability"]]
    assert found == [(WORDS, WORDS, 1), (EXACT, EXACT, 1), ("typical, 10 ms late, body errors x 1", EXACT, 1)]
