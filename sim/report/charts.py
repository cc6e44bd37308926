"""The charts of a report: what was recovered, and whether slack predicted it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sim.analysis.frame import recovered
from sim.analysis.prediction_score import signed_slack
from sim.analysis.statistics import rate
from sim.presenter.tables import Picture
from sim.presenter.threshold_section import cases
from sim.record.palette import TRACKER
from sim.report.style import FAINT, INK, NARROW, SOFT, WIDTH, Shown, legend_label, picture, share_axis

# From lost to recovered; dark enough at either end to be told apart in print and by the colour-blind.
_RECOVERY = LinearSegmentedColormap.from_list("recovery", ["#9c2f2f", "#e9b48a", "#f4efd9", "#8fc1b5", "#17695c"])
_LIMIT = "#ffd400"

# Levels are decimal fractions.
_ROUNDING = 1e-9

Curves = dict[str, list[tuple[float, dict[str, Any]]]]


def heat_maps(summary: dict[str, Any]) -> list[Picture]:
    """Share recovered over direction and change of velocity, of each controller; what was not run is left white.

    The thresholds are marked in them if they are of a single case.
    """
    rates = [entry for entry in summary["rates"] if list(entry["by"]) == ["controller", "direction_deg", "delta_v"]]
    # Levels of all controllers, so that their pictures can be laid side by side.
    levels = sorted({_span(entry["by"]["delta_v"]) for entry in rates})
    marks = summary["robust"] if len(cases(summary)) == 1 else []
    pictures = []
    for name, look in summary["controllers_shown"].items():
        own = [entry for entry in rates if entry["by"]["controller"] == name]
        count, n = (sum(entry[key] for entry in own) for key in ("count", "n"))
        alt = f"Recovery of the {look['label']} by direction and Δv: {count} of {n} episodes recovered."
        draw = partial(_draw_heat_map, look, own, [one for one in marks if one["controller"] == name], levels)
        pictures.append(picture(draw, alt, size="three"))
    return pictures


def _draw_heat_map(
    look: dict[str, Any],
    rates: Sequence[dict[str, Any]],
    marks: Sequence[dict[str, Any]],
    levels: list[tuple[float, float]],
) -> Figure:
    columns = sorted({entry["by"]["direction_deg"] for entry in rates})
    share = np.full((len(levels), len(columns)), np.nan)
    figure = Figure(figsize=(NARROW, 1.2 + 0.165 * max(len(levels), 8)), layout="constrained")
    axes = figure.add_subplot()
    for entry in rates:
        i, j = levels.index(_span(entry["by"]["delta_v"])), columns.index(entry["by"]["direction_deg"])
        share[i, j] = entry["rate"]
        if 0 < entry["count"] < entry["n"]:
            dark = entry["rate"] < 0.2 or entry["rate"] > 0.85
            words = f"{entry['count']}/{entry['n']}"
            axes.text(j, i, words, ha="center", va="center", fontsize=6.5, color="white" if dark else INK)
    edges = (np.arange(size + 1) - 0.5 for size in (len(columns), len(levels)))
    axes.pcolormesh(*edges, share, cmap=_RECOVERY, vmin=0, vmax=1, edgecolors="white", linewidth=0.8)
    for one in marks:
        j = columns.index(one["direction_deg"])
        below = sum(high <= one["delta_v"] + _ROUNDING for _, high in levels)
        axes.plot([j - 0.5, j + 0.5], [below - 0.5] * 2, color=INK, linewidth=2.4, solid_capstyle="butt")
        if one["no_step_delta_v"] is not None and len(levels) > 1 and levels[0][0] == levels[0][1]:
            level = np.interp(one["no_step_delta_v"], [low for low, _ in levels], range(len(levels)))
            axes.plot([j - 0.5, j + 0.5], [level] * 2, color=_LIMIT, linewidth=1.6)
    every = max(1, math.ceil(len(levels) / 14))
    axes.set_yticks(range(len(levels))[::every], [f"{sum(level) / 2:.2f}" for level in levels[::every]])
    axes.set_xticks(range(len(columns)), [f"{column:g}°" for column in columns])
    if len(columns) > 10:
        axes.tick_params(axis="x", rotation=90, labelsize=7)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("direction (0° forward, 90° left)")
    axes.set_ylabel("Δv [m/s]")
    axes.set_title(look["label"], fontsize=10, fontweight="bold", color=look["colour"])
    return figure


def _span(value: Any) -> tuple[float, float]:
    return (float(value[0]), float(value[1])) if isinstance(value, list) else (float(value), float(value))


def curves(summary: dict[str, Any]) -> Curves:
    """Controller -> (change of velocity [m/s], rate of recovery over all directions), in order.

    Levels that a series never reached, but another did, count as not recovered; not so where each direction has levels
    of its own, being of units of its omega d.
    """
    found: Curves = {}
    for entry in summary["rates"]:
        if list(entry["by"]) == ["controller", "delta_v"]:
            found.setdefault(entry["by"]["controller"], []).append((sum(_span(entry["by"]["delta_v"])) / 2, entry))
    levels: dict[tuple[str, float], list[float]] = {}
    for entry in summary["rates"]:
        if list(entry["by"]) == ["controller", "direction_deg", "delta_v"]:
            key = entry["by"]["controller"], entry["by"]["direction_deg"]
            levels.setdefault(key, []).append(sum(_span(entry["by"]["delta_v"])) / 2)
    ladder = sorted({level for own in levels.values() for level in own}) if summary["robust"] else []
    if not ladder or any(own != ladder[: len(own)] for own in levels.values()):
        return found
    for name, points in found.items():
        known = dict(points)
        n = max(entry["n"] for entry in known.values())
        found[name] = [(level, rate(known[level]["count"] if level in known else 0, n)) for level in ladder]
    return found


def rate_curves(summary: dict[str, Any]) -> Picture:
    """Recovery by change of velocity over all directions, with 95 % Wilson bands."""
    caption = "With 95 % Wilson intervals."
    if summary["robust"]:
        caption += " Pushes beyond the end of a series count as not recovered."
    alt = "Share of pushes recovered by their size, over all directions, for each controller."
    return picture(lambda: _draw_curves(curves(summary), summary["controllers_shown"]), alt, caption=caption)


def _draw_curves(found: Curves, shown: Shown) -> Figure:
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    axes = figure.add_subplot()
    for name, look in shown.items():
        points = [(level, entry) for level, entry in found.get(name, []) if entry["n"]]
        levels, colour = [level for level, _ in points], look["colour"]
        bounds = np.array([entry["interval"] for _, entry in points]).reshape(-1, 2)
        axes.fill_between(levels, *bounds.T, color=colour, alpha=0.16, linewidth=0)
        line = {"marker": look["marker"], "markersize": 3.5, "linewidth": 1.3, "label": legend_label(look["label"])}
        axes.plot(levels, [entry["rate"] for _, entry in points], color=colour, **line)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlim(left=0.0)
    share_axis(axes)
    axes.set_xlabel("Δv [m/s]")
    axes.set_ylabel("recovered, over all directions")
    figure.legend(loc="outside upper center", ncols=3, fontsize=8.5)
    return figure


def slack_plot(world: str, pushes: pd.DataFrame, section: dict[str, Any]) -> Picture:
    """Does more slack mean safer? Recovery by signed slack at the end of the push.

    Args:
        world: of the episodes.
        pushes: the episodes.
        section: what `sim.analysis.prediction_score.by_slack` says of them.
    """
    slack = 1e3 * signed_slack(pushes).dropna()
    well, fit = recovered(pushes)[slack.index], section["logistic"]
    curve = "." if fit is None or fit["separated"] else ", the curve a logistic fit."
    return picture(
        lambda: _draw_slack(world, slack[well], slack[~well], section),
        f"Recovery by signed slack in the {world} world, {len(slack)} episodes.",
        caption="Does more slack mean safer? Dots are rates of recovery in bins of the slack (bars: the bin's extent, "
        "the 95 % interval of its rate), ticks above and below the single episodes" + curve,
    )


def _draw_slack(world: str, good: pd.Series, bad: pd.Series, section: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    both = pd.concat([good, bad])
    room = 0.04 * float(np.ptp(both)) or 1.0
    low, high = min(both.min(), 0.0) - room, max(both.max(), 0.0) + room
    axes.add_patch(Rectangle((low, -0.12), -low, 1.24, color="#f6efe9", linewidth=0, zorder=0))
    for slacks, at in ((good, 1.07), (bad, -0.07)):
        axes.plot(slacks, np.full(len(slacks), at), "|", color=INK, alpha=0.25, markersize=6, markeredgewidth=0.7)
    fit = section["logistic"]
    if fit is not None and not fit["separated"]:
        grid = np.linspace(low, high, 200)
        odds = fit["intercept"] + fit["slope_per_cm"] * grid / 10.0
        axes.plot(grid, 1.0 / (1.0 + np.exp(-np.clip(odds, -50, 50))), color=FAINT, linewidth=1.3, zorder=2)
    for entry in section["bins"]:
        share, ends = entry["recovered"]["rate"], entry["recovered"]["interval"]
        extent = [[1e3 * (entry["middle"] - entry["low"])], [1e3 * (entry["high"] - entry["middle"])]]
        bars: dict[str, Any] = {"xerr": extent, "yerr": [[max(share - ends[0], 0.0)], [max(ends[1] - share, 0.0)]]}
        axes.errorbar(
            1e3 * entry["middle"], share, **bars, fmt="o", color=TRACKER, markersize=4.5, linewidth=1.1, zorder=3
        )
    axes.axvline(0.0, color=INK, linewidth=0.9)
    for side, words in (("right", "outside all its sets"), ("left", "in a set")):
        offset = (-5 if side == "right" else 5, 3)
        place: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
        axes.annotate(words, (0.0, 1.0), offset, ha=side, fontsize=8, color=SOFT, **place)
    axes.set_xlim(low, high)
    axes.set_ylim(-0.12, 1.12)
    share_axis(axes)
    axes.set_xlabel("signed slack at the end of the push [mm]")
    axes.set_ylabel("recovered")
    axes.set_title(world, fontsize=10, fontweight="bold", pad=16)
    return figure
