from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from sim.analysis.prediction_score import by_slack, predicted_safe, score, sector, signed_slack, truth
from sim.analysis.statistics import Rate, grouped, paired_p, rate_of
from sim.analysis.thresholds import thresholds
from tests.sim.analysis.sweep_tables import OMEGA, STEP, adaptive, edge, row, threshold_law

LIMITS = {"supervisor": 1.5, "regulator": 0.8, "statue": 0.5}


@given(n=st.integers(1, 2000), share=st.floats(0, 1))
def test_interval_is_wilsons(n: int, share: float) -> None:
    rate = Rate(count=round(share * n), n=n)
    # scipy has the same interval; both solve a quadratic, to rounding.
    expected = binomtest(rate.count, n).proportion_ci(0.95, method="wilson")
    assert rate.interval == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_rate_of_nothing_is_unknown() -> None:
    assert rate_of([]).as_dict() == {"n": 0, "count": 0, "rate": None, "interval": None}
    with pytest.raises(ValueError, match="3 of 2"):
        Rate(count=3, n=2)


@given(lost=st.integers(0, 60), gained=st.integers(0, 60))
def test_paired_test_is_the_exact_sign_test(lost: int, gained: int) -> None:
    expected = binomtest(lost, lost + gained).pvalue if lost + gained else 1.0
    assert paired_p(lost, gained) == pytest.approx(min(expected, 1.0), rel=1e-9)


def test_groups_ignore_rounding_and_order() -> None:
    rows = [{"a": 0.1 + 0.2, "b": 1}, {"a": 0.3, "b": 2}, {"a": math.nan, "b": 3}, {"b": 4}, {"a": 0.2, "b": 5}]
    groups = grouped(rows, ["a"])
    assert [(key, [one["b"] for one in members]) for key, members in groups.items()] == [
        ((None,), [3, 4]),
        ((0.2,), [5]),
        ((0.3,), [1, 2]),
    ]


def test_thresholds_are_those_of_the_law() -> None:
    found = thresholds(adaptive(threshold_law(LIMITS)))
    assert len(found) == 3 * 8
    for one in found:
        limit = LIMITS[one.controller] * OMEGA * edge(one.direction_deg)
        # The four strong replicas carry every level up to the law's limit, and no further.
        assert one.delta_v == pytest.approx(STEP * math.floor(limit / STEP + 1e-9))
        assert one.over_omega_d == pytest.approx(one.delta_v / (OMEGA * edge(one.direction_deg)))
        assert one.no_step == pytest.approx(OMEGA * edge(one.direction_deg))
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


def test_prediction_is_by_the_law_of_the_controller() -> None:
    assert predicted_safe(state("fell", -0.01, 0.02)) is True
    assert predicted_safe(state("fell", -0.01, 0.02), rule="regulator") is False
    assert predicted_safe(state("fell", -0.01, 0.02, controller="regulator")) is False
    assert predicted_safe(state("fell", 0.01, 0.02, controller="statue")) is None
    assert predicted_safe(state("fell", None, None)) is None
    assert predicted_safe(state("fell", -0.01, None)) is False


def test_slack_is_the_best_of_the_sets_that_count() -> None:
    assert signed_slack(state("fell", -0.01, 0.02)) == 0.02
    assert signed_slack(state("fell", -0.01, 0.02, controller="regulator")) == -0.01
    assert signed_slack(state("fell", -0.01, -math.inf)) == -0.01
    assert signed_slack(state("fell", None, -math.inf)) is None
    assert signed_slack(state("fell", 0.01, 0.02, controller="statue")) is None


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
    result = truth([*perfect, wrong, state("recovered", None, None, controller="statue")])
    assert result["false_safe"]["pendulum"]["rate"] == 0.0
    assert result["false_safe"]["humanoid"]["rate"] == 1.0
    by_moment = {
        one["moment"]: one["false_safe"]["n"]
        for one in result["scores"]
        if one["world"] == "humanoid" and one["set"] == "law" and one["direction_deg"] is None
    }
    assert by_moment == {"end": 1, "decision": 0}
    assert {one["controller"] for one in result["scores"]} == {"supervisor"}
    json.dumps(result, allow_nan=False)


def test_regions_part_the_predicted_episodes() -> None:
    rows = [state("recovered", 0.01, 0.02), state("recovered", -0.01, 0.02), state("fell", -0.01, -0.02)]
    regions = [one for one in truth(rows)["regions"] if one["moment"] == "end"]
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
