"""How far the measured ZMP is from the edge of the soles on the floor, without their polygon being built."""

from __future__ import annotations

import math

import numpy as np

from controllers.compiled import compiled
from controllers.geometry.planar import COLLINEAR
from controllers.interface import Observation
from models.arena import SIDES
from models.robot import Robot


class SupportSlack:
    """Asked at every tick, with feet that are never quite where they were."""

    def __init__(self, robot: Robot) -> None:
        """Take the soles of a robot."""
        self._sole = np.array(robot.sole_vertices["left"])

    def of(self, observation: Observation) -> float:
        """Distance to the nearest edge [m], negative outside; NaN without floor contact."""
        feet = [foot for side in SIDES if (foot := observation.feet[side]).force > 0.0]
        x, y = observation.zmp.tolist()
        if not feet or math.isnan(x):
            return math.nan
        first, last = feet[0], feet[-1]
        ax, ay, _ = first.position.tolist()
        bx, by, _ = last.position.tolist()
        return _hull_slack(self._sole, ax, ay, first.yaw, bx, by, last.yaw, x, y)


@compiled
def _hull_slack(
    sole: np.ndarray, ax: float, ay: float, a_yaw: float, bx: float, by: float, b_yaw: float, x: float, y: float
) -> float:
    """Distance from a point to the nearest edge line of the hull of two equal soles [m], negative outside.

    An edge is a line through two corners that leaves no corner on its right. That costs more comparisons than a hull
    does for many corners, but soles have four to a few, and most lines are given up at the first corner or two.

    Args:
        sole: (n, 2) outline of either sole, counter-clockwise, foot frame [m].
        ax, ay, a_yaw: where one of them is, world frame [m, rad].
        bx, by, b_yaw: where the other is; the same again for one sole alone.
        x, y: the point [m].
    """
    n = len(sole)
    corners = np.empty((2 * n, 2))
    for i in range(n):
        u, v = sole[i, 0], sole[i, 1]
        c, s = math.cos(a_yaw), math.sin(a_yaw)
        corners[i, 0], corners[i, 1] = ax + c * u - s * v, ay + s * u + c * v
        c, s = math.cos(b_yaw), math.sin(b_yaw)
        corners[n + i, 0], corners[n + i, 1] = bx + c * u - s * v, by + s * u + c * v
    least = math.inf
    for i in range(2 * n):
        px, py = corners[i, 0], corners[i, 1]
        for j in range(2 * n):
            ex, ey = corners[j, 0] - px, corners[j, 1] - py
            length = math.sqrt(ex * ex + ey * ey)
            # Corners that are one have no line.
            if length <= COLLINEAR:
                continue
            edge = True
            for k in range(2 * n):
                if ex * (corners[k, 1] - py) - ey * (corners[k, 0] - px) < -COLLINEAR * length:
                    edge = False
                    break
            if edge:
                slack = (ex * (y - py) - ey * (x - px)) / length
                if slack < least:
                    least = slack
    return least
