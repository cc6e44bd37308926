"""The ablation of a report: how often each variant recovers, as bars with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from sim.analysis.ablation import difference_words, p_words, rate
from sim.analysis.statistics import ALPHA
from sim.record.palette import TRACKER
from sim.report.file import write_picture
from sim.report.style import FAINT, INK, SOFT, WIDTH, Picture, picture, style

ABLATION = "ablation.png"
_BAR = 0.62
_ROOM = 2.0  # end of the axes, so far beyond the share 1 for the words at the right


def ablation_picture(section: Mapping[str, Any]) -> Picture:
    """The bars as a picture for the page."""
    with style():
        told = ", ".join(
            f"{one['variant']} {100 * (one['recovered']['rate'] or 0.0):.0f} %" for one in section["designs"]
        )
        return picture(draw_ablation(section), f"Recovered of the same pushes, by variant: {told}.")


def draw_ablation(section: Mapping[str, Any]) -> Figure:
    """A bar a variant with its 95 % Wilson interval, and the difference to the first with its p.

    Args:
        section: `ablation` of a summary.
    """
    designs = section["designs"]
    with style():
        figure = Figure(figsize=(1.6 * WIDTH, 0.75 + 0.3 * len(designs)), layout="constrained")
        axes = figure.add_subplot()
        for i, one in enumerate(designs):
            found = rate(one["recovered"])
            if found.share is None or found.interval is None:
                continue
            against = one["against"]
            # What chance may have done is pale.
            sure = against is None or (against["p"] is not None and against["p"] < ALPHA)
            axes.barh(
                i, found.share, height=_BAR, color=TRACKER if against is None else FAINT, alpha=1 if sure else 0.5
            )
            axes.plot(found.interval, [i, i], color=INK, linewidth=1.1, solid_capstyle="butt")
            words = f"{found.count} of {found.n}"
            if against is not None:
                p = p_words(against)
                words += f",  {difference_words(against)} points, p {p if p.startswith('<') else f'= {p}'}"
            axes.text(1.04, i, words, va="center", fontsize=7.5, color=INK if sure else SOFT)
        first = rate(designs[0]["recovered"]).share
        if first is not None:
            axes.axvline(first, color=TRACKER, linewidth=0.8, linestyle="--", zorder=0)
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
