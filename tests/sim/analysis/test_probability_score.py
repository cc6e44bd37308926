"""How probabilities are scored: numbers worked out by hand, and by chance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.analysis.prediction_score import probability_score
from sim.analysis.statistics import auc, brier
from tests.sim.analysis.calibrations import odds, pushed, simple
from tests.sim.analysis.sweep_tables import frame


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
