"""The chart of endurance: how many still stand after so many pushes."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sim.presenter.formatting import case_words
from sim.presenter.tables import Picture
from sim.report.style import INK, WIDTH, Shown, legend_label, picture, share_axis

_ROOM = 3  # pushes shown beyond the last that anyone survived


def survival_curves(summary: dict[str, Any]) -> list[Picture]:
    """Share of the replicas still standing after each push, with 95 % Wilson bands: a chart for each case."""
    shown = summary["controllers_shown"]
    cases: dict[str, dict[str, dict[str, Any]]] = {}
    for entry in summary["endurance"]:
        cases.setdefault(case_words(entry.get("case")), {})[entry["controller"]] = entry
    pictures = []
    for title, own in cases.items():
        medians = (
            f"{shown[name]['label']} {own[name]['pushes_survived']['median']:g}" for name in shown if name in own
        )
        draw = partial(_draw, own, shown, summary["train"], title)
        alt = f"Share still standing after each push of a growing train; medians: {', '.join(medians)}."
        caption = "Share of the trains that survived so many pushes, with 95 % Wilson intervals."
        pictures.append(picture(draw, alt, caption=caption))
    return pictures


def _draw(own: dict[str, dict[str, Any]], shown: Shown, train: dict[str, Any] | None, title: str) -> Figure:
    entries = list(own.values())
    furthest = max(sum(rate["count"] > 0 for rate in entry["survival"]) for entry in entries) - 1
    last = min(furthest + _ROOM, max(entry["pushes"] for entry in entries))
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = figure.add_subplot()
    for name in (name for name in shown if name in own):
        rates, colour, label = own[name]["survival"][: last + 1], shown[name]["colour"], shown[name]["label"]
        numbers = np.arange(len(rates))
        low, high = np.array([rate["interval"] for rate in rates]).T
        axes.fill_between(numbers, low, high, step="mid", color=colour, alpha=0.14, linewidth=0)
        line: dict[str, Any] = {"where": "mid", "linewidth": 1.5, "label": legend_label(label)}
        axes.step(numbers, [rate["rate"] for rate in rates], color=colour, **line)
    axes.axhline(0.5, color=INK, linewidth=0.7, linestyle=":")
    axes.set_xlim(0, last)
    axes.set_ylim(-0.02, 1.02)
    share_axis(axes)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("still standing")
    axes.set_xlabel("after push number")
    if train is not None and train["growth"] > 0.0:
        first, growth = train["first"], train["growth"]
        scales = (lambda number: first + growth * (number - 1), lambda size: (size - first) / growth + 1)
        above = axes.secondary_xaxis("top", functions=scales)
        above.set_xlabel("size of that push, Δv/(ωd)", fontsize=8)
        above.tick_params(labelsize=7.5)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8.5)
    figure.suptitle(title, fontsize=10, fontweight="bold")
    return figure
