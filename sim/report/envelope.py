"""The envelope of a sweep for a document: a picture of its thresholds, and a table in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from models.errors import InputError
from sim.analysis.formatting import case_words, first_words, fixed
from sim.analysis.push_limits import PushLimit, push_limits
from sim.analysis.statistics import Row
from sim.analysis.summary_table import ordered
from sim.analysis.thresholds import Threshold, thresholds
from sim.report.envelope_chart import draw_envelope
from sim.report.file import write_picture

ENVELOPE = "envelope.png"
_WORDS = {
    "paper": "paper (one fixed reference)",
    "regulator": "regulator (never steps)",
    "statue": "statue (holds still)",
}


@dataclass(frozen=True, kw_only=True)
class ShownCase:
    """What is drawn.

    Attributes:
        robust: the thresholds of one case.
        limits: without a step, of its robot.
    """

    robust: Sequence[Threshold]
    limits: Sequence[PushLimit]


def chosen_case(rows: Sequence[Row], words: str | None = None) -> ShownCase:
    """The thresholds of a table's only case, or of the one that is named.

    Raises:
        InputError: if there are no thresholds, or not one such case.
    """
    cases: dict[str, list[Threshold]] = {}
    for one in thresholds(rows):
        cases.setdefault(case_words(one.case), []).append(one)
    if not cases:
        raise InputError("there are no thresholds: no direction was pushed at two sizes or more")
    if len(cases) == 1 and words is not None:
        raise InputError(f"--case: {words!r} is not needed; the suite has only one case")
    if len(cases) > 1 and words not in cases:
        what = "is needed" if words is None else f"{words!r} is none of the suite's"
        raise InputError(f"--case: {what}; choose one of {', '.join(map(repr, cases))}")
    robust = cases[words or ""]
    limits, robot = push_limits(rows), robust[0].case.get("robot")
    # Koolen's limits lie so far out that they would leave little room for what was measured.
    own = [replace(limit, steps=()) for limit in limits if robot in (None, limit.robot)]
    return ShownCase(robust=robust, limits=own)


def write_envelope(shown: ShownCase, path: Path) -> None:
    """Draw thresholds in units of omega d around the robot, the limit without a step being the circle at 1.

    Raises:
        InputError: if the file cannot be written, or its name ends otherwise than in .png or .svg.
    """
    write_picture(lambda: draw_envelope(shown.robust, shown.limits, normalised=True), path, "--out")


def envelope_table(shown: ShownCase, summary: dict[str, Any]) -> str:
    """The same as a table in Markdown, with means, worst direction and holes.

    Args:
        shown: what is drawn.
        summary: of the sweep.
    """
    directions = sorted({one.direction_deg for one in shown.robust})
    heads = ["Δv/(ωd)", *(f"{way:g}°" for way in directions), "mean", "worst", "mean Δv/√(gh)", "holes"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for name in ordered({one.controller for one in shown.robust}):
        own = {one.direction_deg: one for one in shown.robust if one.controller == name}
        capped = any(one.capped for one in own.values())
        scaled = [one.over_omega_d for one in own.values() if one.over_omega_d is not None]
        froude = [one.over_sqrt_gh for one in own.values() if one.over_sqrt_gh is not None]
        cells = [fixed(own[way].over_omega_d, capped=own[way].capped) if way in own else "" for way in directions]
        cells += [f"**{fixed(_mean(scaled), capped=capped)}**", fixed(min(scaled, default=None))]
        cells += [fixed(_mean(froude), 3, capped=capped), str(_holes(summary, name, own))]
        lines.append(f"| {_WORDS.get(name, name)} | " + " | ".join(cells) + " |")
    note = [] if summary["first"] is None else ["", first_words(summary["first"])]
    return "\n".join([*lines, *note])


def _holes(summary: dict[str, Any], name: str, own: dict[float, Threshold]) -> int:
    case = next(iter(own.values())).case
    return sum(hole["controller"] == name and hole.get("case", {}) == case for hole in summary["holes"])


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
