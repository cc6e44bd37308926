from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from models.errors import InputError
from sim.analysis.frame import load_rows
from sim.analysis.push_limits import push_limits
from sim.analysis.summary import SUMMARY, summarise, write_summary
from tests.sim.analysis.sweep_tables import (
    DIRECTIONS,
    LIMITS,
    OMEGA,
    adaptive,
    edge,
    folder_of,
    frame,
    row,
    sweep_facts,
    threshold_law,
)


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    return adaptive(threshold_law(LIMITS))


def test_holds_what_is_promised(rows: list[dict[str, Any]]) -> None:
    summary = summarise(frame(rows), sweep_facts(rows))
    assert {
        "robust",
        "robust_mean_over_omega_d",
        "robust_worst_over_omega_d",
        "rates",
        "prediction_score",
    } <= summary.keys()
    for entry in summary["robust"]:
        assert {"controller", "direction_deg", "delta_v", "over_omega_d", "over_sqrt_gh", "ever"} <= entry.keys()
    for name in LIMITS:
        own = [entry["over_omega_d"] for entry in summary["robust"] if entry["controller"] == name]
        assert len(own) == len(DIRECTIONS)
        assert summary["robust_mean_over_omega_d"][name] == pytest.approx(sum(own) / 8)
        assert summary["robust_worst_over_omega_d"][name] == min(own)
    for name in ("false_safe", "false_alarm"):
        rate = summary["prediction_score"][name]["humanoid"]
        low, high = rate["interval"]
        assert low <= rate["rate"] <= high
        assert rate["n"] > 0
    assert summary["finished"]
    assert summary["robust_capped"] == dict.fromkeys(LIMITS, 0)
    assert not summarise(frame(rows[:-1]), sweep_facts(rows))["finished"]


def test_rates_part_the_episodes_at_every_level(rows: list[dict[str, Any]]) -> None:
    rates = summarise(frame(rows), sweep_facts(rows))["rates"]
    levels: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for entry in rates:
        levels.setdefault(tuple(entry["by"]), []).append(entry)
    assert set(levels) >= {
        (),
        ("controller",),
        ("controller", "direction_deg"),
        ("controller", "delta_v"),
        ("controller", "direction_deg", "delta_v"),
    }
    good = sum(one["outcome"] == "recovered" for one in rows)
    for entries in levels.values():
        assert (sum(one["n"] for one in entries), sum(one["count"] for one in entries)) == (len(rows), good)
        assert all(one["count"] + one["fell"] + one["not_settled"] + one["crashed"] == one["n"] for one in entries)


def test_axes_that_vary_are_grouped_by(rows: list[dict[str, Any]]) -> None:
    light = adaptive(threshold_law(LIMITS), mass_scale=0.9, directions=[0.0])
    rates = summarise(frame([*rows, *light]), sweep_facts(rows))["rates"]
    found = {one["by"]["mass_scale"]: one["n"] for one in rates if list(one["by"]) == ["controller", "mass_scale"]}
    assert set(found) == {0.9, 1.0}


def test_random_pushes_are_grouped_by_ranges() -> None:
    def law(asked: Any) -> bool:
        return bool(asked["delta_v"] < 0.3)

    many = [
        row(
            law,
            direction_deg=(37.7 * i) % 360,
            delta_v=0.001 * (i + 1),
            duration=0.05 + 0.0001 * i,
            height=0.000253 * (200 - i),
        )
        for i in range(400)
    ]
    summary = summarise(frame(many), sweep_facts(many))
    assert summary["robust"] == summary["limits"] == []
    assert summary["robust_mean_over_omega_d"] == {}
    sizes = [one for one in summary["rates"] if list(one["by"]) == ["controller", "delta_v"]]
    assert len(sizes) == 8
    assert sum(one["n"] for one in sizes) == 400
    assert all(one["by"]["delta_v"][0] < one["by"]["delta_v"][1] for one in sizes)
    heights = [one["by"]["height"] for one in summary["rates"] if list(one["by"]) == ["controller", "height"]]
    assert heights == sorted(heights)
    assert heights[0] == [-0.05, -0.038]
    ways = {
        one["by"]["direction_deg"] for one in summary["rates"] if list(one["by"]) == ["controller", "direction_deg"]
    }
    assert ways == set(range(0, 360, 45))


def test_limits_are_the_pendulums(rows: list[dict[str, Any]]) -> None:
    for limit in push_limits(frame(rows)):
        no_step, steps, way = (limit[name] for name in ("no_step_delta_v", "n_step_delta_v", "direction_deg"))
        assert no_step == pytest.approx(OMEGA * edge(way))
        # Koolen's recursion for what the table's scenario allows: straight steps of 0.16 m, quarters of a second.
        if way in (0.0, 180.0):
            d, shrink = edge(0.0), math.exp(-OMEGA * 0.25)
            first = d + 0.16 * shrink
            second = d + (0.16 + first - d) * shrink
            assert steps[:2] == pytest.approx((OMEGA * first, OMEGA * second))
        assert steps == sorted(steps)
        assert no_step < steps[0]
        assert limit["n_step_over_omega_d"] == pytest.approx([step / no_step for step in steps])


def test_limits_without_the_robot_are_those_without_a_step(rows: list[dict[str, Any]]) -> None:
    gone = [one | {"robot": "robot_that_is_gone"} for one in rows]
    assert [limit["n_step_delta_v"] for limit in push_limits(frame(gone))] == [[]] * len(DIRECTIONS)


def test_is_written(tmp_path: Path, rows: list[dict[str, Any]]) -> None:
    folder = folder_of(tmp_path / "sweep", rows)
    summary = write_summary(folder)
    assert json.loads((folder / SUMMARY).read_text()) == summary


def test_robots_are_summarised_apart(rows: list[dict[str, Any]]) -> None:
    weak = adaptive(threshold_law({name: 0.5 * limit for name, limit in LIMITS.items()}), robot="gone")
    assert summarise(frame(rows), sweep_facts(rows))["by_robot"] == {}
    summary = summarise(frame([*rows, *weak]), sweep_facts([*rows, *weak]))
    assert list(summary["by_robot"]) == summary["robots"] == ["gone", "utmu2"]
    for robot, members in (("utmu2", rows), ("gone", weak)):
        alone = summarise(frame(members), sweep_facts(members))
        assert summary["by_robot"][robot] == alone | {"planned": None}


def test_crashed_rows_are_counted_not_scored() -> None:
    nothing = {name: None for name in row(lambda _: True) if name.endswith(("_end", "_decision"))}
    rows = [row(lambda _: True, replica=i) for i in range(3)]
    rows[0] |= nothing | {"outcome": "crashed", "delivered_impulse": None, "outside_all": None}
    summary = summarise(frame(rows), sweep_facts(rows))
    assert summary["outcomes"] == {"crashed": 1, "recovered": 2}
    assert summary["prediction_score"]["confusion"]["humanoid"]["not_predicted"] == 1


def test_damage_is_one_line(tmp_path: Path, rows: list[dict[str, Any]]) -> None:
    with pytest.raises(InputError, match="not the folder of a sweep"):
        load_rows(tmp_path / "nowhere")
    folder = folder_of(tmp_path / "sweep", rows[:9])
    table = folder / "results.parquet"
    content = bytearray(table.read_bytes())
    content[len(content) // 3] ^= 0xFF
    table.write_bytes(content)
    with pytest.raises(InputError) as caught:
        write_summary(folder)
    assert str(table) in str(caught.value)
    assert "\n" not in str(caught.value)
