"""What the sets said of a push: at its end, and when the regulator was given up because of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.episode.push_record import PushRecord

_SETS = ("regulator_slack", "tracking_slack", "in_regulator_set", "in_tracking_set")
# Times are sums of many periods.
_ROUNDING = 1e-9


def prediction_columns(
    push: PushRecord, decisions: Sequence[Mapping[str, Any]], until: float = math.inf
) -> dict[str, Any]:
    """The columns of a table that say what was predicted of a push, and who answered it.

    Args:
        push: what became of it.
        decisions: of the episode.
        until: when the next push begins [s].
    """
    row = {
        "regulator_slack_end": _number(push.regulator_slack),
        "tracking_slack_end": _number(push.tracking_slack),
        "in_regulator_set_end": push.in_regulator_set,
        "in_tracking_set_end": push.in_tracking_set,
        "chosen": push.chosen,
    }
    return row | _decided(row, decisions, push.start, until)


def _decided(
    row: Mapping[str, Any], decisions: Sequence[Mapping[str, Any]], start: float, until: float
) -> dict[str, Any]:
    """What the sets said when the regulator was given up; if it never was, at the end of the push."""
    for decision in decisions:
        if not start - _ROUNDING <= decision["time"] < until - _ROUNDING:
            continue
        if decision["phase"] == "stepping" or decision["outside_all"]:
            found = {name: decision[name] for name in _SETS}
            # No step within reach is no set to be in.
            if found["tracking_slack"] is None:
                found["tracking_slack"] = -math.inf
            return {f"{name}_decision": value for name, value in found.items()} | {
                "outside_all": decision["outside_all"]
            }
    found = {f"{name}_decision": row[f"{name}_end"] for name in _SETS}
    inside = (row["in_regulator_set_end"], row["in_tracking_set_end"])
    return found | {"outside_all": None if inside == (None, None) else not any(inside)}


def _number(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else float(value)
