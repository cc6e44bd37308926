"""The envelope of a sweep: its thresholds drawn around the robot, for the page and for documents."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from models.errors import InputError
from sim.presenter.formatting import case_words
from sim.presenter.tables import Picture
from sim.presenter.threshold_section import HOLE_WORDS, cases, holed_thresholds
from sim.presenter.who import by_controller
from sim.report.style import FAINT, INK, SOFT, WIDTH, legend_label, picture, write_picture

ENVELOPE = "envelope.png"
_NEIGHBOURS = 60.0  # [deg] between directions that a line may join
_ARC = 12.0  # [deg] to either side of one that none joins
_NO_STEP = "no step"
_COMPASS = {0.0: "forward", 90.0: "left", 180.0: "back", 270.0: "right"}

Summary = dict[str, Any]


def chosen_case(summary: Summary, words: str | None = None) -> dict[str, Any]:
    """The only case of a summary's thresholds, or the one that is named.

    Raises:
        InputError: if there are no thresholds, or not one such case.
    """
    found = {case_words(case): case for case in cases(summary)}
    if not found:
        raise InputError("there are no thresholds: no direction was pushed at two sizes or more")
    if len(found) == 1 and words is not None:
        raise InputError(f"--case: {words!r} is not needed; the suite has only one case")
    if len(found) > 1 and words not in found:
        what = "is needed" if words is None else f"{words!r} is none of the suite's"
        raise InputError(f"--case: {what}; choose one of {', '.join(map(repr, found))}")
    return found[words or ""]


def write_envelope(summary: Summary, case: dict[str, Any], path: Path) -> None:
    """Draw thresholds in units of omega d around the robot, the limit without a step being the circle at 1.

    Koolen's limits are left out: they lie so far out that they would leave little room for what was measured.

    Raises:
        InputError: if the file cannot be written, or its name ends otherwise than in .png or .svg.
    """
    write_picture(lambda: draw_envelope(summary, case, normalised=True, koolen=False), path, "--out")


def envelopes(summary: Summary) -> list[Picture]:
    """A picture of each case for the page; of a single case one in units of omega d and one in m/s."""
    found = cases(summary)
    return [
        _picture(summary, case, normalised)
        for case in found
        for normalised in ((True, False) if len(found) == 1 else (True,))
    ]


def _picture(summary: Summary, case: dict[str, Any], normalised: bool) -> Picture:
    means = (
        f"{summary['controllers_shown'][name]['label']} {np.mean([_size(one, normalised) for one in own]):.2f}"
        for name, own in _thresholds(summary, case).items()
    )
    unit = "times the no-step limit" if normalised else "m/s"
    return picture(
        lambda: draw_envelope(summary, case, normalised=normalised),
        f"Robust recoverable push by direction, mean in {unit}: {', '.join(means)}.",
        caption="Rings are the largest pushes ever recovered."
        + (f" {HOLE_WORDS}" if holed_thresholds(summary, case) else ""),
    )


def draw_envelope(summary: Summary, case: dict[str, Any], *, normalised: bool, koolen: bool = True) -> Figure:
    """Thresholds around the robot, seen from above with its front upward, and the limits of the pendulum.

    Args:
        summary: of a sweep.
        case: whose thresholds are drawn.
        normalised: as multiples of omega d instead of in m/s; then the limit without a step is the circle at 1.
        koolen: whether to draw Koolen's limits, too.
    """
    figure = Figure(figsize=(WIDTH, 4.55), layout="constrained")
    axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
    _draw_limits(axes, summary, case, normalised, koolen)
    holed = holed_thresholds(summary, case)
    for name, own in _thresholds(summary, case).items():
        look = summary["controllers_shown"][name]
        around, values = [one["direction_deg"] for one in own], [_size(one, normalised) for one in own]
        marker: dict[str, Any] = {"marker": look["marker"], "markersize": 4, "label": legend_label(look["label"])}
        ring(axes, around, values, color=look["colour"], fill=True, **marker)
        ever = [one["ever_over_omega_d" if normalised else "ever"] or 0.0 for one in own]
        hollow: dict[str, Any] = {"s": 16, "facecolors": "none", "linewidths": 0.9, "zorder": 4}
        axes.scatter(np.radians(around), ever, edgecolors=look["colour"], **hollow)
        for one, value in zip(own, values, strict=True):
            if (name, one["direction_deg"]) in holed:
                _mark_hole(axes, one["direction_deg"], value, look["colour"])
    axes.scatter([], [], s=16, facecolors="none", edgecolors=FAINT, label="largest ever recovered")
    if holed:
        axes.plot([], [], linestyle="", marker="$*$", color=FAINT, label="above a hole")
    dress(axes)
    title = case_words(case) or ("Δv/(ωd)" if normalised else "Δv [m/s]")
    # Of the figure: a title of polar axes is cut off when the outermost ring is far out.
    figure.suptitle(title, fontsize=10, fontweight="bold")
    figure.legend(loc="outside lower center", ncols=2, fontsize=8, handlelength=2.4)
    return figure


def dress(axes: PolarAxes) -> None:
    """Turn the front upward, name eight directions, and keep the rings few and quiet."""
    axes.set_theta_zero_location("N")
    ticks = np.arange(0, 360, 45)
    axes.set_thetagrids(ticks, [_COMPASS.get(float(tick), f"{tick}°") for tick in ticks])
    axes.set_rlabel_position(22.5)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.spines["polar"].set_visible(False)
    axes.tick_params(axis="y", labelsize=7.5, labelcolor=SOFT)


def _mark_hole(axes: PolarAxes, degrees: float, value: float, colour: str) -> None:
    beside: dict[str, Any] = {"xytext": (5, 3), "textcoords": "offset points"}
    axes.annotate("*", (math.radians(degrees), value), color=colour, fontsize=11, fontweight="bold", **beside)


def _thresholds(summary: Summary, case: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    return by_controller(summary, (one for one in summary["robust"] if one.get("case", {}) == case))


def _size(one: dict[str, Any], normalised: bool) -> float:
    return float(one["over_omega_d" if normalised else "delta_v"] or 0.0)


def no_step_circle(axes: PolarAxes) -> None:
    """Draw the limit without a step where sizes are in units of omega d."""
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(circle, np.ones_like(circle), linestyle="--", label=_NO_STEP, color=INK, linewidth=1.0)


def _draw_limits(axes: PolarAxes, summary: Summary, case: dict[str, Any], normalised: bool, koolen: bool) -> None:
    robot = case.get("robot", summary["robots"][0])
    limits = sorted((one for one in summary["limits"] if one["robot"] == robot), key=lambda one: one["direction_deg"])
    if not limits:
        return
    angles = [limit["direction_deg"] for limit in limits]
    look: dict[str, Any] = {"color": INK, "linewidth": 1.0}
    unit = np.array([limit["no_step_delta_v"] if normalised else 1.0 for limit in limits])
    if normalised:
        no_step_circle(axes)
    else:
        ring(axes, angles, [limit["no_step_delta_v"] for limit in limits], linestyle="--", label=_NO_STEP, **look)
    most = min(len(limit["n_step_delta_v"]) for limit in limits) if koolen else 0
    for count, dashes in zip(sorted({1, most}) if most else [], (":", "-."), strict=False):
        steps = np.array([limit["n_step_delta_v"][count - 1] for limit in limits])
        words = f"{count} step{'s' if count > 1 else ''} (Koolen)"
        ring(axes, angles, steps / unit, linestyle=dashes, label=words, **look)


def ring(axes: PolarAxes, degrees: Sequence[float], values: Any, *, fill: bool = False, **look: Any) -> None:
    """Draw a line from direction to direction, or, where these lie far apart, a short arc at each."""
    marker, size, label = look.pop("marker", None), look.pop("markersize", None), look.pop("label")
    closed = [*degrees, degrees[0] + 360.0]
    if max(np.diff(closed)) <= _NEIGHBOURS:
        axes.plot(np.radians(closed), [*values, values[0]], **look)
        if fill:
            axes.fill(np.radians(closed), [*values, values[0]], color=look["color"], alpha=0.10, linewidth=0)
    else:
        for degree, value in zip(degrees, values, strict=True):
            arc = np.radians(np.linspace(degree - _ARC, degree + _ARC, 9))
            axes.plot(arc, np.full(9, value), **look)
    if marker:
        axes.plot(np.radians(degrees), values, linestyle="", marker=marker, markersize=size, color=look["color"])
    axes.plot([], [], marker=marker, markersize=size, label=label, **look)
