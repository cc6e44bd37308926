"""Holes, the worst direction, and the motors: what a summary says beside the thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from sim.analysis.motor_summary import motor_use
from sim.analysis.summary import summarise
from sim.analysis.thresholds import HOLE_SHARE, holes, thresholds
from sim.presenter.render import print_sections
from sim.presenter.sections import sections
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import LIMITS, OMEGA, adaptive, edge, folder_of, frame, row, sweep_facts


def law(asked: Mapping[str, Any]) -> bool:
    """All replicas alike: what a controller loses is what it loses always."""
    return bool(asked["delta_v"] <= LIMITS[asked["controller"]] * OMEGA * edge(asked["direction_deg"]))


def swept() -> list[dict[str, Any]]:
    return adaptive(law, replicas=5)


def fell(rows: list[dict[str, Any]], delta_v: float, replica: int, controller: str = "supervisor") -> dict[str, Any]:
    """Let the push forward of this size and replica be lost; one of five is no threshold."""
    found = next(
        one
        for one in rows
        if (one["controller"], one["direction_deg"], one["replica"]) == (controller, 0.0, replica)
        and abs(one["delta_v"] - delta_v) < 1e-9
    )
    found |= {"outcome": "fell", "reason": "trunk tilted by more than 75 degrees", "time_of_fall": 2.0}
    return found


def forward(rows: list[dict[str, Any]]) -> float:
    return next(t.delta_v for t in thresholds(frame(rows)) if (t.controller, t.direction_deg) == ("supervisor", 0.0))


def test_no_holes_where_every_weaker_push_is_recovered() -> None:
    assert holes(frame(swept()), thresholds(frame(swept()))) == []


def test_hole_is_a_lost_push_below_three_quarters_of_the_threshold() -> None:
    rows = swept()
    limit = forward(rows)
    assert limit == pytest.approx(0.6)  # 1.5 omega d, 0.6 m/s; three quarters of it are the level 0.45 m/s
    for delta_v, found in ((0.5, []), (0.45, []), (0.4, [0.4])):
        tried = swept()
        lost = fell(tried, delta_v, replica=2)
        assert forward(tried) == limit
        told = holes(frame(tried), thresholds(frame(tried)))
        assert [one["delta_v"] for one in told] == found
        for one in told:
            assert one["episode"] == lost["episode"]
            assert one["of_threshold"] == pytest.approx(delta_v / limit)
            assert one["of_threshold"] < HOLE_SHARE


def test_two_of_five_are_no_hole_but_a_lower_threshold() -> None:
    rows = swept()
    fell(rows, 0.2, replica=0)
    fell(rows, 0.2, replica=1)
    assert forward(rows) == pytest.approx(0.15)
    assert holes(frame(rows), thresholds(frame(rows))) == []


def test_crash_is_no_hole() -> None:
    rows = swept()
    fell(rows, 0.2, replica=0)["outcome"] = "crashed"
    assert holes(frame(rows), thresholds(frame(rows))) == []


def test_cases_have_holes_of_their_own() -> None:
    light = adaptive(law, mass_scale=0.9)
    rows = swept() + light
    fell(light, 0.2, replica=1)
    (one,) = holes(frame(rows), thresholds(frame(rows)))
    assert one["case"] == {"mass_scale": 0.9}


def test_summary_and_report_count_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = swept()
    lost = fell(rows, 0.1, replica=3)
    fell(rows, 0.05, replica=0, controller="regulator")
    summary = summarise(frame(rows), sweep_facts(rows))
    assert summary["hole_counts"] == {"supervisor": 1, "regulator": 1, "statue": 0}
    assert [one["controller"] for one in summary["holes"]] == ["regulator", "supervisor"]
    print_sections(sections(summary), Console(width=80, force_terminal=False))
    printed = capsys.readouterr().out
    assert "holes" in printed
    assert max(map(len, printed.splitlines())) <= 80
    folder = folder_of(tmp_path / "sweep", rows)
    write_report(folder, folder / REPORT, failures=0)
    page = (folder / REPORT).read_text(encoding="utf-8")
    assert "Holes, all of them" in page
    assert f">{lost['episode']}</td>" in page
    assert "<b>1</b><span>holes of the supervisor" in page


def test_worst_direction_is_that_of_the_least_threshold() -> None:
    def weaker(asked: Mapping[str, Any]) -> bool:
        weak = asked["controller"] == "supervisor" and asked["direction_deg"] == 225.0
        return law(asked) and not (weak and asked["delta_v"] > 0.9 * OMEGA * edge(225.0))

    rows = adaptive(weaker)
    summary = summarise(frame(rows), sweep_facts(rows))
    assert summary["robust_worst_direction"]["supervisor"] == 225.0
    own = [one["over_omega_d"] for one in summary["robust"] if one["controller"] == "supervisor"]
    assert summary["robust_worst_over_omega_d"]["supervisor"] == min(own)
    scaled = [one["over_sqrt_gh"] for one in summary["robust"] if one["controller"] == "supervisor"]
    assert summary["robust_mean_over_sqrt_gh"]["supervisor"] == pytest.approx(sum(scaled) / 8)


def test_motors_are_of_what_was_recovered() -> None:
    rows = [row(lambda _: True, replica=i) for i in range(3)] + [row(lambda _: False, replica=3)]
    for one, use, time in zip(rows, (0.5, 0.9, 0.7, 1.0), (0.0, 0.02, 0.5, 9.0), strict=True):
        one |= {"peak_torque_use": use, "peak_torque": 5 * use, "peak_torque_joint": f"joint {use}"}
        one |= {"saturated_time": time, "saturated_joint": f"joint {time}" if time else None}
    (found,) = motor_use(frame(rows))
    assert (found["controller"], found["n"]) == ("supervisor", 3)
    assert found["peak_torque_use"] == {"median": 0.7, "max": 0.9, "joint": "joint 0.9", "peak": 4.5}
    assert found["saturated_time"] == {"median": 0.02, "max": 0.5, "joint": "joint 0.5"}
    nothing = dict.fromkeys(name for name in rows[0] if name.startswith(("peak_", "saturated_")))
    assert motor_use(frame([row(lambda _: True, world="pendulum") | nothing])) == []
