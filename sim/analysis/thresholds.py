"""Robust recoverable push: by direction, the change of velocity below which pushes are recovered again and again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from sim.analysis.statistics import Rate, Row, grouped, number, recovered

ROBUST_SHARE = 0.8
"""Share of a level's replicas that must be recovered: 4 of 5."""
CASE_COLUMNS = (
    "robot",
    "world",
    "whole_body",
    "variant",
    "body",
    "duration",
    "start",
    "height",
    "mass_scale",
    "friction",
    "delay",
    "noise_position",
    "noise_velocity",
)
"""What else a suite may vary; episodes that agree in all of these form a case."""

# 4 of 5 as a float must count as 0.8.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """How hard a controller can be pushed in a direction.

    Attributes:
        controller: who answers.
        direction_deg: of the push, 0 forward, 90 left [deg].
        case: column -> value of what else distinguishes it within the table.
        delta_v: largest change of velocity of which, and of all below it, a share of 0.8 is recovered [m/s].
        ever: largest change of velocity ever recovered [m/s].
        over_omega_d: delta_v / (omega d); the no-step limit is 1. None where the table does not say.
        over_sqrt_gh: delta_v / sqrt(g h); None likewise.
        ever_over_omega_d, ever_over_sqrt_gh: the same of `ever`.
        no_step: omega d [m/s]; None likewise.
        d_edge: d, from the COG's projection to the edge of the feet in the direction [m]; None likewise.
        step: spacing of the levels at the threshold [m/s].
        index: number of levels up to the threshold.
        levels: level [m/s] -> rate of recovery, of the levels that were run; replicas that are missing count as
            not recovered.
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
    no_step: float | None
    d_edge: float | None
    step: float
    index: int
    levels: dict[float, Rate]
    capped: bool

    @property
    def key(self) -> tuple[Any, ...]:
        """What the same threshold of another table agrees in."""
        return self.controller, self.direction_deg, *self.case.items()

    def as_dict(self) -> dict[str, Any]:
        """The entry of `robust` in a summary."""
        return {
            "controller": self.controller,
            "direction_deg": self.direction_deg,
            **({"case": self.case} if self.case else {}),
            "delta_v": self.delta_v,
            "over_omega_d": self.over_omega_d,
            "over_sqrt_gh": self.over_sqrt_gh,
            "ever": self.ever,
            "ever_over_omega_d": self.ever_over_omega_d,
            "ever_over_sqrt_gh": self.ever_over_sqrt_gh,
            "no_step_delta_v": self.no_step,
            "step": self.step,
            "capped": self.capped,
        }


def varying(rows: Sequence[Row], columns: Sequence[str] = CASE_COLUMNS) -> list[str]:
    """Those of the columns in which the rows differ, but for what a variant differs in by its own definition."""
    found = [name for name in columns if len(grouped(rows, [name])) > 1]
    if "variant" not in found:
        return found
    variants = grouped(rows, ["variant"]).values()
    return [
        name for name in found if name == "variant" or any(len(grouped(members, [name])) > 1 for members in variants)
    ]


def thresholds(rows: Sequence[Row], beside: Sequence[Row] = ()) -> list[Threshold]:
    """The threshold of every controller, direction and case of a table.

    Levels that a series never reached, but another of its direction did, count as not recovered: an adaptive suite
    stops a series that only fails.
    A table without levels, such as one of random pushes, has no thresholds.

    Args:
        rows: the table.
        beside: a table to compare with: its levels are counted too, and cases are told apart as in both.
    """
    case_columns = varying([*rows, *beside])
    others = grouped(beside, case_columns)
    found = []
    for case, members in grouped(rows, case_columns).items():
        series = grouped(members, ["controller", "direction_deg"])
        ladders: dict[float, list[float]] = {}
        for direction, level in grouped([*members, *others.get(case, [])], ["direction_deg", "delta_v"]):
            ladders.setdefault(direction, []).append(level)
        rungs = sum(len(grouped(tries, ["delta_v"])) for tries in series.values())
        if rungs < 2 * len(series):
            continue
        replicas = max(len(tries) for tries in grouped(members, ["controller", "direction_deg", "delta_v"]).values())
        what = dict(zip(case_columns, case, strict=True))
        for (controller, direction), tries in series.items():
            found.append(_threshold(controller, direction, what, tries, ladders[direction], replicas))
    return sorted(found, key=lambda one: (str(one.case), one.controller, one.direction_deg))


def _threshold(
    controller: str, direction: float, case: dict[str, Any], tries: list[Row], ladder: list[float], replicas: int
) -> Threshold:
    levels = {
        level: Rate(count=sum(map(recovered, same)), n=max(len(same), replicas))
        for (level,), same in grouped(tries, ["delta_v"]).items()
    }
    index = 0
    while index < len(ladder) and _is_robust(levels.get(ladder[index])):
        index += 1
    robust = ladder[index - 1] if index else 0.0
    ever = max((level for level, rate in levels.items() if rate.count), default=0.0)
    per_omega_d, per_sqrt_gh = (_scale(tries, name) for name in ("delta_v_over_omega_d", "delta_v_over_sqrt_gh"))
    edges = [edge for row in tries if (edge := number(row.get("d_edge"))) is not None]
    last = min(index, len(ladder) - 1)
    return Threshold(
        controller=controller,
        direction_deg=direction,
        case=case,
        delta_v=robust,
        ever=ever,
        over_omega_d=None if per_omega_d is None else robust * per_omega_d,
        over_sqrt_gh=None if per_sqrt_gh is None else robust * per_sqrt_gh,
        ever_over_omega_d=None if per_omega_d is None else ever * per_omega_d,
        ever_over_sqrt_gh=None if per_sqrt_gh is None else ever * per_sqrt_gh,
        no_step=None if per_omega_d is None else 1.0 / per_omega_d,
        d_edge=median(edges) if edges else None,
        step=round(ladder[last] - (ladder[last - 1] if last else 0.0), 9),
        index=index,
        levels=levels,
        capped=index == len(ladder),
    )


def _is_robust(rate: Rate | None) -> bool:
    return rate is not None and rate.count >= ROBUST_SHARE * rate.n - _ROUNDING


def _scale(rows: list[Row], column: str) -> float | None:
    """What a change of velocity is multiplied by to be that of `column`: the replicas' median."""
    ratios = []
    for row in rows:
        value, delta_v = number(row.get(column)), number(row.get("delta_v"))
        if value is not None and delta_v and math.isfinite(value) and value > 0.0:
            ratios.append(value / delta_v)
    return median(ratios) if ratios else None
