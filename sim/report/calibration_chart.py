"""The chart of a calibration: were pushes recovered as often as was told?"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sim.presenter.tables import Picture
from sim.record.palette import TRACKER
from sim.report.style import FAINT, INK, WIDTH, picture, share_axis

_LOW = 0.1  # a share below this has no room under its dot


def calibration_curve(summary: dict[str, Any], entry: dict[str, Any]) -> Picture:
    """What was recovered by what was told, in tenths of the probability.

    Args:
        summary: of a sweep.
        entry: of its `prediction_score`'s `probability`.
    """
    who = f"{summary['controllers_shown'][entry['controller']]['label']}, {entry['world']}"
    return picture(
        partial(_draw, who, entry),
        f"Recovery by the probability that was told, {who}, {entry['n']} pushes.",
        caption="Were pushes recovered as often as was told? Dots are tenths of the probability (at its mean; bars: "
        "the 95 % Wilson interval; numbers: the pushes); on the diagonal what was told came true.",
    )


def _draw(who: str, entry: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=FAINT, linewidth=0.9)
    for one in entry["bins"]:
        share, (low, high) = one["recovered"]["rate"], one["recovered"]["interval"]
        error = [[max(share - low, 0.0)], [max(high - share, 0.0)]]
        axes.errorbar(one["told"], share, yerr=error, fmt="o", color=TRACKER, markersize=4.5, linewidth=1.1)
        beside = (5, -9 if share > _LOW else 4)
        axes.annotate(str(one["recovered"]["n"]), (one["told"], share), beside, textcoords="offset points", fontsize=7)
    axes.set_xlim(-0.02, 1.06)
    axes.set_ylim(-0.04, 1.04)
    share_axis(axes)
    axes.set_xticks(np.linspace(0, 1, 6), [f"{tick} %" for tick in range(0, 101, 20)])
    axes.set_xlabel("probability of recovery that was told")
    axes.set_ylabel("recovered")
    axes.set_title(who, fontsize=10, fontweight="bold", color=INK)
    return figure
