"""Robust recoverable push: by direction, the change of velocity below which pushes are recovered again and again.

And its holes: pushes that fell the robot although they are far weaker.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from sim.analysis.frame import DIGITS, crashed, groups, plain, records, recovered, varying

ROBUST_SHARE = 0.8
"""Share of a level's replicas that must be recovered."""
HOLE_SHARE = 0.75
"""Share of its direction's robust threshold below which a push that is lost is a hole."""

_SERIES = ["controller", "direction_deg"]
_LOST = ["episode", "controller", "direction_deg", "replica", "delta_v", "outcome", "reason"]
# 4 of 5 as a float must count as 0.8, and three quarters of a level that is a decimal fraction may be a level itself.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """How hard a controller can be pushed in a direction.

    Attributes:
        controller: who answers.
        direction_deg: of the push, 0 forward, 90 left [deg].
        case: column -> value of what else distinguishes it within the table.
        delta_v: largest change of velocity of which, and of all below it, `least_of` the replicas are recovered [m/s].
        ever: largest change of velocity ever recovered [m/s].
        over_omega_d: delta_v / (omega d); the no-step limit is 1. None where the table does not say.
        over_sqrt_gh: delta_v / sqrt(g h); None likewise.
        ever_over_omega_d, ever_over_sqrt_gh: the same of `ever`.
        no_step_delta_v: omega d [m/s]; None likewise.
        step: spacing of the levels at the threshold [m/s].
        index: number of levels up to the threshold.
        capped: the highest level of the table is still recovered, so the true threshold is not below this one.
    """

    controller: str
    direction_deg: float
    case: dict[str, Any]
    delta_v: float
    ever: float
    over_omega_d: float | None
    over_sqrt_gh: float | None
    ever_over_omega_d: float | None
    ever_over_sqrt_gh: float | None
    no_step_delta_v: float | None
    step: float
    index: int
    capped: bool

    @property
    def key(self) -> tuple[Any, ...]:
        """What the same threshold of another table agrees in."""
        return self.controller, self.direction_deg, *self.case.items()

    def as_dict(self) -> dict[str, Any]:
        """The entry of `robust` in a summary; without a case if there is one only."""
        return {name: value for name, value in asdict(self).items() if name != "index" and (name != "case" or value)}


def least_of(replicas: int) -> int:
    """How many of so many replicas must be recovered: at least `ROBUST_SHARE` of them, rounded up."""
    return math.ceil(ROBUST_SHARE * replicas - _ROUNDING)


def thresholds(frame: pd.DataFrame, beside: pd.DataFrame | None = None) -> list[Threshold]:
    """The threshold of every controller, direction and case of a table.

    A level holds if at least `least_of` its replicas are recovered; replicas that are missing or crashed are not.
    Levels that a series never reached, but another of its direction did, count as not recovered: an adaptive suite
    stops a series that only fails.
    A table without levels, such as one of random pushes, has no thresholds.

    Args:
        frame: the table.
        beside: a table to compare with: its levels are counted too, and cases are told apart as in both.
    """
    both = pd.concat([frame.assign(own=True), *([] if beside is None else [beside.assign(own=False)])])
    both = both.assign(
        well=recovered(both),
        per_omega_d=_scale(both, "delta_v_over_omega_d"),
        per_sqrt_gh=_scale(both, "delta_v_over_sqrt_gh"),
        **both[["direction_deg", "delta_v"]].round(DIGITS),
    ).reset_index(drop=True)
    columns, found = varying(both), []
    if columns:
        # Of pushes drawn at random each is a case of its own, which takes long to find one by one.
        cases = both.assign(**both[columns].round(DIGITS)).groupby(columns, dropna=False)
        both = both[cases["delta_v"].transform("nunique") > 1]
    for case, tried in groups(both, columns):
        own = tried[tried["own"]]
        levels = own.groupby([*_SERIES, "delta_v"])["well"].agg(["sum", "size"])
        series = own.groupby(_SERIES)[["per_omega_d", "per_sqrt_gh"]].median()
        if levels.empty or len(levels) < 2 * len(series):
            continue
        least = least_of(int(levels["size"].max()))
        for (controller, way), medians in series.iterrows():
            ladder = np.unique(tried.loc[tried["direction_deg"] == way, "delta_v"]).tolist()
            counts = levels.loc[(controller, way), "sum"].reindex(ladder, fill_value=0).tolist()
            what = {"controller": controller, "direction_deg": way, "case": dict(zip(columns, case, strict=True))}
            found.append(_threshold(what, dict(zip(ladder, counts, strict=True)), least, *map(plain, medians)))
    return sorted(found, key=lambda one: (str(one.case), one.controller, one.direction_deg))


def _threshold(
    what: dict[str, Any], counts: dict[float, int], least: int, per_omega_d: float | None, per_sqrt_gh: float | None
) -> Threshold:
    ladder = [0.0, *counts]
    index = next((i for i, count in enumerate(counts.values()) if count < least), len(counts))
    sizes = {"": ladder[index], "ever_": max((level for level, count in counts.items() if count), default=0.0)}
    last = min(index + 1, len(counts))
    scaled: dict[str, Any] = {
        f"{name}{scale}": None if factor is None else size * factor
        for name, size in sizes.items()
        for scale, factor in (("over_omega_d", per_omega_d), ("over_sqrt_gh", per_sqrt_gh))
    }
    return Threshold(
        **what,
        **scaled,
        delta_v=sizes[""],
        ever=sizes["ever_"],
        no_step_delta_v=None if per_omega_d is None else 1.0 / per_omega_d,
        step=round(ladder[last] - ladder[last - 1], DIGITS),
        index=index,
        capped=index == len(counts),
    )


def _scale(frame: pd.DataFrame, column: str) -> pd.Series:
    """What a change of velocity is multiplied by to be that of `column`; NaN where the row does not say."""
    scale = frame[column] / frame["delta_v"]
    return scale.where(np.isfinite(scale) & (frame[column] > 0.0))


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
        for row in records(members.loc[members["delta_v"] < HOLE_SHARE * one.delta_v - _ROUNDING, _LOST]):
            case = {"case": one.case} if one.case else {}
            found.append({**row, **case, "of_threshold": row["delta_v"] / one.delta_v})
    return sorted(found, key=lambda entry: (entry["controller"], entry["of_threshold"], entry["episode"]))
