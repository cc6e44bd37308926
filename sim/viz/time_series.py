"""COG, ZMP, feet, support and controller over time (Fig. 7 of the paper)."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from controllers.interface import Phase
from models.arena import SIDES
from sim.record.palette import COG, FEET, PHASES, PUSH, SEEN, SUPPORT, ZMP, ZMP_COMMAND
from sim.viz.playback import Playback, PushMark, Seen
from sim.viz.time_scale import NARROWER, TimeScale, time_scale

Array = NDArray[np.float64]

_FOOT_LINES: dict[str, Literal["-", "--"]] = {"left": "-", "right": "--"}
_TOUCHDOWN: dict[str, Any] = {"color": FEET, "linestyle": (0, (1, 2)), "linewidth": 1.0, "zorder": 2}
_LETTER, _LINES = 0.0072, 3  # of the time axis, for a letter of those words; and how many lines there is room for
_WIDE_LABEL, _WIDE_NAME = 0.13, 0.11  # of the time axis, that a push's and a controller's words need


def draw_course(figure: Figure, place: SubplotSpec, playback: Playback) -> None:
    """Draw a strip with the active controller and, under it, x and y over time; then how far off both were seen, if so.

    Args:
        figure: to draw in.
        place: the part of it to fill.
        playback: the episode.
    """
    halves = place.subgridspec(2, 1, height_ratios=(9.0, 0.6), hspace=0.19)
    heights = (0.35, 4, 4) if playback.seen is None else (0.35, 3.1, 3.1, 1.4, 1.4)
    rows = halves[0].subgridspec(len(heights), 1, height_ratios=heights, hspace=0.13)
    strip = figure.add_subplot(rows[0])
    panels = [figure.add_subplot(rows[row], sharex=strip) for row in range(1, len(heights))]
    scale = time_scale(playback)
    scale.apply(strip)
    _draw_phases(strip, playback, scale)
    _name_pushes(strip, playback, scale)
    for axis, panel in enumerate(panels):
        scale.shade(panel)
        if axis < 2:
            _draw_axis(panel, playback, axis)
        elif playback.seen is not None:
            _draw_sight(panel, playback, *_sight(playback.seen)[axis - 2])
        for push in playback.pushes:
            panel.axvspan(push.start, push.end, color=PUSH, alpha=0.35, linewidth=0, zorder=1)
        if playback.outcome.time_of_fall is not None:
            panel.axvline(playback.outcome.time_of_fall, color="black", linestyle=":", linewidth=1.5, zorder=6)
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    narrow = f" (shaded: quiet, drawn {NARROWER:g} times narrower)" if scale.quiet else ""
    panels[-1].set_xlabel(f"time [s]{narrow}", fontsize=11)
    legend = figure.add_subplot(halves[1])
    legend.axis("off")
    legend.legend(handles=_keys(playback), loc="center", ncol=5, fontsize=9.5, frameon=False)


def _draw_phases(strip: Axes, playback: Playback, scale: TimeScale) -> None:
    for start, end, phase in playback.phases():
        strip.axvspan(start, end, color=PHASES[phase], linewidth=0)
        if scale.share(start, end) > _WIDE_NAME:
            middle = scale.middle(start, end)
            strip.text(middle, 0.5, phase.name.lower(), color="white", ha="center", va="center", weight="bold")
    strip.set_yticks([])
    strip.tick_params(labelbottom=False, bottom=False)
    strip.set_ylabel("phase", rotation=0, ha="right", va="center", fontsize=10)


def _name_pushes(strip: Axes, playback: Playback, scale: TimeScale) -> None:
    groups = _together(playback)
    named = [
        [f"push {group[0].number}", group[0].words]
        if len(group) == 1
        else [f"{push.number}: {push.words}" for push in group]
        for group in groups
    ]
    wide = [max(_WIDE_LABEL, _LETTER * max(map(len, lines))) for lines in named]
    short = max(map(len, named), default=0) > _LINES or any(
        scale.share(earlier[0].start, later[0].start) < max(widths)
        for (earlier, later), widths in zip(pairwise(groups), pairwise(wide), strict=True)
    )
    first, last = float(playback.time[0]), float(playback.time[-1])
    for group, lines, width in zip(groups, named, wide, strict=True):
        ends = f"{group[0].number}" if len(group) == 1 else f"{group[0].number}-{group[-1].number}"
        words = ends if short else "\n".join(lines)
        # At an end of the axis the words begin or end there, for beyond it is nothing of the picture.
        middle = (group[0].start + min(max(push.end for push in group), last)) / 2
        left, right = scale.share(first, middle) < width / 2, scale.share(middle, last) < width / 2
        strip.annotate(
            words,
            (first if left and not short else last if right and not short else middle, 1.0),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center" if short or not (left or right) else "left" if left else "right",
            va="bottom",
            color=PUSH,
            weight="bold",
            fontsize=9.5,
            annotation_clip=False,
        )


def _together(playback: Playback) -> list[list[PushMark]]:
    """The pushes that began, those that overlap in one group."""
    groups: list[list[PushMark]] = []
    for push in playback.pushes:
        if push.start > playback.time[-1]:
            continue
        if groups and push.start < max(other.end for other in groups[-1]) - 1e-9:
            groups[-1].append(push)
        else:
            groups.append([push])
    return groups


def _draw_axis(panel: Axes, playback: Playback, axis: int) -> None:
    time = playback.time
    extent = playback.support_extent(axis)
    low, high = extent.T
    # "step": a support comes and goes from one tick to the next, without a slope.
    panel.fill_between(time, low, high, color=SUPPORT, alpha=0.22, linewidth=0, step="post", zorder=0)
    for side in SIDES:
        style = _FOOT_LINES[side]
        panel.plot(time, playback.feet[side][:, axis], color=FEET, linestyle=style, linewidth=1.3, zorder=2)
    panel.plot(time, playback.zmp_command[:, axis], color=ZMP_COMMAND, linewidth=0.8, zorder=4)
    panel.plot(time, playback.zmp[:, axis], color=ZMP, linewidth=1.2, zorder=3)
    panel.plot(time, playback.cog[:, axis], color=COG, linewidth=2.2, zorder=5)
    # The ZMP of a robot that falls jumps by metres; what is worth seeing lies around the COG and the feet.
    shown = np.column_stack([playback.cog[:, axis], extent, *(playback.feet[side][:, axis] for side in SIDES)])
    bottom, top = float(np.nanmin(shown)), float(np.nanmax(shown))
    room = max(0.08 * (top - bottom), 0.01)
    panel.set_ylim(bottom - room, top + room)
    panel.set_ylabel(f"{'xy'[axis]} [m]  ({('forward', 'left')[axis]} is up)", fontsize=11)
    panel.grid(color="#e4e4e4", linewidth=0.8)
    panel.set_axisbelow(True)


def _sight(seen: Seen) -> tuple[tuple[Array, str], tuple[Array, str]]:
    """How far off the controllers saw the DCM [mm] and the velocity of the COG [mm/s], (n, 2), and what these are."""
    return (
        (1000.0 * seen.dcm_error, "DCM seen\noff [mm]"),
        (1000.0 * seen.velocity_error, "COG velocity\noff [mm/s]"),
    )


def _draw_sight(panel: Axes, playback: Playback, error: Array, words: str) -> None:
    """How far off the controllers saw, (n, 2) along x and y, before a fall; and when feet came down."""
    fell = playback.outcome.time_of_fall
    shown = playback.time < (np.inf if fell is None else fell)
    time, error = playback.time[shown], error[shown]
    panel.plot(time, error[:, 0], color=SEEN, linestyle="-", linewidth=1.3, zorder=3)
    panel.plot(time, error[:, 1], color=SEEN, linestyle="--", linewidth=1.1, zorder=3)
    for touchdown in playback.touchdowns():
        panel.axvline(touchdown, **_TOUCHDOWN)
    most = max(float(np.nanmax(np.abs(error), initial=0.0)), 0.1)
    panel.set_ylim(-1.15 * most, 1.15 * most)
    panel.axhline(0.0, color="#a0a0a0", linewidth=0.8, zorder=2)
    panel.set_ylabel(words, fontsize=9)
    panel.grid(color="#e4e4e4", linewidth=0.8)
    panel.set_axisbelow(True)


def _keys(playback: Playback) -> list[Line2D | Patch]:
    keys: list[Line2D | Patch] = [
        Line2D([], [], color=COG, linewidth=2.2, label="COG"),
        Line2D([], [], color=ZMP, linewidth=1.2, label="ZMP measured"),
        Line2D([], [], color=ZMP_COMMAND, linewidth=1.2, label="ZMP commanded"),
        *(Line2D([], [], color=FEET, linestyle=_FOOT_LINES[side], label=f"{side} foot") for side in SIDES),
        Patch(color=SUPPORT, alpha=0.22, label="support (extent)"),
    ]
    if playback.seen is not None:
        keys.append(Line2D([], [], color=SEEN, linestyle="-", label="seen less true, x"))
        keys.append(Line2D([], [], color=SEEN, linestyle="--", label="seen less true, y"))
        if playback.touchdowns():
            keys.append(Line2D([], [], label="foot comes down", **_TOUCHDOWN))
    if playback.pushes:
        keys.append(Patch(color=PUSH, alpha=0.35, label="push"))
    active = {phase for _, _, phase in playback.phases()}
    keys += [Patch(color=PHASES[phase], label=phase.name.lower()) for phase in Phase if phase in active]
    if playback.outcome.time_of_fall is not None:
        keys.append(Line2D([], [], color="black", linestyle=":", label="fell"))
    return keys
