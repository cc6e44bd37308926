from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from sim.analysis import prediction_score as scoring
from sim.analysis.frame import groups, plain
from sim.analysis.prediction_score import Moment, Rule, prediction_score, sector
from sim.analysis.statistics import paired_p, rate, rate_of
from sim.analysis.thresholds import Threshold, least_of
from sim.analysis.thresholds import thresholds as thresholds_of
from tests.sim.analysis.calibrations import odds, of, pushed, simple
from tests.sim.analysis.sweep_tables import LIMITS, OMEGA, STEP, adaptive, edge, frame, row, threshold_law


@given(n=st.integers(1, 2000), share=st.floats(0, 1))
def test_interval_is_wilsons(n: int, share: float) -> None:
    found = rate(round(share * n), n)
    # scipy has the same interval; both solve a quadratic, to rounding.
    expected = binomtest(found["count"], n).proportion_ci(0.95, method="wilson")
    assert found["interval"] == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_rate_of_nothing_is_unknown() -> None:
    assert rate_of([]) == {"n": 0, "count": 0, "rate": None, "interval": None}
    with pytest.raises(ValueError, match="3 of 2"):
        rate(3, 2)


@given(lost=st.integers(0, 60), gained=st.integers(0, 60))
def test_paired_test_is_the_exact_sign_test(lost: int, gained: int) -> None:
    expected = binomtest(lost, lost + gained).pvalue if lost + gained else 1.0
    assert paired_p(lost, gained) == pytest.approx(min(expected, 1.0), rel=1e-9)


def test_groups_ignore_rounding_and_order() -> None:
    rows = pd.DataFrame({"a": [0.1 + 0.2, 0.3, math.nan, None, 0.2], "b": [1, 2, 3, 4, 5]})
    assert [(key, members["b"].tolist()) for key, members in groups(rows, ["a"])] == [
        ((None,), [3, 4]),
        ((0.2,), [5]),
        ((0.3,), [1, 2]),
    ]
    (everyone,) = groups(rows, [])
    assert everyone[0] == ()
    assert len(everyone[1]) == 5


def test_values_of_cells_are_what_json_takes() -> None:
    cells = (pd.NA, math.nan, np.int64(3), np.float64(0.5), "a", pd.Interval(0.1, 0.2))
    assert json.dumps([plain(value) for value in cells]) == '[null, null, 3, 0.5, "a", [0.1, 0.2]]'


def thresholds(rows: list[dict[str, Any]]) -> list[Threshold]:
    return thresholds_of(frame(rows))


@pytest.mark.parametrize(("replicas", "least"), [(1, 1), (2, 2), (3, 3), (4, 4), (5, 4), (6, 5), (10, 8), (20, 16)])
def test_least_is_four_fifths_rounded_up(replicas: int, least: int) -> None:
    assert least_of(replicas) == least
    options = {"controllers": ["supervisor"], "directions": [0.0], "levels": 3, "replicas": replicas}
    for failing in (replicas - least, replicas - least + 1):
        rows = adaptive(
            lambda asked, failing=failing: asked["delta_v"] < 0.12 or asked["replica"] >= failing, **options
        )
        assert thresholds(rows)[0].capped == (failing == replicas - least)


def test_thresholds_are_those_of_the_law() -> None:
    found = thresholds(adaptive(threshold_law(LIMITS)))
    assert len(found) == 3 * 8
    for one in found:
        limit = LIMITS[one.controller] * OMEGA * edge(one.direction_deg)
        # The four strong replicas carry every level up to the law's limit, and no further.
        assert one.delta_v == pytest.approx(STEP * math.floor(limit / STEP + 1e-9))
        assert one.over_omega_d == pytest.approx(one.delta_v / (OMEGA * edge(one.direction_deg)))
        assert one.no_step_delta_v == pytest.approx(OMEGA * edge(one.direction_deg))
        assert one.ever == one.delta_v
        assert not one.capped
        assert one.step == STEP


def test_pockets_count_as_ever_but_not_as_robust() -> None:
    law = threshold_law(LIMITS, pockets=[(0.7, 2)])
    (plain,) = thresholds(adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0]))
    (pocket,) = thresholds(adaptive(law, controllers=["supervisor"], directions=[0.0]))
    assert pocket.delta_v == plain.delta_v == pytest.approx(0.6)
    assert pocket.ever == 0.7
    assert pocket.over_omega_d == pytest.approx(plain.over_omega_d)


def test_one_level_below_that_fails_ends_it() -> None:
    def law(asked: Any) -> bool:
        return not (0.28 < asked["delta_v"] < 0.32 and asked["replica"] < 2)

    (one,) = thresholds(adaptive(law, controllers=["supervisor"], directions=[0.0], levels=12))
    assert (one.delta_v, one.ever, one.capped) == (0.25, 0.6, False)


def test_threshold_at_the_top_is_a_bound() -> None:
    (one,) = thresholds(adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=6))
    assert (one.delta_v, one.capped) == (pytest.approx(0.3), True)


def test_nothing_recovered_is_zero() -> None:
    (one,) = thresholds(adaptive(lambda _: False, controllers=["supervisor"], directions=[0.0]))
    assert (one.delta_v, one.ever, one.over_omega_d) == (0.0, 0.0, 0.0)


def test_missing_replicas_are_not_recovered() -> None:
    rows = adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=6)
    rows = [one for one in rows if not (one["delta_v"] > 0.22 and one["replica"] > 2)]
    (one,) = thresholds(rows)
    assert one.delta_v == pytest.approx(0.2)


def test_cases_have_thresholds_of_their_own() -> None:
    law = threshold_law({"supervisor": 1.5})
    options = {"controllers": ["supervisor"], "directions": [0.0]}
    rows = adaptive(law, mass_scale=0.9, **options) + adaptive(lambda _: False, mass_scale=1.1, **options)
    assert [(one.case, one.delta_v) for one in thresholds(rows)] == [
        ({"mass_scale": 0.9}, pytest.approx(0.6)),
        ({"mass_scale": 1.1}, 0.0),
    ]


def test_random_pushes_have_no_thresholds() -> None:
    rows = [
        row(lambda _: True, direction_deg=7.3 * i, delta_v=0.01 * i, duration=0.1 + 0.001 * i) for i in range(1, 40)
    ]
    assert thresholds(rows) == []


def test_crashed_counts_as_not_recovered() -> None:
    rows = adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=4)
    for one in rows:
        if one["delta_v"] > 0.12 and one["replica"] < 2:
            one["outcome"] = "crashed"
    assert thresholds(rows)[0].delta_v == pytest.approx(0.1)


def state(outcome: str, regulator: float | None, tracking: float | None, **changes: Any) -> dict[str, Any]:
    one = row(lambda _: outcome == "recovered")
    for moment in ("end", "decision"):
        one[f"regulator_slack_{moment}"], one[f"tracking_slack_{moment}"] = regulator, tracking
        one[f"in_regulator_set_{moment}"] = None if regulator is None else regulator >= 0
        one[f"in_tracking_set_{moment}"] = None if tracking is None else tracking >= 0
    return one | {"outcome": outcome} | changes


def score(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return scoring.score(frame(rows))


def by_slack(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return scoring.by_slack(frame(rows))


def predicted_safe(one: dict[str, Any], moment: Moment = "end", rule: Rule = "law") -> bool | None:
    found: bool | None = plain(scoring.predicted_safe(frame([one]), moment, rule).iloc[0])
    return found


def signed_slack(one: dict[str, Any]) -> float | None:
    found: float | None = plain(scoring.signed_slack(frame([one])).iloc[0])
    return found


def test_prediction_is_by_the_sets_that_the_controller_has() -> None:
    assert predicted_safe(state("fell", -0.01, 0.02)) is True
    assert predicted_safe(state("fell", -0.01, 0.02), rule="regulator") is False
    # Null is no set, False is one that does not hold the state.
    assert predicted_safe(state("fell", -0.01, None, controller="regulator")) is False
    assert predicted_safe(state("fell", -0.01, None), rule="tracking") is None
    assert predicted_safe(state("fell", None, 0.02, controller="a stranger")) is True
    assert predicted_safe(state("fell", None, None)) is None
    assert predicted_safe(state("crashed", 0.01, None)) is None


def test_a_probability_of_recovery_says_it_in_place_of_the_sets() -> None:
    outside, inside = state("recovered", -0.01, -0.02), state("fell", -0.01, 0.02)
    pushes = frame([outside, inside, outside, state("crashed", 0.01, None)])
    pushes = pushes.assign(probability=[0.5, 0.49, math.nan, math.nan])
    assert scoring.predicted_safe(pushes).tolist() == [True, False, False, pd.NA]
    # The sets alone say what they said, and of the decision no probability is told.
    assert scoring.predicted_safe(pushes, rule="law").tolist() == [False, True, False, pd.NA]
    assert scoring.predicted_safe(pushes, "decision").tolist() == [False, True, False, pd.NA]


def test_the_score_is_by_the_calibration_where_it_speaks_and_by_the_sets_elsewhere() -> None:
    told = [(0.9, True), (0.9, False), (0.4, True), (0.3, False), (0.2, False)]
    # A law that is sure two centimetres outside the sets: the sets alone call none of these safe.
    law = simple(level=4.0)
    rows = [pushed(odds(p) - 0.04, None, well=well, number=i) for i, (p, well) in enumerate(told)]
    strange = [one | {"controller": "a stranger", "episode": f"s{i}"} for i, one in enumerate(rows)]
    result = prediction_score(frame([*rows, *strange]), [of(law)])
    by_rule = {
        (one["controller"], one["set"]): (one["false_safe"], one["false_alarm"])
        for one in result["scores"]
        if one["moment"] == "end" and one["direction_deg"] is None
    }
    counts = {key: [(rate["count"], rate["n"]) for rate in rates] for key, rates in by_rule.items()}
    assert counts["supervisor", "told"] == [(1, 2), (1, 3)]
    assert counts["supervisor", "law"] == counts["a stranger", "told"] == [(0, 0), (2, 5)]
    assert ("a stranger", "law") not in counts
    assert (result["false_safe"]["humanoid"]["n"], result["false_alarm"]["humanoid"]["n"]) == (2, 8)
    (entry,) = result["probability"]
    assert [(entry[name]["count"], entry[name]["n"]) for name in ("false_safe", "false_alarm")] == [(1, 2), (1, 3)]


def test_slack_is_the_best_of_the_sets_that_count() -> None:
    assert signed_slack(state("fell", -0.01, 0.02)) == 0.02
    assert signed_slack(state("fell", -0.01, None, controller="regulator")) == -0.01
    assert signed_slack(state("fell", -0.01, 0.02) | {"in_tracking_set_end": None}) == -0.01
    assert signed_slack(state("fell", -0.01, -math.inf)) == -0.01
    assert signed_slack(state("fell", None, -math.inf)) is None
    assert signed_slack(state("fell", None, None, controller="statue")) is None


def test_confusion_counts_each_kind_once() -> None:
    kinds = [("recovered", 0.01), ("fell", 0.01), ("recovered", -0.01), ("not_settled", -0.01), ("crashed", None)]
    rows = [state(outcome, slack, None) for times, (outcome, slack) in enumerate(kinds, start=1) for _ in range(times)]
    result = score(rows)
    assert list(result["confusion"].values()) == [1, 2, 3, 4, 5]
    for name, count, n in (
        ("false_safe", 2, 3),
        ("false_alarm", 3, 7),
        ("false_safe_of_lost", 2, 6),
        ("false_alarm_of_recovered", 3, 4),
    ):
        assert (result[name]["count"], result[name]["n"]) == (count, n)
        low, high = result[name]["interval"]
        assert low < count / n < high


def test_worlds_and_moments_are_scored_apart() -> None:
    perfect = [state("recovered", 0.01, None, world="pendulum"), state("fell", -0.01, None, world="pendulum")]
    wrong = state("fell", 0.01, None) | {"in_regulator_set_decision": False}
    result = prediction_score(frame([*perfect, wrong, state("recovered", None, None, controller="statue")]))
    assert result["false_safe"]["pendulum"]["rate"] == 0.0
    assert result["false_safe"]["humanoid"]["rate"] == 1.0
    by_moment = {
        one["moment"]: one["false_safe"]["n"]
        for one in result["scores"]
        if one["world"] == "humanoid" and one["set"] in ("told", "law") and one["direction_deg"] is None
    }
    assert by_moment == {"end": 1, "decision": 0}
    assert {one["controller"] for one in result["scores"]} == {"supervisor"}
    json.dumps(result, allow_nan=False)


def test_regions_part_the_predicted_episodes() -> None:
    rows = [state("recovered", 0.01, 0.02), state("recovered", -0.01, 0.02), state("fell", -0.01, -0.02)]
    regions = [one for one in prediction_score(frame(rows))["regions"] if one["moment"] == "end"]
    assert [(one["region"], one["recovered"]["n"], one["recovered"]["count"]) for one in regions] == [
        ("regulator", 1, 1),
        ("tracking", 1, 1),
        ("outside", 1, 0),
    ]


def test_slack_bins_meet_at_zero_and_hold_everyone() -> None:
    rows = [state("recovered" if (i * 7) % 60 > i else "fell", 0.001 * (30 - i) + 0.0005, None) for i in range(60)]
    result = by_slack(rows)
    assert sum(one["recovered"]["n"] for one in result["bins"]) == 60
    assert all(one["high"] < 0.0 or one["low"] >= 0.0 for one in result["bins"])
    assert all(one["low"] <= one["middle"] <= one["high"] for one in result["bins"])
    assert result["logistic"]["slope_per_cm"] > 0.0
    low, high = result["logistic"]["slope_interval"]
    assert low < result["logistic"]["slope_per_cm"] < high


def test_slack_that_parts_all_has_no_slope() -> None:
    rows = [state("recovered" if i > 5 else "fell", 0.001 * i, None) for i in range(20)]
    fit = by_slack(rows)["logistic"]
    assert fit == {"separated": True, "worst_lost": 0.005, "least_recovered": 0.006}
    assert by_slack(rows[:3])["logistic"] is None
    assert by_slack([])["bins"] == []


@pytest.mark.parametrize(("angle", "middle"), [(0, 0), (22, 0), (23, 45), (359, 0), (338, 0), (337, 315), (180, 180)])
def test_sectors(angle: float, middle: int) -> None:
    assert sector(angle) == middle
