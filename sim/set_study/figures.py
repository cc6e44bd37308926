"""The paper's figures of the sets and one of the N-step sets, for a robot of ours, and the numbers behind them."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from controllers.baselines.paper import STEP_TIME, STRIDE
from models.robot import Robot
from sim.episode.recording import robot_facts
from sim.record.versions import commit, versions
from sim.results.table import write_bytes
from sim.set_study.planes import draw_plane_of_walk, draw_walk
from sim.set_study.push import draw_push_course, draw_push_sets, run_pushes
from sim.set_study.solid import draw_solid
from sim.set_study.steps import draw_step_sets
from sim.set_study.walk import STEPS, Walk, plan_walk

NUMBERS = "figures.json"
PICTURES = ("fig2.png", "fig4.png", "fig5a.png", "fig5b.png", "fig6.png", "fig7.png", "steps.png")


def draw_set_figures(folder: Path, robot: Robot, *, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Draw Fig. 2, 4, 5(a), 5(b), 6, 7 and the N-step sets, and write the areas, rows, t* and timings behind them.

    Args:
        folder: where the pictures and `figures.json` go; it must exist.
        robot: whom the walk and the pushes happen to.
        progress: called with the share of the work that is done.

    Returns:
        What `figures.json` holds.
    """
    walk = plan_walk(robot)
    sets: list[dict[str, Any]] = []

    pictures: dict[str, bytes] = {}

    def save(name: str, figure: Any, facts: list[dict[str, Any]]) -> None:
        stream = io.BytesIO()
        figure.savefig(stream, format="png")
        pictures[name] = stream.getvalue()
        sets.extend(facts)
        if progress is not None:
            progress((PICTURES.index(name) + 1) / len(PICTURES))

    save("fig2.png", *draw_solid(walk))
    save("fig4.png", draw_walk(walk), [])
    save("fig5a.png", *draw_plane_of_walk(walk, "x-xdot", "5a"))
    save("fig5b.png", *draw_plane_of_walk(walk, "y-ydot", "5b"))
    pushed, result = run_pushes(robot)
    save("fig6.png", *draw_push_sets(pushed, result))
    save("fig7.png", draw_push_course(pushed, result), [])
    figure, step_sets = draw_step_sets(robot)
    save("steps.png", figure, [])
    numbers = {
        "robot": robot_facts(robot),
        "gain": {"name": walk.gain.name, "F": walk.gain.F.tolist()},
        "dt": walk.pendulum.dt,
        "walk": _walk_facts(walk),
        "sets": sets,
        "step_sets": step_sets,
        "pushes": _push_facts(pushed, result),
        "outcome": result.outcome.result.value,
        "timings_ms": dict(walk.timings_ms),
        "versions": versions(),
        "commit": commit(),
    }
    # All in the end, so that who is stopped has written nothing.
    for name, content in pictures.items():
        write_bytes(content, folder / name)
    write_bytes((json.dumps(numbers, indent=1) + "\n").encode(), folder / NUMBERS)
    return numbers


def _walk_facts(walk: Walk) -> dict[str, Any]:
    return {
        "steps": STEPS,
        "step_time": STEP_TIME,
        "stride": STRIDE,
        "samples": walk.reference.m,
        "zmp_margin": float(walk.reference.margins().min()),
        "tracking_sets": walk.sets.m + 1,
        "tracking_rows": len(walk.sets.a),
    }


def _push_facts(walk: Walk, result: Any) -> list[dict[str, Any]]:
    """Each push with the sets of the first stance at its end."""
    facts = []
    for push in result.pushes:
        tick = round((push.start + push.duration) / walk.pendulum.dt)
        x = [float(result.trace[name][tick]) for name in ("cog_x", "cog_vx", "cog_y", "cog_vy")]
        regulator, tracking = walk.regulator.slack(x), walk.sets.slack(0, x)
        facts.append(
            {
                "start": push.start,
                "delta_v": push.delta_v,
                "state_after": x,
                "regulator_slack": regulator,
                "tracking_slack": tracking,
                "in_regulator_set": regulator >= 0.0,
                "in_tracking_set": tracking >= 0.0,
            }
        )
    return facts
