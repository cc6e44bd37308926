"""What each part of a design is worth: the variants of a suite against its first one, push by push."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from sim.analysis.frame import DIGITS, crashed, distinct, groups, recovered
from sim.analysis.prediction_score import sector
from sim.analysis.statistics import paired_p, rate_of

# More directions than this are sorted into sectors.
_DIRECTIONS = 8
# Beside the seed, which is drawn from all that is asked, these tell episodes apart.
_WHO = ("world", "controller", "whole_body")


def ablation(frame: pd.DataFrame, sweep: Mapping[str, Any]) -> dict[str, Any] | None:
    """The section `ablation` of a summary: each variant's recovery, beside that of the first; None without variants.

    Rates are of all episodes that came to an end, and those that `crashed` are counted beside them. A comparison is of
    the pushes that both variants were given and brought to an end. Its p is that of the exact McNemar test, for this
    variant alone. Of the directions, or sectors of them, each variant has those that it was pushed in.

    Args:
        frame: of a sweep; a train is recovered if it never fell.
        sweep: what `sweep.json` says of it.
    """
    variants: dict[str, Any] = sweep.get("variants") or {}
    if not variants:
        return None
    exact = frame["direction_deg"].round(DIGITS).nunique() <= _DIRECTIONS
    ways = frame["direction_deg"].round(DIGITS) if exact else sector(frame["direction_deg"])
    ended = frame.assign(way=ways, well=recovered(frame))[~crashed(frame)]
    members = {name: ended[ended["variant"] == name] for name in variants}
    reference = next(iter(variants))
    crossed = [name for name in _WHO if len(distinct(members[reference], name)) > 1]
    full = _by_push(members[reference], crossed)
    designs = [
        {
            "variant": name,
            "changes": changes,
            "recovered": rate_of(members[name]["well"]),
            "crashed": int(crashed(frame[frame["variant"] == name]).sum()),
            "by_direction": [
                {"direction_deg": way, **rate_of(there["well"])}
                for (way,), there in groups(members[name].dropna(subset="way"), ["way"])
            ],
            "against": None if name == reference else _against(full, _by_push(members[name], crossed)),
        }
        for name, changes in variants.items()
    ]
    return {"reference": reference, "sectors": not exact, "designs": designs}


def _by_push(members: pd.DataFrame, crossed: list[str]) -> pd.Series:
    return members.drop_duplicates(["seed", *crossed], keep="last").set_index(["seed", *crossed])["well"]


def _against(full: pd.Series, other: pd.Series) -> dict[str, Any]:
    """A variant against the full design, over the pushes that both were given."""
    pairs = pd.concat({"full": full, "other": other}, axis=1, join="inner").astype(bool)
    lost, gained = int((pairs["full"] & ~pairs["other"]).sum()), int((~pairs["full"] & pairs["other"]).sum())
    return {
        "pairs": len(pairs),
        "lost": lost,
        "gained": gained,
        "difference": (gained - lost) / len(pairs) if len(pairs) else None,
        "p": paired_p(lost, gained) if len(pairs) else None,
    }
