"""The chart of what the controllers saw: how far off, by the size of the push and by what came of it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from sim.analysis.frame import recovered
from sim.presenter.tables import Picture
from sim.report.style import WIDTH, picture

_LOOKS = ((True, "recovered", "#239023", "o"), (False, "not recovered", "#c02020", "x"))
_PANELS = (("dcm_error_rms", "RMS"), ("dcm_error_peak", "peak"))
_BINS = 12  # of the size of a push, at most, that have a median
_LEAST = 3  # episodes that make a median worth drawing


def sight_plot(pushes: pd.DataFrame) -> list[Picture]:
    """Error of the DCM that was seen against the size of the push; nothing if all saw the true state.

    Trains are left out: their errors are of all their pushes.

    Args:
        pushes: rows of a sweep, of the episodes that are shown.
    """
    seen = pushes[pushes["dcm_error_rms"].notna() & pushes["delta_v"].notna() & pushes["train"].isna()]
    if seen.empty:
        return []
    return [
        picture(
            partial(draw_sight, seen),
            f"Error of the DCM that was seen by the size of the push, {len(seen)} pushes.",
            caption="Each mark is an episode, from its first push on and until a fall; lines are medians of pushes of "
            "about a size. Errors that grow with the push are of the impacts of feet; larger ones of lost episodes may "
            "be the cause of the fall, or its effect.",
        )
    ]


def draw_sight(seen: pd.DataFrame) -> Figure:
    """Draw RMS and peak of the error over the size of the push, by outcome, with medians.

    Args:
        seen: rows of pushes that have an error.
    """
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    well = recovered(seen)
    edges = np.linspace(seen["delta_v"].min(), seen["delta_v"].max() + 1e-9, _BINS + 1)
    for axes, (column, words) in zip(figure.subplots(1, 2), _PANELS, strict=True):
        for stood, label, colour, marker in _LOOKS:
            own = seen[well == stood]
            look = {"s": 9, "marker": marker, "linewidths": 0.8, "color": colour, "alpha": 0.3}
            # Beside each other where both are of one size.
            aside = (-0.1 if stood else 0.1) * (edges[1] - edges[0])
            axes.scatter(own["delta_v"] + aside, 1e3 * own[column], **look)
            middles = own.groupby(np.digitize(own["delta_v"], edges))[["delta_v", column]].agg(["median", "count"])
            middles = middles[middles[column, "count"] >= _LEAST]
            curve = middles["delta_v", "median"], 1e3 * middles[column, "median"]
            axes.plot(*curve, color=colour, marker=marker, markersize=4, linewidth=1.5, label=label)
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
        axes.tick_params(axis="y", which="minor", labelsize=8.5)
        axes.set_xlabel("Δv [m/s]")
        axes.set_ylabel(f"{words} of the DCM's error [mm]")
        axes.grid(which="both", axis="y")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8)
    return figure
