"""The charts of a report: what was recovered, and whether slack predicted it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sim.analysis.prediction_score import signed_slack
from sim.analysis.statistics import Rate, Row, recovered
from sim.analysis.summary_table import ordered
from sim.analysis.thresholds import Threshold
from sim.record.palette import TRACKER
from sim.report.style import COLOURS, FAINT, INK, MARKERS, NARROW, SOFT, WIDTH, Picture, picture, style

# From lost to recovered; dark enough at either end to be told apart in print and by the colour-blind.
_RECOVERY = LinearSegmentedColormap.from_list("recovery", ["#9c2f2f", "#e9b48a", "#f4efd9", "#8fc1b5", "#17695c"])

# Levels are decimal fractions.
_ROUNDING = 1e-9


def heat_map(name: str, rates: Sequence[dict[str, Any]], robust: Sequence[Threshold]) -> Picture:
    """Share recovered over direction and change of velocity; what was not run is left white.

    Args:
        name: the controller.
        rates: the entries of a summary by controller, direction and change of velocity.
        robust: thresholds to mark, of a single case; may be empty.
    """
    own = [entry for entry in rates if entry["by"]["controller"] == name]
    columns = sorted({entry["by"]["direction_deg"] for entry in own})
    # Those of all controllers, so that their pictures can be laid side by side.
    rows = sorted({_span(entry["by"]["delta_v"]) for entry in rates})
    share = np.full((len(rows), len(columns)), np.nan)
    with style():
        figure = Figure(figsize=(NARROW, 1.2 + 0.165 * max(len(rows), 8)), layout="constrained")
        axes = figure.add_subplot()
        for entry in own:
            i, j = rows.index(_span(entry["by"]["delta_v"])), columns.index(entry["by"]["direction_deg"])
            share[i, j] = entry["rate"]
            if 0 < entry["count"] < entry["n"]:
                dark = entry["rate"] < 0.2 or entry["rate"] > 0.85
                words = f"{entry['count']}/{entry['n']}"
                axes.text(j, i, words, ha="center", va="center", fontsize=6.5, color="white" if dark else INK)
        axes.pcolormesh(
            np.arange(len(columns) + 1) - 0.5,
            np.arange(len(rows) + 1) - 0.5,
            share,
            cmap=_RECOVERY,
            vmin=0,
            vmax=1,
            edgecolors="white",
            linewidth=0.8,
        )
        for one in robust:
            if one.controller == name and one.direction_deg in columns:
                j = columns.index(one.direction_deg)
                below = sum(high <= one.delta_v + _ROUNDING for _, high in rows)
                axes.plot([j - 0.5, j + 0.5], [below - 0.5] * 2, color=INK, linewidth=2.4, solid_capstyle="butt")
                if one.no_step is not None and len(rows) > 1 and rows[0][0] == rows[0][1]:
                    level = np.interp(one.no_step, [row[0] for row in rows], range(len(rows)))
                    axes.plot([j - 0.5, j + 0.5], [level] * 2, color="#ffd400", linewidth=1.6)
        every = max(1, math.ceil(len(rows) / 14))
        axes.set_yticks(range(len(rows))[::every], [f"{_middle(row):.2f}" for row in rows[::every]])
        axes.set_xticks(range(len(columns)), [f"{column:g}°" for column in columns])
        if len(columns) > 10:
            axes.tick_params(axis="x", rotation=90, labelsize=7)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_xlabel("direction (0° forward, 90° left)")
        axes.set_ylabel("Δv [m/s]")
        axes.set_title(name, fontsize=10, fontweight="bold", color=COLOURS.get(name, INK))
        total = Rate(count=sum(entry["count"] for entry in own), n=sum(entry["n"] for entry in own))
        return picture(
            figure, f"Recovery of the {name} by direction and Δv: {total.count} of {total.n} episodes recovered."
        )


def _span(value: Any) -> tuple[float, float]:
    return (float(value[0]), float(value[1])) if isinstance(value, list) else (float(value), float(value))


def _middle(span: tuple[float, float]) -> float:
    return 0.5 * (span[0] + span[1])


def rate_curves(curves: dict[str, list[tuple[float, Rate]]]) -> Picture:
    """Recovery by change of velocity over all directions, with 95 % Wilson bands.

    Args:
        curves: controller -> (change of velocity [m/s], rate) in order.
    """
    with style():
        figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
        axes = figure.add_subplot()
        for name in ordered(curves):
            points = [(level, rate) for level, rate in curves[name] if rate.n]
            levels = [level for level, _ in points]
            bounds = np.array([rate.interval for _, rate in points])
            colour = COLOURS.get(name, INK)
            axes.fill_between(levels, *bounds.T, color=colour, alpha=0.16, linewidth=0)
            axes.plot(
                levels,
                [rate.share if rate.share is not None else math.nan for _, rate in points],
                color=colour,
                marker=MARKERS.get(name, "D"),
                markersize=3.5,
                linewidth=1.3,
                label=name,
            )
        axes.set_ylim(-0.02, 1.02)
        axes.set_yticks(np.linspace(0, 1, 6), [f"{tick} %" for tick in range(0, 101, 20)])
        axes.set_xlim(left=0.0)
        axes.grid(axis="y")
        axes.set_xlabel("Δv [m/s]")
        axes.set_ylabel("recovered, over all directions")
        figure.legend(loc="outside upper center", ncols=3, fontsize=8.5)
        return picture(figure, "Share of pushes recovered by their size, over all directions, for each controller.")


def slack_plot(world: str, rows: Sequence[Row], section: dict[str, Any]) -> Picture:
    """Does more slack mean safer? Recovery by signed slack at the end of the push.

    Args:
        world: of the episodes.
        rows: the episodes.
        section: what `sim.analysis.prediction_score.by_slack` says of them.
    """
    with style():
        figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
        axes = figure.add_subplot()
        pairs = [(1e3 * slack, recovered(row)) for row in rows if (slack := signed_slack(row)) is not None]
        good = np.array([slack for slack, well in pairs if well])
        bad = np.array([slack for slack, well in pairs if not well])
        low, high = min(slack for slack, _ in pairs), max(slack for slack, _ in pairs)
        room = 0.04 * (high - low) or 1.0
        low, high = min(low, 0.0) - room, max(high, 0.0) + room
        axes.add_patch(Rectangle((low, -0.12), -low, 1.24, color="#f6efe9", linewidth=0, zorder=0))
        for slacks, at in ((good, 1.07), (bad, -0.07)):
            axes.plot(slacks, np.full(len(slacks), at), "|", color=INK, alpha=0.25, markersize=6, markeredgewidth=0.7)
        fit = section["logistic"]
        if fit is not None and not fit["separated"]:
            grid = np.linspace(low, high, 200)
            odds = fit["intercept"] + fit["slope_per_cm"] * grid / 10.0
            axes.plot(grid, 1.0 / (1.0 + np.exp(-np.clip(odds, -50, 50))), color=FAINT, linewidth=1.3, zorder=2)
        for entry in section["bins"]:
            rate, (below, above) = entry["recovered"]["rate"], entry["recovered"]["interval"]
            ends = [[1e3 * (entry["middle"] - entry["low"])], [1e3 * (entry["high"] - entry["middle"])]]
            axes.errorbar(
                1e3 * entry["middle"],
                rate,
                xerr=ends,
                yerr=[[max(rate - below, 0.0)], [max(above - rate, 0.0)]],
                fmt="o",
                color=TRACKER,
                markersize=4.5,
                linewidth=1.1,
                zorder=3,
            )
        axes.axvline(0.0, color=INK, linewidth=0.9)
        for side, words in (("right", "predicted unsafe"), ("left", "predicted safe")):
            offset = (-5 if side == "right" else 5, 3)
            place: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
            axes.annotate(words, (0.0, 1.0), offset, ha=side, fontsize=8, color=SOFT, **place)
        axes.set_xlim(low, high)
        axes.set_ylim(-0.12, 1.12)
        axes.set_yticks(np.linspace(0, 1, 6), [f"{tick} %" for tick in range(0, 101, 20)])
        axes.grid(axis="y")
        axes.set_xlabel("signed slack at the end of the push [mm]")
        axes.set_ylabel("recovered")
        axes.set_title(world, fontsize=10, fontweight="bold", pad=16)
        return picture(figure, f"Recovery by signed slack in the {world} world, {len(pairs)} episodes.")
