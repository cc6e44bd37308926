"""Holes: pushes that fell the robot although they are far weaker than those that it recovers from again and again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sim.analysis.statistics import Row, grouped, recovered
from sim.analysis.thresholds import Threshold

HOLE_SHARE = 0.75
"""Share of its direction's robust threshold below which a push that is lost is a hole."""

# Three quarters of a level that is a decimal fraction may be a level itself.
_ROUNDING = 1e-9


def holes(rows: Sequence[Row], robust: Sequence[Threshold]) -> list[dict[str, Any]]:
    """Every episode, of any replica, that was not recovered below `HOLE_SHARE` of its robust threshold.

    Args:
        rows: a table.
        robust: its thresholds.
    """
    if not robust:
        return []
    columns = list(robust[0].case)
    members = grouped(rows, ["controller", "direction_deg", *columns])
    found = []
    for one in robust:
        most = HOLE_SHARE * one.delta_v - _ROUNDING
        for row in members[(one.controller, one.direction_deg, *one.case.values())]:
            if row["delta_v"] < most and not recovered(row):
                found.append(_entry(row, one))
    return sorted(found, key=lambda entry: (entry["controller"], entry["of_threshold"], entry["episode"]))


def _entry(row: Row, one: Threshold) -> dict[str, Any]:
    return {
        **{name: row[name] for name in ("episode", "controller", "direction_deg", "replica", "delta_v")},
        **({"case": one.case} if one.case else {}),
        "of_threshold": row["delta_v"] / one.delta_v,
        "outcome": row["outcome"],
        "reason": row["reason"],
    }
