"""What a sweep says in the end: thresholds, rates and the score of the prediction, in `summary.json`."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sim.analysis.ablation import ablation
from sim.analysis.calibration import Calibration
from sim.analysis.calibration_files import calibrations_for
from sim.analysis.endurance import endurance
from sim.analysis.frame import (
    CASE_COLUMNS,
    distinct,
    each_push,
    groups,
    is_finished,
    load_rows,
    recovered,
    reference_rows,
    varying,
)
from sim.analysis.motor_summary import motor_use
from sim.analysis.prediction_score import prediction_score, sector
from sim.analysis.push_limits import push_limits
from sim.analysis.sight import sight
from sim.analysis.statistics import rate, rate_of
from sim.analysis.thresholds import Threshold, holes, thresholds
from sim.results.appearance import looks
from sim.results.table import read_sweep, write_bytes

SUMMARY = "summary.json"

# A column with more values than this was drawn at random: its rates are of ranges of it.
_MOST_VALUES = 24
_RANGES = 8
_FACTS = ("name", "description", "tuned_on", "world", "options", "suite_hash", "seed", "planned", "train", "rest")
_SCALES = ("over_omega_d", "over_sqrt_gh", "delta_v")
_PUSH = ("direction_deg", "delta_v")
_NUMERIC = frozenset({*_PUSH, *CASE_COLUMNS}) - {"robot", "world", "whole_body", "variant", "body", "sensing"}


def summarise(frame: pd.DataFrame, sweep: dict[str, Any], calibrations: Sequence[Calibration] = ()) -> dict[str, Any]:
    """All that is concluded from a sweep, of JSON types.

    Of a train, every push is an episode of `rates` and `prediction_score`. Of a suite with variants, all but `robust`,
    `holes`, `rates` and `ablation` is of the first one alone, which the others are compared with. Of a suite with
    several robots, `by_robot` holds the same for each of them alone; means over all of them say little.

    Means over thresholds of which `robust_capped` are not none are lower bounds: the suite held no harder pushes.

    Args:
        frame: its episodes.
        sweep: what `sweep.json` says of it.
        calibrations: that fit it, by which the probabilities of `prediction_score` are.
    """
    every, full = thresholds(frame), reference_rows(frame, sweep)
    first = next(iter(sweep.get("variants") or {}), None)
    robust = [one for one in every if one.case.get("variant", first) == first]
    names = sorted({one.controller for one in robust})
    found_holes = holes(frame, every)
    own_holes = [hole for hole in found_holes if hole.get("case", {}).get("variant", first) == first]
    pushes = each_push(frame)
    facts = {name: sweep.get(name) for name in _FACTS}
    summary = {
        "suite": facts.pop("name"),
        **facts,
        "finished": is_finished(frame, sweep),
        "versions": sweep.get("versions"),
        "commit": sweep.get("commit"),
        "episodes": len(frame),
        "replicas": int(frame["replica"].max()) + 1,
        "outcomes": {str(name): int(n) for name, n in frame["outcome"].value_counts(sort=False).items()},
        **{f"{name}s": distinct(frame, name) for name in ("robot", "world", "controller")},
        "controllers_shown": {name: look.as_dict() for name, look in looks(frame["controller"], sweep).items()},
        "robust": [one.as_dict() for one in every],
        **{f"robust_{how}_{scale}": _condense(robust, how, scale) for how in ("mean", "worst") for scale in _SCALES},
        "robust_capped": {name: sum(o.capped for o in robust if o.controller == name) for name in names},
        "robust_worst_direction": _worst_directions(robust),
        "holes": found_holes,
        "hole_counts": {name: sum(hole["controller"] == name for hole in own_holes) for name in names},
        "limits": push_limits(full) if robust else [],
        "first": _first(full, sweep.get("first")),
        "endurance": endurance(full),
        "rates": list(_rates(pushes)),
        "prediction_score": prediction_score(reference_rows(pushes, sweep), calibrations, sweep.get("suite_hash")),
        "sight": sight(frame),
        "motors": motor_use(full),
        "ablation": ablation(frame, sweep),
        "by_robot": _by_robot(frame, sweep, calibrations) if frame["robot"].nunique() > 1 else {},
    }
    # As a reader of the file will see it: tuples are lists, and nothing is infinite.
    result: dict[str, Any] = json.loads(json.dumps(summary, allow_nan=False))
    return result


def _by_robot(
    frame: pd.DataFrame, sweep: dict[str, Any], calibrations: Sequence[Calibration]
) -> dict[str, dict[str, Any]]:
    """A summary of each robot alone, which is finished if the sweep is."""
    done = is_finished(frame, sweep)
    return {
        robot: summarise(members, sweep | {"planned": None, "finished": len(members) if done else 0}, calibrations)
        for (robot,), members in groups(frame, ["robot"])
    }


def summary_of(folder: Path, calibration: Path | None = None) -> dict[str, Any]:
    """The summary of a sweep's folder.

    Args:
        folder: of the sweep.
        calibration: file of one; None for those of the checkout that fit.

    Raises:
        InputError: if the folder or the file cannot be read, or they do not go together.
    """
    rows, sweep = load_rows(folder), read_sweep(folder)
    return summarise(rows, sweep, calibrations_for(sweep, calibration))


def write_summary(folder: Path, made: dict[str, Any] | None = None) -> dict[str, Any]:
    """Write the summary of a sweep's folder to its `summary.json`, and return it.

    Args:
        folder: of the sweep.
        made: its summary, if it has been made already.

    Raises:
        ResultsError: if the folder cannot be read, or the file not be written.
    """
    summary = summary_of(folder) if made is None else made
    write_bytes((json.dumps(summary, indent=1, allow_nan=False) + "\n").encode(), folder / SUMMARY)
    return summary


def _condense(robust: list[Threshold], how: str, scale: str) -> dict[str, float]:
    """Mean or least threshold over the directions, and over the cases if there are several, by controller."""
    values = pd.Series([getattr(one, scale) for one in robust], [one.controller for one in robust], dtype=float)
    found = values.dropna().groupby(level=0, sort=False).agg("mean" if how == "mean" else "min")
    return {name: float(value) for name, value in found.items()}


def _worst_directions(robust: list[Threshold]) -> dict[str, float]:
    """Controller -> direction of its least threshold in units of omega d [deg], over all cases."""
    scaled = [one for one in robust if one.over_omega_d is not None]
    names = dict.fromkeys(one.controller for one in scaled)
    worst = {n: min((o for o in scaled if o.controller == n), key=lambda o: o.over_omega_d or 0.0) for n in names}
    return {name: one.direction_deg for name, one in worst.items()}


def _first(frame: pd.DataFrame, first: dict[str, Any] | None) -> dict[str, Any] | None:
    """The push before the one that is asked for: as the suite has it, where to, and who was mid-step after it."""
    if first is None:
        return None
    ways = [way for way in distinct(frame, "first_direction_deg") if way is not None]
    reached = groups(frame[frame["mid_step"].notna()], ["controller"])
    return {
        **first,
        "directions_deg": ways if len(ways) <= _MOST_VALUES else None,
        "mid_step": {name: rate_of(members["mid_step"].astype(bool)) for (name,), members in reached},
    }


def _rates(pushes: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rates of recovery, over all and by what the suite varies."""
    others = varying(pushes)
    labelled = _labelled(pushes, [*_PUSH, *others]).assign(
        count=recovered(pushes), **{name: pushes["outcome"] == name for name in ("fell", "not_settled", "crashed")}
    )
    levels = [[], ["controller"], ["controller", *_PUSH]]
    levels += [["controller", name] for name in (*_PUSH, *others)]
    levels += [["controller", name, "direction_deg"] for name in others]
    for by in levels:
        # A train that crashed has neither direction nor size.
        known = labelled.dropna(subset=[name for name in by if name in _PUSH])
        for values, members in groups(known, by):
            count, *ends = (int(members[name].sum()) for name in ("count", "fell", "not_settled", "crashed"))
            yield {
                "by": dict(zip(by, values, strict=True)),
                **rate(count, len(members)),
                **dict(zip(("fell", "not_settled", "crashed"), ends, strict=True)),
            }


def _labelled(frame: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    """The columns, those that were drawn at random as ranges [low, high) instead, and directions as sectors."""
    found = frame[["controller", *columns]].copy()
    for name in _NUMERIC & set(columns):
        values = frame[name]
        if values.nunique() <= _MOST_VALUES:
            continue
        if name == "direction_deg":
            found[name] = sector(values)
            continue
        low, high = values.min(), values.max()
        # Two digits of a range's width; what rounding leaves beyond an end belongs to the range there.
        edges = np.round(np.linspace(low, high, _RANGES + 1), 1 - math.floor(math.log10((high - low) / _RANGES)))
        inside = values.clip(edges[0], np.nextafter(edges[-1], -np.inf))
        found[name] = pd.cut(inside, pd.IntervalIndex.from_breaks(edges, closed="left"))
    return found
