"""Fig. 6 and 7 of the paper: falling avoidance on the pendulum by one stepping reference from rest (Section V)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from models.robot import Robot
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode
from sim.record.palette import COG, PUSH, REGULATOR, TRACKER
from sim.set_study.walk import DT, SWING_HEIGHT, Outline, Walk, plan_walk, regulator_outline, tracking_outline
from sim.viz.playback import Playback
from sim.viz.time_series import draw_course

Array = NDArray[np.float64]

STARTS = (3.0, 6.0, 9.0)
# Of the regulator's own limit; the third is as far beyond it as it is from the tracker's.
_SHARES = (0.5, 0.9)


def run_pushes(robot: Robot) -> tuple[Walk, EpisodeResult]:
    """Run the experiment of Section V: pushes at 3, 6 and 9 s in +x, the third beyond the regulator's set.

    Returns:
        The stepping reference (a step ahead, the other foot closes) with its sets, and the episode.
    """
    walk = plan_walk(robot, steps=2)
    own, tracker = (
        _largest_jump(polytope.S, polytope.a, walk.regulator.x_C)
        for polytope in (walk.regulator.in_world(), walk.sets.polytope(0))
    )
    jumps = [*(share * own for share in _SHARES), 0.5 * (own + tracker)]
    # A push of a single tick is the jump of the state that the paper adds.
    pushes = [
        {"start": start, "duration": DT, "direction": 0.0, "delta_v": jump}
        for start, jump in zip(STARTS, jumps, strict=True)
    ]
    scenario = Scenario.model_validate(
        {
            "description": "Section V: three pushes forward, the third outside the regulator's set",
            "world": "pendulum",
            # As in the paper the ZMP may go up to the edges of the feet.
            "controller": {"name": "paper", "edge": 0.0},
            "stepping": {"swing_height": SWING_HEIGHT},
            "duration": 12.0,
            "timing": {"physics": DT, "control": DT},
            "gain": {"kind": "lqr", "q": [1.0, 1.0], "r": 1.0},
            "variation": {"pose": 0.0},
            "pushes": pushes,
        }
    )
    return walk, run_episode(scenario, robot=robot, polygons=False)


def _largest_jump(S: Array, a: Array, x: Array) -> float:
    """Largest velocity jump in +x from state x that stays in {S x <= a} [m/s]."""
    rate, room = S[:, 1], a - S @ x
    return float(np.min(room[rate > 0.0] / rate[rate > 0.0]))


def draw_push_sets(walk: Walk, result: EpisodeResult) -> tuple[Figure, list[dict[str, Any]]]:
    """Fig. 6: the regulator's and the tracker's set in the plane of x, and the state after each push.

    Returns:
        The figure, and the facts of every set in it.
    """
    playback = Playback(result.trace)
    figure = Figure(figsize=(11.0, 8.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.085, 0.175, 0.89, 0.68))
    regulator = regulator_outline(walk.regulator, "x-xdot", "projection", "6")
    tracker = tracking_outline(walk, 0, "x-xdot", "projection", "6")
    keys: list[Line2D | Patch] = []
    for outline, colour, name in (
        (regulator, REGULATOR, r"regulator, $^rO_\infty$"),
        (tracker, TRACKER, r"tracker of the stepping reference, $^tO_\infty$"),
    ):
        _draw_outline(axes, outline, colour)
        words = f"{name}: projection, {1e4 * outline.facts['area']:.0f} cm²/s"
        keys.append(Patch(facecolor=(colour, 0.25), edgecolor=colour, linewidth=2.0, label=words))
    position, velocity = playback.cog[:, 0], playback.trace["cog_vx"]
    axes.plot(position, velocity, color="#707070", linewidth=0.9, zorder=3)
    near = axes.inset_axes((0.075, 0.06, 0.3, 0.4))
    _enlarge(axes, near, playback, (regulator, tracker))
    keys += [
        Line2D([], [], linestyle="none", marker="+", markersize=13, markeredgewidth=2.4, color=PUSH,
               label="state after each push"),
        Line2D([], [], color="#707070", linewidth=0.9, label="path of the state in the episode"),
        Line2D([], [], linestyle="none", marker="o", color=COG, label="rest"),
    ]  # fmt: skip
    axes.plot(*walk.regulator.x_C[:2], "o", color=COG, markersize=7, zorder=6)
    axes.set_xlim(regulator.vertices[:, 0].min() - 0.01, tracker.vertices[:, 0].max() + 0.03)
    axes.set_xlabel("COG position x [m]")
    axes.set_ylabel(r"COG velocity $\dot x$ [m/s]")
    axes.grid(color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    figure.legend(handles=keys, loc="lower center", ncol=2, frameon=False, fontsize=10.5)
    figure.text(0.02, 0.955, "Fig. 6  The third push leaves the regulator's set, not the tracker's", fontsize=15,
                weight="bold")  # fmt: skip
    figure.text(0.02, 0.915, _setting(walk), fontsize=11, color="#505050")
    return figure, [regulator.facts, tracker.facts]


def _enlarge(axes: Any, near: Any, playback: Playback, outlines: tuple[Outline, Outline]) -> None:
    """Mark the states after the pushes, and draw where they are once more, larger and with their times."""
    for outline, colour in zip(outlines, (REGULATOR, TRACKER), strict=True):
        _draw_outline(near, outline, colour)
    position, velocity = playback.cog[:, 0], playback.trace["cog_vx"]
    top = 0.0
    for push in playback.pushes:
        tick = playback.tick(push.end)
        top = max(top, float(velocity[tick]))
        for where in (axes, near):
            where.plot(position[tick], velocity[tick], "+", color=PUSH, markersize=14, markeredgewidth=2.4, zorder=6)
        near.annotate(f"t = {push.start:g} s", (position[tick], velocity[tick]), xytext=(11, -4), color=PUSH,
                      textcoords="offset points", fontsize=11, weight="bold", zorder=7)  # fmt: skip
    near.set(xlim=(-0.006, 0.018), ylim=(0.3 * top, 1.25 * top))
    near.tick_params(labelsize=8)
    near.set_axisbelow(True)
    near.grid(color="#e4e4e4", linewidth=0.6)
    axes.indicate_inset_zoom(near, edgecolor="#707070")


def draw_push_course(walk: Walk, result: EpisodeResult) -> Figure:
    """Fig. 7: COG, ZMP, feet and support over time."""
    figure = Figure(figsize=(14.0, 8.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    place = figure.add_gridspec(1, 1, left=0.075, right=0.985, top=0.81, bottom=0.01)[0]
    playback = Playback(result.trace)
    draw_course(figure, place, playback)
    # A push of one tick is thinner than a pixel; the first axes are the strip, then x and y.
    for panel in figure.axes[1:3]:
        for push in playback.pushes:
            panel.axvline(push.start, color=PUSH, linewidth=1.0, alpha=0.6, zorder=1)
    verdict = f"{result.outcome.result.value}, {result.outcome.steps_taken} steps"
    figure.text(0.02, 0.955, "Fig. 7  Falling avoidance: two pushes answered standing, the third by stepping "
                f"({verdict})", fontsize=15, weight="bold")  # fmt: skip
    figure.text(0.02, 0.915, _setting(walk), fontsize=11, color="#505050")
    return figure


def _setting(walk: Walk) -> str:
    return (
        f"{walk.robot.name} as pendulum; {walk.gain.name}; reference from rest: right foot 0.1 m ahead, left foot "
        "closes, 0.5 s each"
    )


def _draw_outline(axes: Any, outline: Outline, colour: str) -> None:
    axes.fill(*outline.vertices.T, color=colour, alpha=0.2, linewidth=0, zorder=1)
    axes.plot(*np.vstack([outline.vertices, outline.vertices[:1]]).T, color=colour, linewidth=2.0, zorder=4)
