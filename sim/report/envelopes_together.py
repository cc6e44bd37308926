"""The envelopes of several sweeps of one suite in one picture: with exact state and with real senses, for instance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from models.errors import InputError
from sim.presenter.formatting import condensed, degrees, fixed
from sim.presenter.tables import Table
from sim.presenter.threshold_section import cases
from sim.presenter.who import by_controller, label
from sim.report.envelope import COMPASS
from sim.report.style import INK, SOFT, WIDTH, legend_label, write_picture

Summary = dict[str, Any]

_LINES: tuple[str, ...] = ("-", "--", ":", "-.")
_FEW = 12  # directions that have a column each


def check_alike(named: Sequence[tuple[str, Summary]]) -> None:
    """Refuse sweeps whose thresholds cannot be laid over each other.

    Args:
        named: what each sweep is called, and its summary.

    Raises:
        InputError: if there are more than four, two have one name, or suite, robot or cases differ.
    """
    if len(named) > len(_LINES):
        raise InputError(f"at most {len(_LINES)} sweeps can be told apart in one picture; {len(named)} were given")
    names = [name for name, _ in named]
    if len(set(names)) < len(names):
        raise InputError(f"--label: {', '.join(map(repr, names))} must differ")
    (first, reference), *others = named
    for name, summary in named:
        if len(cases(summary)) != 1:
            raise InputError(f"{name}: {len(cases(summary))} cases; sweeps of one case each can be drawn together")
    for name, summary in others:
        for what, mine, its in (
            ("suite", reference["suite"], summary["suite"]),
            ("robot", reference["robots"], summary["robots"]),
            ("case", cases(reference), cases(summary)),
        ):
            if mine != its:
                raise InputError(f"{name}: its {what} is {its!r}, that of {first} is {mine!r}; they must be the same")


def write_together(named: Sequence[tuple[str, Summary]], path: Path) -> None:
    """Draw the envelopes in units of omega d, a kind of line a sweep.

    Raises:
        InputError: see `check_alike`, or if the file cannot be written.
    """
    check_alike(named)
    write_picture(lambda: draw_together(named), path, "--out")


def draw_together(named: Sequence[tuple[str, Summary]]) -> Figure:
    """The picture: seen from above, front upward; the limit without a step is the circle at 1."""
    figure = Figure(figsize=(WIDTH, 4.9), layout="constrained")
    axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
    axes.set_theta_zero_location("N")
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(circle, np.ones_like(circle), linestyle=(0, (1, 3)), color=INK, linewidth=1.0, label="no step")
    for line, (name, summary) in zip(_LINES, named, strict=False):
        for controller, own in by_controller(summary, summary["robust"]).items():
            look = summary["controllers_shown"][controller]
            ways = [math.radians(one["direction_deg"]) for one in own]
            sizes = [one["over_omega_d"] or 0.0 for one in own]
            words = legend_label(f"{look['label']}, {name}")
            axes.plot(
                [*ways, ways[0]],
                [*sizes, sizes[0]],
                linestyle=line,
                marker=look["marker"],
                markersize=3.2,
                linewidth=1.5,
                color=look["colour"],
                label=words,
            )
    ticks = np.arange(0, 360, 45)
    axes.set_thetagrids(ticks, [COMPASS.get(float(tick), f"{tick}°") for tick in ticks])
    axes.set_rlabel_position(22.5)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.spines["polar"].set_visible(False)
    axes.tick_params(axis="y", labelsize=7.5, labelcolor=SOFT)
    figure.suptitle("Largest robust push, Δv/(ωd)", fontsize=10, fontweight="bold")
    figure.legend(loc="outside lower center", ncols=2, fontsize=8, handlelength=3.2)
    return figure


def together_table(named: Sequence[tuple[str, Summary]]) -> Table:
    """The thresholds in units of omega d: a row a sweep and controller; of many directions mean and worst only."""
    rows = []
    every = sorted({one["direction_deg"] for _, summary in named for one in summary["robust"]})
    for name, summary in named:
        for controller, own in by_controller(summary, summary["robust"]).items():
            at = {one["direction_deg"]: fixed(one["over_omega_d"], capped=one["capped"]) for one in own}
            row = {"Δv/(ωd)": f"{label(summary, controller)}, {name}"}
            if len(every) <= _FEW:
                row |= {degrees(way): at.get(way, "") for way in every}
            row |= dict(zip(("mean", "worst"), condensed(own, "over_omega_d"), strict=True))
            known = [one for one in own if one["over_omega_d"] is not None]
            least = min(known, key=lambda one: one["over_omega_d"], default=None)
            row |= {"worst at": "" if least is None else degrees(least["direction_deg"]), "directions": str(len(own))}
            rows.append(row)
    return Table(title="Robust recoverable push", rows=tuple(rows), strong="mean")
