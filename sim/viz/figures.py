"""One picture of an episode: the paper's Fig. 6 (sets and states) and Fig. 7 (the course of things) together."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sim.episode.set_polygons import PLANES, Plane, SetPolygon
from sim.record.outcome import Result
from sim.record.trace import Trace
from sim.viz.glyphs import make_drawable
from sim.viz.phase_plane import draw_plane
from sim.viz.playback import Playback
from sim.viz.time_series import draw_course

_INCHES, _DPI = (16.0, 9.0), 100
_VERDICT_COLOURS = {Result.RECOVERED: "#1b7a1b", Result.FELL: "#c02020", Result.NOT_SETTLED: "#9a6a00"}


class Episode(Protocol):
    """What of an episode's result the figure needs."""

    @property
    def trace(self) -> Trace:
        """The record."""

    @property
    def set_polygons(self) -> Sequence[SetPolygon]:
        """The sets after each push."""


def draw_episode(result: Episode, path: Path) -> None:
    """Draw an episode into a PNG file of 1600 x 900 pixels; see `episode_figure`."""
    episode_figure(result).savefig(path, format="png", dpi=_DPI)


def episode_figure(result: Episode) -> Figure:
    """Draw an episode.

    Left the planes of position and velocity that pushes go along: the regulator's and the steps' sets and the
    measured state after each of those pushes, as in Fig. 6. Right COG, ZMP, feet and support over time, as in Fig. 7.

    Args:
        result: its trace and its sets.
    """
    playback = Playback(result.trace)
    figure = Figure(figsize=_INCHES, dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    halves = figure.add_gridspec(
        1, 2, width_ratios=(1.0, 1.45), left=0.055, right=0.985, top=0.85, bottom=0.02, wspace=0.14
    )
    pushed = {push.axis for push in playback.pushes if push.end <= playback.time[-1]}
    planes: list[Plane] = [plane for axis, plane in enumerate(PLANES) if axis in pushed or _has(result, plane)]
    planes = planes or ["x-xdot"]
    cells = halves[0].subgridspec(len(planes), 1, hspace=0.22)
    for row, plane in enumerate(planes):
        ratios, space = (8.6 / len(planes), 1.3), 0.18 * len(planes)
        cell = cells[row].subgridspec(2, 1, height_ratios=ratios, hspace=space)
        sets = [polygon for polygon in result.set_polygons if polygon.plane == plane]
        axes, legend = figure.add_subplot(cell[0]), figure.add_subplot(cell[1])
        draw_plane(axes, legend, playback, sets, axis=0 if plane == "x-xdot" else 1)
    draw_course(figure, halves[1], playback)
    _title(figure, playback)
    make_drawable(figure)
    return figure


def _has(result: Episode, plane: Plane) -> bool:
    return any(polygon.plane == plane for polygon in result.set_polygons)


def _title(figure: Figure, playback: Playback) -> None:
    scenario, outcome = playback.scenario, playback.outcome
    whole_body = f", whole body {scenario.whole_body}" if scenario.world == "humanoid" else ""
    setting = (
        f"{playback.trace.metadata['robot']['name']}, {scenario.world} world, controller {scenario.controller}"
        f"{whole_body}, seed {scenario.seed}"
    )
    steps = f"{outcome.steps_taken} step{'' if outcome.steps_taken == 1 else 's'}"
    when = "" if outcome.time_of_fall is None else f" at {outcome.time_of_fall:.2f} s"
    verdict = f"{outcome.result.value.replace('_', ' ')}{when}: {outcome.reason.value}; {steps} taken"
    words = textwrap.shorten(scenario.description, width=140, placeholder=" …")
    # What a user wrote is text, whatever dollars are in it.
    figure.text(0.015, 0.965, words, fontsize=15, weight="bold", va="center", parse_math=False)
    figure.text(0.015, 0.925, setting, fontsize=11, color="#505050", va="center", parse_math=False)
    colour = _VERDICT_COLOURS[outcome.result]
    figure.text(0.985, 0.925, verdict, fontsize=13, weight="bold", color=colour, va="center", ha="right")
