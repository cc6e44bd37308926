"""Fig. 4 and 5 of the paper: the walk, and its tracking sets in the planes of x and of y."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from models.arena import SIDES
from sim.record.palette import COG, FEET, SUPPORT, ZMP
from sim.set_study.walk import FeetCourse, Walk, feet_course, tracking_outline

Array = NDArray[np.float64]

TIMES = (0.0, 0.5, 1.0, 1.5, 2.0)
_GRID = "#e4e4e4"
_STANDING = 1e-3  # [m/s]


def draw_walk(walk: Walk) -> Figure:
    """Fig. 4: snapshots from above, and COG, ZMP, feet and support over time."""
    reference, course = walk.reference, feet_course(walk)
    figure = Figure(figsize=(14.0, 9.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    _title(figure, "Fig. 4  Referential trajectory of the walk", _setting(walk), 0.963)
    snapshots = np.linspace(0, reference.m, 9).round().astype(int)
    upper = figure.add_gridspec(1, len(snapshots), left=0.06, right=0.985, top=0.865, bottom=0.53, wspace=0.08)
    for column, k in enumerate(snapshots):
        axes = figure.add_subplot(upper[column])
        _snapshot(axes, walk, course, int(k))
        axes.set_xlabel("y [m]")
        if column == 0:
            axes.set_ylabel("x [m]  (forward is up)")
        else:
            axes.tick_params(labelleft=False)
    lower = figure.add_gridspec(2, 1, left=0.06, right=0.985, top=0.46, bottom=0.105, hspace=0.1)
    panels = [figure.add_subplot(lower[row]) for row in (0, 1)]
    for axis, panel in enumerate(panels):
        _over_time(panel, walk, course, axis)
    panels[0].tick_params(labelbottom=False)
    panels[1].set_xlabel("time [s]")
    keys = [
        Line2D([], [], color=COG, linewidth=2.2, marker="o", label="COG"),
        Line2D([], [], color=ZMP, linewidth=1.3, marker="o", markersize=5, label="ZMP"),
        Line2D([], [], color=FEET, linestyle="-", marker="o", markersize=4, label="left foot"),
        Line2D([], [], color=FEET, linestyle="--", marker="o", markersize=4, label="right foot"),
        Line2D([], [], color="#909090", linestyle=":", label="sole in the air"),
        Patch(color=SUPPORT, alpha=0.3, label="support polygon (over time: its extent)"),
    ]
    figure.legend(handles=keys, loc="lower center", ncol=6, frameon=False)
    return figure


def _snapshot(axes: Axes, walk: Walk, course: FeetCourse, k: int) -> None:
    reference = walk.reference
    axes.add_patch(Polygon(reference.support(k).vertices[:, ::-1], color=SUPPORT, alpha=0.3, linewidth=0))
    for side in SIDES:
        position = course.position[side][k, :2]
        sole = walk.feet[side].moved(position).vertices[:, ::-1]
        down = course.down[side][k]
        style: dict[str, Any] = {"color": FEET, "linewidth": 1.1} if down else {"color": "#909090", "linestyle": ":"}
        axes.add_patch(Polygon(sole, fill=False, **style))
        axes.plot(position[1], position[0], "o", color=FEET if down else "#909090", markersize=4)
    cog = reference.xi[: k + 1, 0::2]
    axes.plot(cog[:, 1], cog[:, 0], color=COG, linewidth=0.8, alpha=0.6)
    axes.plot(*reference.mu[min(k, reference.m - 1)][::-1], "o", color=ZMP, markersize=6)
    axes.plot(*cog[-1][::-1], "o", color=COG, markersize=6)
    axes.set_title(f"t = {k * reference.dt:.2f} s", fontsize=11)
    # y to the left, as seen by who walks.
    axes.set(xlim=(0.105, -0.105), ylim=(-0.08, 0.4), xticks=(0.05, -0.05), aspect="equal")
    axes.grid(color=_GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _over_time(panel: Axes, walk: Walk, course: FeetCourse, axis: int) -> None:
    reference = walk.reference
    time = np.arange(reference.m + 1) * reference.dt
    extent = np.array([np.array([p.vertices.min(axis=0), p.vertices.max(axis=0)]) for p in reference.supports])
    low, high = extent[reference.support_of, :, axis].T
    panel.fill_between(time, np.append(low, low[-1]), np.append(high, high[-1]), step="post", color=SUPPORT, alpha=0.3,
                       linewidth=0)  # fmt: skip
    for side, style in zip(SIDES, ("-", "--"), strict=True):
        panel.plot(time, course.position[side][:, axis], color=FEET, linestyle=style, linewidth=1.2)
    panel.plot(time[:-1], reference.mu[:, axis], color=ZMP, linewidth=1.3)
    panel.plot(time, reference.xi[:, 2 * axis], color=COG, linewidth=2.2)
    panel.set_xlim(0.0, time[-1])
    panel.set_ylabel(f"{'xy'[axis]} [m]  ({('forward', 'left')[axis]} is up)")
    panel.grid(color=_GRID, linewidth=0.8)
    panel.set_axisbelow(True)


def draw_plane_of_walk(walk: Walk, plane: str, figure_name: str) -> tuple[Figure, list[dict[str, Any]]]:
    """Fig. 5(a) or (b): the tracking sets at five times in the plane of x or of y.

    Returns:
        The figure, and the facts of every set in it.
    """
    axis = 0 if plane == "x-xdot" else 1
    name = "xy"[axis]
    figure = Figure(figsize=(12.0, 8.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.075, 0.20, 0.9, 0.655))
    facts: list[dict[str, Any]] = []
    keys: list[Line2D | Patch] = []
    shades = colormaps["YlGn"](np.linspace(0.45, 1.0, len(TIMES)))
    for time, shade in zip(TIMES, shades, strict=True):
        k = round(time / walk.reference.dt)
        shadow = tracking_outline(walk, k, plane, "projection", figure_name)
        cut = tracking_outline(walk, k, plane, "slice", figure_name)
        facts += [shadow.facts, cut.facts]
        axes.fill(*shadow.vertices.T, color=shade, alpha=0.22, linewidth=0)
        axes.plot(*_closed(shadow.vertices).T, color=shade, linewidth=2.0)
        axes.plot(*_closed(cut.vertices).T, color=shade, linewidth=1.1, linestyle=(0, (4, 2)))
        xi = walk.reference.xi[k, 2 * axis : 2 * axis + 2]
        axes.plot(*xi, "o", color=COG, markeredgecolor="white", markersize=8, zorder=6)
        place: dict[str, Any] = {"textcoords": "offset points", "fontsize": 11, "weight": "bold", "zorder": 7}
        # Above the set if the COG goes forward or left there, else below it, for sets on the way back overlap.
        above = xi[1] > -_STANDING
        tip = shadow.vertices[(np.argmax if above else np.argmin)(shadow.vertices[:, 1])]
        offset = (0, 5) if above else (0, -16)
        axes.annotate(f"{time:.1f} s", tip, xytext=offset, ha="center", color=shade * [0.75, 0.75, 0.75, 1], **place)
        words = f"t = {time:.1f} s: {1e4 * shadow.facts['area']:.0f} | {1e4 * cut.facts['area']:.0f}"
        keys.append(Patch(facecolor=(*shade[:3], 0.3), edgecolor=shade, linewidth=2.0, label=words))
    path = walk.reference.xi[:, 2 * axis : 2 * axis + 2]
    axes.plot(*path.T, color=COG, linewidth=1.0, alpha=0.7, zorder=5)
    keys += [
        Line2D([], [], color="#2f7d3a", linewidth=2.0, label="projection over the other axis"),
        Line2D([], [], color="#2f7d3a", linewidth=1.1, linestyle="--", label=r"slice at the reference $\xi_k$"),
        Line2D([], [], color=COG, marker="o", linewidth=1.0, label=r"reference $\xi$, dot: $\xi_k$"),
    ]
    figure.legend(handles=keys, loc="lower center", ncol=4, frameon=False, fontsize=10.5,
                  title="area of projection | slice [cm²/s]")  # fmt: skip
    axes.set_xlabel(f"COG position {name} [m]" + ("" if axis == 0 else "  (left is positive)"))
    axes.set_ylabel(rf"COG velocity $\dot {name}$ [m/s]")
    axes.margins(0.03, 0.07)
    axes.grid(color=_GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    letter = figure_name[-1]
    head = f"Fig. 5({letter})  Tracking sets of the walk in the {name}–{name}̇ plane"
    _title(figure, head, _setting(walk), 0.955)
    return figure, facts


def _closed(vertices: Array) -> Array:
    return np.vstack([vertices, vertices[:1]])


def _setting(walk: Walk) -> str:
    steps = len(walk.reference.supports) // 3
    return (
        f"{walk.robot.name}, {steps} steps of 0.5 s, stride 0.1 m; {walk.gain.name}, "
        f"dt {1e3 * walk.pendulum.dt:g} ms, ω {walk.pendulum.omega:.2f} 1/s"
    )


def _title(figure: Figure, words: str, setting: str, height: float) -> None:
    figure.text(0.02, height, words, fontsize=15, weight="bold", va="center")
    figure.text(0.02, height - 0.035, setting, fontsize=11, color="#505050", va="center")
