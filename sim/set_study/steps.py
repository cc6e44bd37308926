"""The N-step sets in the plane of the DCM, seen from the stance foot: what the supervisor decides by."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from controllers.geometry.polytope import polygon_area
from controllers.nstep.step_sets import StepSets
from controllers.stepping.set_policy import SetPolicy
from controllers.supervisor.supervisor import Supervisor
from models.robot import Robot, Side
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.record.palette import COG, FEET

Array = NDArray[np.float64]

# Shares of the step that are still to go, and of the largest stride that the foot in the air is then ahead.
_MOMENTS = ((1.0, 0.0), (0.6, 0.3), (0.2, 0.5))
_SHOWN = (1, 2, 3, 4)
_STANCE: Side = "right"
_SWING: Side = "left"
_REACH = "#b03060"


def draw_step_sets(robot: Robot) -> tuple[Figure, list[dict[str, Any]]]:
    """The sets of 1, 2, ... steps on the right foot at lift-off and later, with the default stepping.

    Returns:
        The figure, and steps, time_left [s], area [m^2] and rows of every set in it.
    """
    rule = _default_rule(robot)
    sets = rule.sets
    step_time = sets.step_times[len(sets.step_times) // 2]
    counts = sorted({*(n for n in _SHOWN if n <= sets.max_steps), sets.max_steps})
    colours = dict(zip(counts, colormaps["viridis"](np.linspace(0.85, 0.0, len(counts))), strict=True))
    figure = Figure(figsize=(11.0, 8.4), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(_MOMENTS), sharex=True, sharey=True)
    figure.subplots_adjust(left=0.07, right=0.985, top=0.85, bottom=0.16, wspace=0.06)
    facts = []
    for axes, (share, ahead) in zip(panels, _MOMENTS, strict=True):
        left = sets.pendulum.dt * round(share * step_time / sets.pendulum.dt)
        shown = rule.lift_sets if share == 1.0 else rule.sets
        swing = np.array([ahead * sets.limits.max_stride, sets.limits.stance_width])
        for steps in reversed(counts):
            polygon = shown.polygon(steps, _STANCE, left, swing, step_time=step_time)
            corners = polygon.vertices()
            _draw(axes, corners, facecolor=(*colours[steps][:3], 0.08), edgecolor=colours[steps], linewidth=1.8)
            facts.append({"steps": steps, "time_left": left, "area": polygon_area(corners), "rows": len(polygon.a)})
        _draw_feet(axes, robot, swing)
        (x1, y1), (x2, y2) = shown.boxes(_STANCE, sets.tick(left), swing, step_time)[0]
        corners = np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]])
        _draw(axes, corners, facecolor="none", edgecolor=_REACH, linestyle="--", linewidth=1.2)
        if share == 1.0:
            axes.plot(*(0.5 * swing)[::-1], "o", color=COG, markersize=6, zorder=4)
        axes.set_title("at lift-off" if share == 1.0 else f"{left:g} s before landing", loc="left", fontsize=12)
        axes.set_xlabel("y of the DCM [m]  (left is left)")
        axes.set_aspect("equal")
        axes.grid(color="#e4e4e4", linewidth=0.8)
        axes.set_axisbelow(True)
    panels[0].invert_xaxis()
    panels[0].set_ylabel("x of the DCM from the stance foot [m]  (forward is up)")
    keys: list[Line2D | Patch] = [
        Line2D([], [], color=colour, linewidth=2.0, label=f"{n} step{'s' if n > 1 else ''}")
        for n, colour in colours.items()
    ]
    keys += [
        Patch(facecolor="#d8d8d8", edgecolor=FEET, label=f"{_STANCE} sole, on the floor"),
        Line2D([], [], color=FEET, linestyle=":", label=f"{_SWING} sole, in the air"),
        Line2D([], [], color=_REACH, linestyle="--", label="where its middle can land"),
        Line2D([], [], color=COG, marker="o", linestyle="none", label="rest between the feet"),
    ]
    figure.legend(handles=keys, loc="lower center", ncol=5, frameon=False, fontsize=10.5)
    figure.text(0.02, 0.95, "N-step sets: DCMs from which N footholds within reach lead to a stand", fontsize=15,
                weight="bold")  # fmt: skip
    setting = (
        f"{robot.name}; steps of {step_time:g} s, stride up to {sets.limits.max_stride:g} m, feet up to "
        f"{sets.limits.swing_speed:.2g} m/s, from rest at up to {rule.lift_sets.limits.swing_acceleration:.0f} m/s² at "
        f"lift-off; ZMP {1e3 * _margin(robot, sets):.0f} mm inside the soles"
    )
    figure.text(0.02, 0.912, setting, fontsize=11, color="#505050")
    return figure, facts


def _default_rule(robot: Robot) -> SetPolicy:
    controller = make_controller(Scenario(description="default stepping", world="pendulum"), robot)
    assert isinstance(controller, Supervisor)
    assert isinstance(controller.rule, SetPolicy)
    return controller.rule


def _margin(robot: Robot, sets: StepSets) -> float:
    return float(robot.sole_vertices[_STANCE][:, 0].max() - sets.sole.vertices[:, 0].max())


def _draw_feet(axes: Any, robot: Robot, swing: Array) -> None:
    _draw(axes, robot.sole_vertices[_STANCE], facecolor="#d8d8d8", edgecolor=FEET, linewidth=1.0, zorder=1)
    aloft = robot.sole_vertices[_SWING] + swing
    _draw(axes, aloft, facecolor="none", edgecolor=FEET, linestyle=":", linewidth=1.2)


def _draw(axes: Any, corners: Array, *, zorder: int = 2, **look: Any) -> None:
    """A polygon seen from above, forward up."""
    axes.fill(corners[:, 1], corners[:, 0], zorder=zorder, **look)
