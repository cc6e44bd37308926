"""What each part of a design is worth: the variants of a suite against its first one, push by push."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sim.analysis.formatting import MISSING, fraction, percent
from sim.analysis.prediction_score import sector
from sim.analysis.statistics import Rate, Row, grouped, paired_p, rate_of, recovered

# More directions than this are sorted into sectors.
_DIRECTIONS = 8
# Beside the seed, which is drawn from all that is asked, these tell episodes apart.
_WHO = ("world", "controller", "whole_body")

Pair = tuple[Any, ...]


def reference_rows(rows: Sequence[Row], sweep: Mapping[str, Any]) -> Sequence[Row]:
    """The rows of the full design, which is a suite's first variant; all rows if there are no variants.

    Args:
        rows: of a sweep, or of the pushes of its trains.
        sweep: what `sweep.json` says of it.
    """
    first = next(iter(sweep.get("variants") or {}), None)
    return rows if first is None else [row for row in rows if row["variant"] == first]


def ablation(rows: Sequence[Row], sweep: Mapping[str, Any]) -> dict[str, Any] | None:
    """The section `ablation` of a summary: each variant's recovery, beside that of the first; None without variants.

    Rates are of all episodes that were run; a comparison is of the pushes that both variants were given. Its p is
    that of the exact McNemar test, for this variant alone.

    Args:
        rows: of a sweep; a train is recovered if it never fell.
        sweep: what `sweep.json` says of it.
    """
    variants: dict[str, Any] = sweep.get("variants") or {}
    if not variants:
        return None
    ways = {way for (way,) in grouped(rows, ["direction_deg"]) if way is not None}
    exact = len(ways) <= _DIRECTIONS
    members = {name: [row for row in rows if row["variant"] == name] for name in variants}
    reference, *others = variants
    crossed = [name for name in _WHO if len(grouped(members[reference], [name])) > 1]
    full = _by_push(members[reference], crossed)
    designs = []
    for name in variants:
        told = [(_way(row["direction_deg"], exact), recovered(row)) for row in members[name]]
        designs.append(
            {
                "variant": name,
                "changes": variants[name],
                "recovered": rate_of(well for _, well in told).as_dict(),
                "by_direction": [
                    {"direction_deg": way, **rate_of(well for there, well in told if there == way).as_dict()}
                    for way in sorted({_way(way, exact) for way in ways})
                ],
                "against": _against(full, _by_push(members[name], crossed)) if name in others else None,
            }
        )
    return {"reference": reference, "sectors": not exact, "designs": designs}


def _way(direction_deg: float | None, exact: bool) -> float:
    if direction_deg is None:
        return float("nan")  # of a train, which has none and so is in no sector
    return round(direction_deg, 9) if exact else float(sector(direction_deg))


def _by_push(rows: Sequence[Row], crossed: Sequence[str]) -> dict[Pair, bool]:
    return {(row["seed"], *(row[name] for name in crossed)): recovered(row) for row in rows}


def _against(full: Mapping[Pair, bool], other: Mapping[Pair, bool]) -> dict[str, Any]:
    """A variant against the full design, over the pushes that both were given."""
    pairs = [(full[key], other[key]) for key in full.keys() & other.keys()]
    lost, gained = (sum(pair == split for pair in pairs) for split in ((True, False), (False, True)))
    return {
        "pairs": len(pairs),
        "lost": lost,
        "gained": gained,
        "difference": (gained - lost) / len(pairs) if pairs else None,
        "p": paired_p(lost, gained) if pairs else None,
    }


def difference_words(against: Mapping[str, Any] | None) -> str:
    """How many percentage points more than the full design are recovered: "−23"."""
    if against is None or against["difference"] is None:
        return MISSING
    return f"{100 * against['difference']:+.0f}".replace("-", "−")


def p_words(against: Mapping[str, Any] | None) -> str:
    """The chance of so uneven a split if the variants were alike."""
    p = None if against is None else against["p"]
    return MISSING if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def split_words(against: Mapping[str, Any] | None) -> str:
    """How many pushes only one of the two recovers: "22 lost, 1 gained"."""
    return MISSING if against is None or not against["pairs"] else f"{against['lost']} lost, {against['gained']} gained"


def ablation_table(section: Mapping[str, Any]) -> str:
    """The section as a table in Markdown, with what its columns mean."""
    designs = section["designs"]
    ways = [f"{one['direction_deg']:g}°" for one in designs[0]["by_direction"]]
    heads = ["variant", "recovered", "[95 %]", "difference", "pushes that differ", "p", *ways]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for one in designs:
        against = one["against"]
        cells = [one["variant"].replace("|", "\\|"), fraction(one["recovered"]), percent(one["recovered"])]
        cells += [difference_words(against), split_words(against), p_words(against)]
        cells += [fraction(there) for there in one["by_direction"]]
        lines.append("| " + " | ".join(cells) + " |")
    what = "sectors of 45° about the directions" if section["sectors"] else "directions"
    note = (
        f"Difference to “{section['reference']}” in percentage points over the pushes that both were given, with p of "
        f"the exact McNemar test, not corrected for the number of variants; the last columns are {what} of the push."
    )
    return "\n".join([*lines, "", note])


def rate(entry: Mapping[str, Any]) -> Rate:
    """The rate of an entry of the section."""
    return Rate(count=entry["count"], n=entry["n"])
