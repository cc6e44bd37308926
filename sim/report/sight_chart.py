"""The chart of what the controllers saw: how far off, by the size of the push and by what came of it."""

from __future__ import annotations

from functools import partial

import pandas as pd
from matplotlib.figure import Figure

from sim.analysis.frame import recovered
from sim.presenter.tables import Picture
from sim.report.style import FAINT, WIDTH, picture

_LOOKS = ((True, "recovered", "#239023", "o"), (False, "not recovered", "#c02020", "x"))
_PANELS = (("dcm_error_rms", "RMS"), ("dcm_error_peak", "peak"))


def sight_plot(pushes: pd.DataFrame) -> list[Picture]:
    """Error of the DCM that was seen against the size of the push; nothing if all saw the true state.

    Args:
        pushes: rows of a sweep, of the episodes that are shown.
    """
    seen = pushes[pushes["dcm_error_rms"].notna() & pushes["delta_v"].notna()]
    if seen.empty:
        return []
    return [
        picture(
            partial(_draw, seen),
            f"Error of the DCM that was seen by the size of the push, {len(seen)} pushes.",
            caption="Each mark is an episode, from its first push on and until a fall. Errors that grow with the push "
            "are of the impacts of feet; larger ones of lost episodes may be the cause of the fall, or its effect.",
        )
    ]


def _draw(seen: pd.DataFrame) -> Figure:
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    well = recovered(seen)
    for axes, (column, words) in zip(figure.subplots(1, 2), _PANELS, strict=True):
        for stood, label, colour, marker in _LOOKS:
            own = seen[well == stood]
            axes.scatter(own["delta_v"], 1e3 * own[column], s=14, marker=marker, color=colour, alpha=0.6, label=label)
        axes.set_xlabel("Δv [m/s]")
        axes.set_ylabel(f"{words} of the DCM's error [mm]")
        axes.set_ylim(bottom=0.0)
        axes.grid(color=FAINT, alpha=0.35, linewidth=0.6)
    axes.legend(fontsize=8)
    return figure
