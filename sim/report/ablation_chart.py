"""The ablation of a report: how often each variant recovers, as bars with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from sim.analysis.statistics import ALPHA
from sim.presenter.formatting import difference_words, fraction, p_words, percent
from sim.presenter.tables import Picture
from sim.record.palette import TRACKER
from sim.report.style import FAINT, INK, SOFT, WIDTH, picture, write_picture

ABLATION = "ablation.png"
_BAR = 0.62
_ROOM = 2.0  # end of the axes, so far beyond the share 1 for the words at the right


def ablation_picture(section: Mapping[str, Any]) -> Picture:
    """The bars as a picture for the page."""
    told = (f"{one['variant']} {percent(one['recovered'], interval=False)}" for one in section["designs"])
    alt = f"Recovered of the same pushes, by variant: {', '.join(told)}."
    return picture(lambda: draw_ablation(section), alt, size="one")


def draw_ablation(section: Mapping[str, Any]) -> Figure:
    """A bar a variant with its 95 % Wilson interval, and the difference to the first with its p.

    Args:
        section: `ablation` of a summary.
    """
    designs = section["designs"]
    figure = Figure(figsize=(1.6 * WIDTH, 0.75 + 0.3 * len(designs)), layout="constrained")
    axes = figure.add_subplot()
    for i, one in enumerate(designs):
        found, against = one["recovered"], one["against"]
        # What chance may have done is pale.
        sure = against is None or (against["p"] is not None and against["p"] < ALPHA)
        if found["n"]:
            colour = TRACKER if against is None else FAINT
            axes.barh(i, found["rate"], height=_BAR, color=colour, alpha=1 if sure else 0.5)
            axes.plot(found["interval"], [i, i], color=INK, linewidth=1.1, solid_capstyle="butt")
        words = [fraction(found)] if found["n"] else []
        if against is not None and against["pairs"]:
            p = p_words(against)
            words.append(f"{difference_words(against)} points, p {p if p.startswith('<') else f'= {p}'}")
        if one["crashed"]:
            words.append(f"{one['crashed']} crashed")
        axes.text(1.04, i, ",  ".join(words), va="center", fontsize=7.5, color=INK if sure else SOFT)
    if designs[0]["recovered"]["n"]:
        axes.axvline(designs[0]["recovered"]["rate"], color=TRACKER, linewidth=0.8, linestyle="--", zorder=0)
    axes.set_yticks(range(len(designs)), [one["variant"] for one in designs])
    axes.set_ylim(len(designs) - 0.5, -0.5)
    axes.set_xlim(0.0, _ROOM)
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "25", "50", "75", "100 %"])
    axes.spines["bottom"].set_bounds(0.0, 1.0)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("recovered, with 95 % Wilson interval", x=0.5 / _ROOM)
    return figure


def write_ablation(section: Mapping[str, Any], path: Path) -> None:
    """Draw the bars into a file; the same section makes the same bytes.

    Raises:
        InputError: if it cannot be written, or its name ends otherwise than in .png or .svg.
    """
    write_picture(lambda: draw_ablation(section), path, "--picture")
