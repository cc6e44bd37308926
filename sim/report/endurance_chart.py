"""The chart of endurance: how many still stand after so many pushes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sim.analysis.formatting import case_words
from sim.analysis.summary_table import ordered
from sim.report.style import COLOURS, INK, WIDTH, Picture, picture, style

_ROOM = 3  # pushes shown beyond the last that anyone survived


def survival_curve(entries: Sequence[dict[str, Any]], train: dict[str, Any] | None, *, title: str = "") -> Picture:
    """Share of the replicas still standing after each push, with 95 % Wilson bands.

    Args:
        entries: of the section `endurance` of a summary, of one case.
        train: how the pushes grow, as the suite has it, if that is known.
        title: over it.
    """
    by_name = {entry["controller"]: entry for entry in entries}
    furthest = max(sum(rate["count"] > 0 for rate in entry["survival"]) for entry in entries) - 1
    shown = min(furthest + _ROOM, max(entry["pushes"] for entry in entries))
    with style():
        figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
        axes = figure.add_subplot()
        for name in ordered(by_name):
            rates = by_name[name]["survival"][: shown + 1]
            numbers, colour = np.arange(len(rates)), COLOURS.get(name, INK)
            low, high = np.array([rate["interval"] for rate in rates]).T
            axes.fill_between(numbers, low, high, step="mid", color=colour, alpha=0.14, linewidth=0)
            axes.step(numbers, [rate["rate"] for rate in rates], where="mid", color=colour, linewidth=1.5, label=name)
        axes.axhline(0.5, color=INK, linewidth=0.7, linestyle=":")
        axes.set_xlim(0, shown)
        axes.set_ylim(-0.02, 1.02)
        axes.set_yticks(np.linspace(0, 1, 6), [f"{tick} %" for tick in range(0, 101, 20)])
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(axis="y")
        axes.set_ylabel("still standing")
        axes.set_xlabel("after push number")
        if train is not None and train["growth"] > 0.0:
            first, growth = train["first"], train["growth"]

            def size(number: Any) -> Any:
                return first + growth * (number - 1)

            def number(size: Any) -> Any:
                return (size - first) / growth + 1

            above = axes.secondary_xaxis("top", functions=(size, number))
            above.set_xlabel("size of that push, Δv/(ωd)", fontsize=8)
            above.tick_params(labelsize=7.5)
        figure.legend(loc="outside lower center", ncols=3, fontsize=8.5)
        if title:
            figure.suptitle(title, fontsize=10, fontweight="bold")
        medians = ", ".join(f"{name} {by_name[name]['pushes_survived']['median']:g}" for name in ordered(by_name))
        return picture(figure, f"Share still standing after each push of a growing train; medians: {medians}.")


def survival_curves(entries: Sequence[dict[str, Any]], train: dict[str, Any] | None) -> list[Picture]:
    """A chart for each case."""
    cases: dict[str, list[dict[str, Any]]] = {}
    for entry in entries:
        cases.setdefault(case_words(entry.get("case")), []).append(entry)
    return [survival_curve(members, train, title=words) for words, members in cases.items()]
