"""The polar envelope of a report: thresholds around the robot, and the limits of the pendulum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from sim.analysis.push_limits import PushLimit
from sim.analysis.summary_table import ordered
from sim.analysis.thresholds import Threshold
from sim.report.style import COLOURS, FAINT, INK, MARKERS, SOFT, WIDTH, Picture, picture, style

_NEIGHBOURS = 60.0  # [deg] between directions that a line may join
_ARC = 12.0  # [deg] to either side of one that none joins
_NO_STEP = "no step"
_COMPASS = {0.0: "forward", 90.0: "left", 180.0: "back", 270.0: "right"}


def envelope(robust: Sequence[Threshold], limits: Sequence[PushLimit], *, normalised: bool, title: str = "") -> Picture:
    """Thresholds around the robot, as a picture for the page; see `draw_envelope`."""
    with style():
        figure = draw_envelope(robust, limits, normalised=normalised, title=title)
        names = ordered({one.controller for one in robust})
        means = {name: [_value(one, normalised) for one in robust if one.controller == name] for name in names}
        words = ", ".join(f"{name} {np.mean(values):.2f}" for name, values in means.items())
        unit_words = "times the no-step limit" if normalised else "m/s"
        return picture(figure, f"Robust recoverable push by direction, mean in {unit_words}: {words}.")


def draw_envelope(
    robust: Sequence[Threshold], limits: Sequence[PushLimit], *, normalised: bool, title: str = ""
) -> Figure:
    """Thresholds around the robot, seen from above with its front upward, and the limits of the pendulum.

    Args:
        robust: thresholds of one case.
        limits: of the same robot.
        normalised: as multiples of omega d instead of in m/s; then the limit without a step is the circle at 1.
        title: over it.
    """
    with style():
        figure = Figure(figsize=(WIDTH, 4.55), layout="constrained")
        axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
        axes.set_theta_zero_location("N")
        turned = sorted(limits, key=lambda limit: limit.direction_deg)
        angles = [limit.direction_deg for limit in turned]
        unit = [limit.no_step if normalised else 1.0 for limit in turned]
        lines = [([limit.no_step for limit in turned], "--", _NO_STEP)]
        counts = sorted({1, max((len(limit.steps) for limit in turned), default=0)})
        for count, dashes in zip([n for n in counts if n], (":", "-."), strict=False):
            if all(len(limit.steps) >= count for limit in turned) and turned:
                words = f"{count} step{'s' if count > 1 else ''} (Koolen)"
                lines.append(([limit.steps[count - 1] for limit in turned], dashes, words))
        for values, dashes, words in lines if turned else []:
            look: dict[str, Any] = {"color": INK, "linestyle": dashes, "linewidth": 1.0, "label": words}
            if normalised and words == _NO_STEP:
                circle = np.linspace(0.0, 2.0 * np.pi, 181)
                axes.plot(circle, np.ones_like(circle), **look)
            else:
                _ring(axes, angles, np.array(values) / unit, **look)
        for name in ordered({one.controller for one in robust}):
            own = sorted((one for one in robust if one.controller == name), key=lambda one: one.direction_deg)
            around = [one.direction_deg for one in own]
            values = [_value(one, normalised) for one in own]
            ever = [(one.ever_over_omega_d if normalised else one.ever) or 0.0 for one in own]
            colour = COLOURS.get(name, INK)
            _ring(
                axes, around, values, color=colour, marker=MARKERS.get(name, "D"), markersize=4, label=name, fill=True
            )
            axes.scatter(np.radians(around), ever, s=16, facecolors="none", edgecolors=colour, linewidths=0.9, zorder=4)
        axes.scatter([], [], s=16, facecolors="none", edgecolors=FAINT, label="largest ever recovered")
        ticks = np.arange(0, 360, 45)
        axes.set_thetagrids(ticks, [_COMPASS.get(float(tick), f"{tick}°") for tick in ticks])
        axes.set_rlabel_position(22.5)
        axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.spines["polar"].set_visible(False)
        axes.tick_params(axis="y", labelsize=7.5, labelcolor=SOFT)
        axes.set_title(title or ("Δv/(ωd)" if normalised else "Δv [m/s]"), fontsize=10, fontweight="bold", pad=10)
        figure.legend(loc="outside lower center", ncols=2, fontsize=8, handlelength=2.4)
        return figure


def _value(one: Threshold, normalised: bool) -> float:
    return (one.over_omega_d if normalised else one.delta_v) or 0.0


def _ring(axes: PolarAxes, degrees: Sequence[float], values: Any, *, fill: bool = False, **look: Any) -> None:
    """A line from direction to direction, or, where these lie far apart, a short arc at each."""
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
