"""Position and velocity of the COG, with the sets that decide whether to step (Fig. 6 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sim.episode.set_polygons import SetPolygon
from sim.record.palette import PUSH, REGULATOR, TRACKER
from sim.viz.playback import Playback

Array = NDArray[np.float64]

_COLOURS = {"regulator": REGULATOR, "tracking": TRACKER}
_LINES = ("-", "--", ":")
_SAME = 1e-3  # [m], [m/s] below which two polygons cannot be told apart in the picture
_LABEL_ROOM = 16.0  # [px] that the number of a push needs to itself
_PLACES = ((8, 6), (-16, 6), (8, -15), (-16, -15), (20, 6), (-28, 6), (20, -15), (-28, -15))  # [px]


def draw_plane(axes: Axes, legend: Axes, playback: Playback, sets: Sequence[SetPolygon], *, axis: int) -> None:
    """Draw the sets and the measured states after each push.

    Args:
        axes: where.
        legend: what the lines mean goes there.
        playback: the episode.
        sets: polygons of this plane.
        axis: 0 for x, 1 for y.
    """
    name = "xy"[axis]
    position = playback.cog[:, axis]
    velocity = playback.trace[f"cog_v{name}"]
    drawn = [polygon for polygon in sets if len(polygon.vertices) >= 3]
    _draw_sets(axes, drawn)
    own = [push for push in playback.pushes if push.axis == axis and push.end <= playback.time[-1]]
    after = [(push.number, playback.tick(push.end)) for push in own]
    ticks = [tick for _, tick in after]
    axes.plot(position, velocity, color="#909090", linewidth=0.7, zorder=2, label="path of the state")
    if ticks:
        axes.plot(
            position[ticks],
            velocity[ticks],
            linestyle="none",
            marker="+",
            markersize=14,
            markeredgewidth=2.4,
            color=PUSH,
            zorder=5,
            label="measured state at the end of a push",
        )
    marks = np.column_stack([position[[0, *ticks]], velocity[[0, *ticks]]])
    _frame(axes, [marks, *(polygon.vertices for polygon in drawn)])
    _number(axes, marks[1:], [number for number, _ in after])
    axes.set_xlabel(f"COG position {name} in the world [m]", fontsize=11)
    axes.set_ylabel(rf"COG velocity $\dot{{{name}}}$ [m/s]", fontsize=11)
    title = "Maximal output admissible sets and the states after the pushes" if drawn else "States after the pushes"
    axes.set_title(title, fontsize=12, loc="left")
    words = (
        "each set is that of the stance at the end of its push; after a step others hold"
        if drawn
        else "no set was computed in this plane"
    )
    axes.grid(color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    handles, labels = axes.get_legend_handles_labels()
    legend.axis("off")
    shown = legend.legend(
        handles,
        labels,
        loc="center",
        ncol=2,
        fontsize=9,
        columnspacing=1.2,
        labelspacing=0.3,
        frameon=False,
        title=words,
    )
    shown.get_title().set(fontsize=9, color="#606060")


def _draw_sets(axes: Axes, sets: Sequence[SetPolygon]) -> None:
    last = max((polygon.push for polygon in sets), default=0)
    for name in ("regulator", "tracking"):
        groups = _alike([polygon for polygon in sets if polygon.name == name])
        many = len(groups) > len(_LINES)
        for i, group in enumerate(groups):
            shown, colour = group[-1], _COLOURS[name]
            axes.fill(
                *shown.vertices.T, color=colour, alpha=0.22 if shown.push == last else 0.08, linewidth=0, zorder=1
            )
            pushes = _ranges([polygon.push for polygon in group])
            when = "after each push" if many else f"after push {pushes}"
            label = f"{name} set {when} ({_kind(shown)})" if not many or i == 0 else None
            style = _LINES[0] if many else _LINES[i]
            _draw_outline(axes, shown, colour, style, label)
    if any(polygon.cut.any() for polygon in sets):
        axes.plot([], [], color="#909090", linestyle=(0, (1, 2)), linewidth=1.5, label="cut off where the legs end")


def _draw_outline(axes: Axes, polygon: SetPolygon, colour: str, style: str, label: str | None) -> None:
    """The edges of a set; those that only the picture has are grey and dotted."""
    following = np.roll(polygon.vertices, -1, axis=0)
    for start, end, cut in zip(polygon.vertices, following, polygon.cut, strict=True):
        look = {"color": "#909090", "linestyle": (0, (1, 2))} if cut else {"color": colour, "linestyle": style}
        axes.plot(*np.array([start, end]).T, linewidth=1.5, zorder=3, **look)
    axes.plot([], [], color=colour, linestyle=style, linewidth=1.5, label=label)


def _alike(sets: list[SetPolygon]) -> list[list[SetPolygon]]:
    """Sets of different pushes that look the same, together."""
    groups: list[list[SetPolygon]] = []
    for polygon in sets:
        for group in groups:
            shape = group[0].vertices
            if (
                group[0].kind == polygon.kind
                and shape.shape == polygon.vertices.shape
                and np.allclose(shape, polygon.vertices, rtol=0.0, atol=_SAME)
            ):
                group.append(polygon)
                break
        else:
            groups.append([polygon])
    return groups


def _ranges(numbers: list[int]) -> str:
    """Ascending numbers in words: "1-3, 5"."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


def _kind(polygon: SetPolygon) -> str:
    other = "y" if polygon.plane == "x-xdot" else "x"
    return f"slice at measured {other}" if polygon.kind == "slice" else f"projection over {other}"


def _frame(axes: Axes, points: Sequence[Array]) -> None:
    """Limits that show these points; the path may leave the picture, in a fall it always does."""
    everything = np.vstack(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    room = np.maximum(0.06 * (high - low), (0.01, 0.03))
    axes.set_xlim(low[0] - room[0], high[0] + room[0])
    axes.set_ylim(low[1] - room[1], high[1] + room[1])


def _number(axes: Axes, marks: Array, numbers: Sequence[int]) -> None:
    """Write the numbers beside the marks, each where no other number or mark is."""
    pixels = axes.transData.transform(marks) if len(marks) else np.empty((0, 2))
    taken: list[Array] = list(pixels)
    for number, mark, pixel in zip(numbers, marks, pixels, strict=True):
        place = max(
            _PLACES,
            key=lambda offset: min(
                min((float(np.linalg.norm(pixel + offset + (4, 4) - other)) for other in taken), default=_LABEL_ROOM),
                _LABEL_ROOM,
            ),
        )
        taken.append(pixel + place + (4, 4))
        axes.annotate(
            str(number),
            mark,
            xytext=place,
            textcoords="offset pixels",
            fontsize=13,
            weight="bold",
            color=PUSH,
            zorder=6,
        )
