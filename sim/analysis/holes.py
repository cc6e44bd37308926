"""Holes: pushes that fell the robot although they are far weaker than those that it recovers from again and again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from sim.analysis.frame import crashed, groups, records, recovered
from sim.analysis.thresholds import Threshold

HOLE_SHARE = 0.75
"""Share of its direction's robust threshold below which a push that is lost is a hole."""

# Three quarters of a level that is a decimal fraction may be a level itself.
_ROUNDING = 1e-9
_COLUMNS = ["episode", "controller", "direction_deg", "replica", "delta_v", "outcome", "reason"]


def holes(frame: pd.DataFrame, robust: Sequence[Threshold]) -> list[dict[str, Any]]:
    """Every episode, of any replica, that was lost below `HOLE_SHARE` of its robust threshold.

    One that crashed is not lost: nobody knows how its push would have ended.

    Args:
        frame: a table.
        robust: its thresholds.
    """
    if not robust:
        return []
    lost = dict(groups(frame[~recovered(frame) & ~crashed(frame)], ["controller", "direction_deg", *robust[0].case]))
    found = []
    for one in robust:
        members = lost.get((one.controller, one.direction_deg, *one.case.values()), frame[:0])
        for row in records(members.loc[members["delta_v"] < HOLE_SHARE * one.delta_v - _ROUNDING, _COLUMNS]):
            case = {"case": one.case} if one.case else {}
            found.append({**row, **case, "of_threshold": row["delta_v"] / one.delta_v})
    return sorted(found, key=lambda entry: (entry["controller"], entry["of_threshold"], entry["episode"]))
