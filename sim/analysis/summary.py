"""What a sweep says in the end: thresholds, rates and the truth of the prediction, in `summary.json`."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sim.analysis.ablation import ablation, reference_rows
from sim.analysis.endurance import endurance
from sim.analysis.holes import holes
from sim.analysis.motor_summary import motor_use
from sim.analysis.prediction_score import sector, truth
from sim.analysis.push_limits import push_limits
from sim.analysis.statistics import Row, grouped, number, rate_of, recovered
from sim.analysis.thresholds import CASE_COLUMNS, Threshold, thresholds, varying
from sim.results.table import read_results, read_sweep, write_bytes
from sim.results.train import each_push

SUMMARY = "summary.json"

# What only a closer look at one episode needs; long, and not wanted ten thousand times in memory.
_BULKY = frozenset({"traceback", "trace_hash"})
# A column with more values than this was drawn at random: its rates are of ranges of it.
_MOST_VALUES = 24
_RANGES = 8


def load_rows(folder: Path, *, all_columns: bool = False) -> list[dict[str, Any]]:
    """The episodes of a sweep's folder.

    Args:
        folder: of a sweep.
        all_columns: also those that only a closer look at one episode needs.

    Raises:
        ResultsError: if there are none, or a file is damaged.
    """
    table = read_results(folder)
    rows: list[dict[str, Any]] = table.select(
        [name for name in table.schema.names if all_columns or name not in _BULKY]
    ).to_pylist()
    return rows


def is_finished(rows: Sequence[Row], sweep: dict[str, Any]) -> bool:
    """Whether a sweep has run all that its suite asks for: only then does `sweep.json` know how many that were."""
    return bool(sweep.get("finished") == len(rows))


def summarise(rows: Sequence[Row], sweep: dict[str, Any]) -> dict[str, Any]:
    """All that is concluded from a sweep, of JSON types.

    Of a train, every push is an episode of `rates` and `truth`. Of a suite with variants, all but `robust`, `holes`,
    `rates` and `ablation` is of the first one alone, which the others are compared with.

    Means over thresholds of which `robust_capped` are not none are lower bounds: the suite held no harder pushes.

    Args:
        rows: its episodes.
        sweep: what `sweep.json` says of it.
    """
    every, full = thresholds(rows), reference_rows(rows, sweep)
    first = next(iter(sweep.get("variants") or {}), None)
    robust = [one for one in every if one.case.get("variant", first) == first]
    names = sorted({one.controller for one in robust})
    found_holes = holes(rows, every)
    own_holes = [hole for hole in found_holes if hole.get("case", {}).get("variant", first) == first]
    pushes = each_push(rows)
    facts = {name: sweep.get(name) for name in _FACTS}
    summary = {
        "suite": facts.pop("name"),
        **facts,
        "finished": is_finished(rows, sweep),
        "versions": sweep.get("versions"),
        "commit": sweep.get("commit"),
        "episodes": len(rows),
        "outcomes": dict(Counter(str(row["outcome"]) for row in rows)),
        **{f"{name}s": [value for (value,) in grouped(rows, [name])] for name in ("robot", "world", "controller")},
        "robust": [one.as_dict() for one in every],
        **{f"robust_{how}_{scale}": _condense(robust, how, scale) for how in ("mean", "worst") for scale in _SCALES},
        "robust_capped": {name: sum(o.capped for o in robust if o.controller == name) for name in names},
        "robust_worst_direction": _worst_directions(robust),
        "holes": found_holes,
        "hole_counts": {name: sum(hole["controller"] == name for hole in own_holes) for name in names},
        "limits": [limit.as_dict() for limit in (push_limits(full) if robust else [])],
        "first": _first(full, sweep.get("first")),
        "endurance": endurance(full),
        "rates": list(_rates(pushes)),
        "truth": truth(reference_rows(pushes, sweep)),
        "motors": motor_use(full),
        "ablation": ablation(rows, sweep),
    }
    # As a reader of the file will see it: tuples are lists, and nothing is infinite.
    result: dict[str, Any] = json.loads(json.dumps(summary, allow_nan=False))
    return result


def write_summary(folder: Path) -> dict[str, Any]:
    """Summarise a sweep's folder into its `summary.json`, and return what was written.

    Raises:
        ResultsError: if the folder cannot be read, or the file not be written.
    """
    summary = summarise(load_rows(folder), read_sweep(folder))
    write_bytes((json.dumps(summary, indent=1, allow_nan=False) + "\n").encode(), folder / SUMMARY)
    return summary


def print_summary(summary: dict[str, Any]) -> None:
    """Print thresholds, rates and truth as tables in the terminal."""
    from sim.analysis.summary_table import show

    show(summary)


_FACTS = ("name", "description", "tuned_on", "world", "suite_hash", "seed", "planned", "train")
_SCALES = ("over_omega_d", "over_sqrt_gh", "delta_v")


def _condense(robust: list[Threshold], how: str, scale: str) -> dict[str, float]:
    """Mean or least threshold over the directions, and over the cases if there are several, by controller."""
    values: dict[str, list[float]] = {}
    for one in robust:
        value = getattr(one, scale)
        if value is not None:
            values.setdefault(one.controller, []).append(value)
    return {name: float(np.mean(found)) if how == "mean" else min(found) for name, found in values.items()}


def _worst_directions(robust: list[Threshold]) -> dict[str, float]:
    """Controller -> direction of its least threshold in units of omega d [deg], over all cases."""
    worst: dict[str, Threshold] = {}
    for one in robust:
        if one.over_omega_d is not None:
            least = worst.setdefault(one.controller, one)
            if one.over_omega_d < (least.over_omega_d or 0.0):
                worst[one.controller] = one
    return {name: one.direction_deg for name, one in worst.items()}


def _first(rows: Sequence[Row], first: dict[str, Any] | None) -> dict[str, Any] | None:
    """The push before the one that is asked for: as the suite has it, where to, and who was mid-step after it."""
    if first is None:
        return None
    ways = [way for (way,) in grouped(rows, ["first_direction_deg"]) if way is not None]
    reached = [row for row in rows if row.get("mid_step") is not None]
    return {
        **first,
        "directions_deg": ways if len(ways) <= _MOST_VALUES else None,
        "mid_step": {
            name: rate_of(bool(row["mid_step"]) for row in members).as_dict()
            for (name,), members in grouped(reached, ["controller"]).items()
        },
    }


def _rates(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    columns = ["direction_deg", "delta_v", *varying(rows)]
    labelled = _labelled(rows, columns)
    levels = [[], ["controller"], ["controller", "direction_deg", "delta_v"]]
    levels += [["controller", name] for name in columns]
    levels += [["controller", name, "direction_deg"] for name in varying(rows)]
    for by in levels:
        # A train that crashed has neither direction nor size.
        known = [row for row in labelled if all(row[name] is not None for name in by if name in columns[:2])]
        for values, members in grouped(known, by).items():
            counts = Counter(str(row["outcome"]) for row in members)
            yield {
                "by": dict(zip(by, values, strict=True)),
                **rate_of(map(recovered, members)).as_dict(),
                **{name: counts.get(name, 0) for name in ("fell", "not_settled", "crashed")},
            }


def _labelled(rows: Sequence[Row], columns: Sequence[str]) -> list[Row]:
    """Rows whose columns that were drawn at random hold ranges [low, high] instead, and sectors for directions."""
    changed: list[dict[str, Any]] = [dict(row) for row in rows]
    for name in columns:
        values = [number(row[name]) for row in rows] if name in _NUMERIC else []
        known = [value for value in values if value is not None]
        if len(set(known)) <= _MOST_VALUES:
            continue
        low, high = min(known), max(known)
        # Two digits of a range's width; what rounding leaves beyond an end belongs to the range there.
        edges = np.round(np.linspace(low, high, _RANGES + 1), 1 - math.floor(math.log10((high - low) / _RANGES)))
        for row, value in zip(changed, values, strict=True):
            if value is None:
                continue
            if name == "direction_deg":
                row[name] = sector(value)
            else:
                i = int(np.clip(np.searchsorted(edges, value, side="right") - 1, 0, _RANGES - 1))
                row[name] = (float(edges[i]), float(edges[i + 1]))
    return list(changed)


_NUMERIC = frozenset({"direction_deg", "delta_v", *CASE_COLUMNS}) - {"robot", "world", "whole_body", "variant", "body"}
