"""The envelopes of several sweeps of one suite in one picture: with exact state and with real senses, for instance."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from models.errors import InputError
from sim.analysis.summary import summary_of
from sim.presenter.threshold_section import cases
from sim.presenter.who import by_controller
from sim.report.envelope import dress, no_step_circle, ring
from sim.report.style import WIDTH, legend_label, write_picture
from sim.results.table import SUITE, read_sweep

Summary = dict[str, Any]

_LINES: tuple[str, ...] = ("-", "--", ":", "-.")
_COLOURS = ("#c2570c", "#7b3fa0", "#00808c")  # of the sweeps after the first, if all are of one controller
_HOW = ("body", "direction", "delta_v", "impulse", "relative", "duration", "start", "height")
_WIDE = 26  # letters of a label that leave no room for another beside it


@dataclass(frozen=True, kw_only=True)
class NamedSweep:
    """A sweep among others.

    Attributes:
        name: what it is called in picture and table.
        summary: its summary.
        pushes: what of its suite says how the robot is pushed, words -> value.
    """

    name: str
    summary: Summary
    pushes: dict[str, Any]


def read_named(name: str, folder: Path) -> NamedSweep:
    """Read a sweep's folder.

    Raises:
        InputError: if it cannot be read.
    """
    summary, sweep, path = summary_of(folder), read_sweep(folder), folder / SUITE
    try:
        suite = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise InputError(f"{path}: cannot be read; it is written by okiagari sweep") from None
    axes = suite.get("axes", {})
    pushes = {f"axis {axis}": axes.get(axis) for axis in _HOW}
    pushes |= {what: suite.get(what) for what in ("replicas", "replica", "adaptive", "first", "after", "random")}
    return NamedSweep(name=name, summary=summary, pushes=pushes | {"robot's file": sweep.get("robots")})


def check_alike(sweeps: Sequence[NamedSweep]) -> None:
    """Refuse sweeps whose thresholds cannot be laid over each other.

    Raises:
        InputError: if there are more than four, two have one name, or suite, robot, world, pushes or cases differ, or
            no controller is in all of them.
    """
    if len(sweeps) > len(_LINES):
        raise InputError(f"at most {len(_LINES)} sweeps can be told apart in one picture; {len(sweeps)} were given")
    names = [one.name for one in sweeps]
    if len(set(names)) < len(names):
        raise InputError(f"--label: {', '.join(map(repr, names))} must differ")
    for one in sweeps:
        if (count := len(cases(one.summary))) != 1:
            raise InputError(f"{one.name}: {count} cases; sweeps of one case each can be drawn together")
    first, *others = sweeps
    for one in others:
        for what, mine, its in _compared(first, one):
            if mine != its:
                raise InputError(
                    f"{one.name}: its {what} is {its!r}, that of {first.name} is {mine!r}; they must be the same"
                )
        for what, mine in first.pushes.items():
            if one.pushes[what] != mine:
                raise InputError(f"{one.name}: its {what} is not that of {first.name}; they must be the same")
    if not shared(sweeps):
        raise InputError(f"no controller is in all of {', '.join(names)}")


def shared(sweeps: Sequence[NamedSweep]) -> list[str]:
    """The controllers that have thresholds in all of the sweeps, in the order of the first."""
    found = [by_controller(one.summary, one.summary["robust"]) for one in sweeps]
    return [name for name in found[0] if all(name in own for own in found)]


def _compared(first: NamedSweep, other: NamedSweep) -> Iterator[tuple[str, Any, Any]]:
    for what, key in (("suite", "suite"), ("robot", "robots"), ("world", "worlds")):
        yield what, first.summary[key], other.summary[key]
    yield "case", cases(first.summary), cases(other.summary)


def write_together(sweeps: Sequence[NamedSweep], path: Path) -> None:
    """Draw the envelopes in units of omega d, a kind of line a sweep.

    Raises:
        InputError: see `check_alike`, or if the file cannot be written.
    """
    check_alike(sweeps)
    write_picture(lambda: draw_together(sweeps), path, "--out")


def draw_together(sweeps: Sequence[NamedSweep]) -> Figure:
    """Draw the controllers that all sweeps have: seen from above, front upward; the circle at 1 is the no-step limit.

    Lines differ by sweep and colours by controller; of a single controller colours differ by sweep, too.
    """
    names = shared(sweeps)
    figure = Figure(figsize=(WIDTH, 4.9), layout="constrained")
    axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
    no_step_circle(axes)
    longest = 0
    for i, one in enumerate(sweeps):
        for controller, own in by_controller(one.summary, one.summary["robust"]).items():
            if controller not in names:
                continue
            look = one.summary["controllers_shown"][controller]
            words = legend_label(f"{look['label']}, {one.name}")
            longest = max(longest, len(words))
            ring(
                axes,
                [each["direction_deg"] for each in own],
                [each["over_omega_d"] or 0.0 for each in own],
                linestyle=_LINES[i],
                linewidth=1.5,
                marker=look["marker"],
                markersize=3.2,
                color=_COLOURS[i - 1] if i and len(names) == 1 else look["colour"],
                label=words,
            )
    dress(axes)
    figure.suptitle("Largest robust push, Δv/(ωd)", fontsize=10, fontweight="bold")
    figure.legend(loc="outside lower center", ncols=1 if longest > _WIDE else 2, fontsize=8, handlelength=3.2)
    return figure
