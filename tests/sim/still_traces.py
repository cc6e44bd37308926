"""Traces of robots that only stand, or are moved by hand: pictures need no physics."""

from __future__ import annotations

from typing import Any

import numpy as np

from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.record.trace import ROOT_CHANNELS, SEEN_CHANNELS, TRACE_CHANNELS, Trace

PERIOD = 0.002
ROBOT = load_robot("utmu2")


def scenario(**fields: Any) -> Scenario:
    return Scenario.model_validate({"description": "stands and is moved by hand"} | fields)


def still_trace(run: Scenario, robot: Robot = ROBOT, **changes: Any) -> Trace:
    """The robot in its keyframe, carried by both feet; `changes` are channel=value or (n,) values.

    If a channel of what was seen is among them, the controllers saw the true state but for these.
    """
    time = np.arange(run.ticks) * PERIOD
    columns: dict[str, Any] = dict.fromkeys(TRACE_CHANNELS, 0.0)
    columns |= {"time": time, "cog_z": robot.cog_height, "tracking_slack": np.nan}
    for side in SIDES:
        x, y, yaw = robot.sole_stance[side]
        columns |= {f"{side}_x": x, f"{side}_y": y, f"{side}_yaw": yaw}
        columns |= {f"{side}_force": robot.mass * robot.gravity / 2, f"{side}_stance": 1.0}
    units = dict(TRACE_CHANNELS)
    if set(changes) & set(SEEN_CHANNELS):
        columns |= dict.fromkeys(SEEN_CHANNELS, 0.0) | {"seen_cog_z": robot.cog_height}
        units |= dict(SEEN_CHANNELS)
    if run.world == "humanoid":
        pose = dict.fromkeys(ROOT_CHANNELS) | {f"q_{joint}": None for joint in robot.joint_names}
        columns |= dict(zip(pose, robot.stand, strict=True))
        units |= dict(ROOT_CHANNELS) | {f"q_{joint}": "rad" for joint in robot.joint_names}
    assert set(changes) <= set(units)
    columns |= changes
    facts = {
        "name": robot.name,
        "mass": robot.mass,
        "omega": robot.omega,
        "cog_height": robot.cog_height,
        "sole_vertices": {side: robot.sole_vertices[side].tolist() for side in SIDES},
    }
    return Trace(
        values=np.column_stack([np.broadcast_to(columns[name], time.shape) for name in units]),
        units=units,
        metadata={"scenario": run.as_dict(), "robot": facts},
    )


def during(run: Scenario, start: float, end: float, value: float) -> np.ndarray:
    """(n,) `value` from `start` to before `end` [s], else 0."""
    time = np.arange(run.ticks) * PERIOD
    return np.where((time >= start - 1e-9) & (time < end - 1e-9), value, 0.0)
