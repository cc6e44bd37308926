"""How large a push is for the robot that takes it: in units of omega d, the most that a pendulum takes unmoved."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import standing_feet, support_polygon
from models.robot import Robot, load_robot
from scenarios.push import Push

Array = NDArray[np.float64]


def robot_named(name: str) -> Robot:
    """The robot of a scenario, read once in a process, and again if its file has changed since.

    Raises:
        InputError: see `load_robot`.
    """
    path = Path(name)
    return _robot(name, path.stat().st_mtime_ns if path.is_file() else 0)


@functools.lru_cache(maxsize=8)
def _robot(name: str, changed: int) -> Robot:
    return load_robot(name)


def edge_distance(robot: Robot, unit: Array) -> float:
    """From the middle of the feet in `stand` to the edge of their hull, horizontally along `unit` (2,) [m]."""
    feet = [*standing_feet(robot).values()]
    hull = support_polygon(feet)
    middle = 0.5 * (feet[0].position + feet[1].position)
    towards = hull.M @ unit
    ahead = towards > 1e-12
    return float(((hull.v - hull.M @ middle)[ahead] / towards[ahead]).min())


def push_columns(robot: Robot, push: Push, nominal: float | None = None) -> dict[str, Any]:
    """The columns of a table that say how large a push is, and where to.

    Args:
        robot: that is pushed.
        push: as run.
        nominal: direction that was asked for, before the replica turned it [deg]; None if it is the push's own.
    """
    unit = (push if nominal is None else Push(start=0.0, direction=nominal, impulse=1.0)).unit
    flat = float(np.hypot(*unit[:2]))
    distance = edge_distance(robot, unit[:2] / flat) if flat else None
    impulse = float(np.linalg.norm(push.impulse_vector(robot.mass)))
    size = impulse / robot.mass if push.delta_v is None else push.delta_v
    return {
        "direction_deg": push.direction_deg % 360 if nominal is None else nominal % 360,
        "delta_v": size,
        "impulse": impulse,
        "d_edge": distance,
        "delta_v_over_omega_d": size / (robot.omega * distance) if distance else None,
        "delta_v_over_sqrt_gh": size / math.sqrt(robot.gravity * robot.cog_height),
    }
