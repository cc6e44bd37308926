"""Which failures a report shows, and what it says of them."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import pytest

from sim.report import failures
from sim.report.failures import Failure
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import CONTROLLERS, LIMITS, adaptive, folder_of, frame, row, threshold_law


def worst_failures(rows: list[dict[str, Any]], count: int) -> list[Failure]:
    return failures.worst_failures(frame(rows), count)


def test_worst_failures_are_the_weakest_pushes_and_the_broken_promises() -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"])
    found = worst_failures(rows, 4)
    lost = [one for one in rows if one["outcome"] != "recovered"]
    assert found[0].row["delta_v_over_omega_d"] == min(one["delta_v_over_omega_d"] for one in lost)
    assert "weakest" in found[0].why
    assert len({(one.row["direction_deg"], one.row["delta_v"]) for one in found}) == 4
    crash = next(one for one in rows if one["delta_v"] == 0.2)
    crash["outcome"] = "crashed"
    assert worst_failures(rows, 4)[0].row["episode"] == crash["episode"]
    assert worst_failures(rows, 0) == []
    assert worst_failures([one for one in rows if one["outcome"] == "recovered"], 4) == []


def test_lost_though_predicted_safe_is_shown() -> None:
    rows = adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=9)
    for one in rows:
        one["in_tracking_set_end"] = None
        one["outcome"] = "fell" if one["delta_v"] > 0.12 else "recovered"
    rows[-1] |= {"regulator_slack_end": 0.05, "in_regulator_set_end": True}
    weakest, surprise = worst_failures(rows, 2)
    assert weakest.row["delta_v"] == pytest.approx(0.15)
    assert (surprise.row["episode"], surprise.why) == (
        rows[-1]["episode"],
        "Predicted safe, with 50.0 mm of slack, and lost",
    )


def test_lost_though_recovery_was_likely_is_shown_with_the_probability() -> None:
    rows = adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=9)
    for one in rows:
        one["outcome"] = "fell" if one["delta_v"] > 0.12 else "recovered"
    pushes = frame(rows)
    likely = 0.3 + 0.6 * (pushes["episode"] == rows[-1]["episode"])
    _, surprise = failures.worst_failures(pushes.assign(probability=likely), 2)
    assert (surprise.row["episode"], surprise.why) == (
        rows[-1]["episode"],
        "Predicted safe, recovery told to be 90 % likely, and lost",
    )


@pytest.mark.parametrize(("levels", "asked"), [(3, 4), (9, 0)])
def test_report_without_failures_says_why(tmp_path: Path, levels: int, asked: int) -> None:
    variants: dict[str, dict[str, Any]] = {"full": {}, "weak": {}}
    rows = [
        one
        for name, limit in (("full", 1.0), ("weak", 0.2))
        for one in adaptive(threshold_law({"supervisor": limit}), controllers=["supervisor"], directions=[0.0])
        if one["delta_v"] < 0.05 * levels + 0.01
        for one in [one | {"variant": name, "episode": f"{name}{one['episode']}"[:12]}]
    ]
    # Shown first, but not what the first variant has.
    rows.append(rows[-1] | {"controller": "regulator", "variant": "weak", "episode": "other"})
    facts = {"variants": variants, "controllers": dict(reversed(CONTROLLERS.items()))}
    assert "fell" in {one["outcome"] for one in rows}
    folder = folder_of(tmp_path / "sweep", rows, **facts)
    write_report(folder, folder / REPORT, failures=asked)
    text = html.unescape((folder / REPORT).read_text(encoding="utf-8"))
    own = [one for one in rows if one["variant"] == "full"]
    lost = sum(one["outcome"] != "recovered" for one in own)
    if asked:
        assert f"None: “full” (supervisor) recovered from all of its {len(own)} pushes." in text
    else:
        assert lost
        assert f"for 0 were asked for: “full” (supervisor) did not recover from {lost} of its {len(own)} pushes" in text


def test_sets_in_words() -> None:
    one = row(lambda _: True) | {"regulator_slack_end": -0.0123, "tracking_slack_end": float("-inf")}
    assert Failure(row=one, why="").sets == "regulator set -12.3 mm, tracking set no step within reach"
    none = {"in_regulator_set_end": None, "in_tracking_set_end": None}
    assert Failure(row=one | none, why="").sets == "no set was asked"
