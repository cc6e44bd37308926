"""How far the measured ZMP is from the edge of the soles on the floor."""

from __future__ import annotations

import math
from operator import sub

import numpy as np

from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.interface import Observation
from models.arena import SIDES
from models.robot import Robot

# A polygon of two soles that have moved by no more than this [m, rad] is still the same.
_SAME = 1e-4


class SupportSlack:
    """Asked every tick: what does not change is not worked out anew."""

    def __init__(self, robot: Robot) -> None:
        """Take the soles of a robot."""
        self._vertices = robot.sole_vertices["left"]
        self._sole = SupportPolygon(self._vertices)
        self._both: tuple[list[float], SupportPolygon] | None = None

    def of(self, observation: Observation) -> float:
        """Distance to the nearest edge [m], negative outside; NaN without floor contact."""
        feet = [foot for side in SIDES if (foot := observation.feet[side]).force > 0.0]
        if not feet or math.isnan(observation.zmp[0]):
            return math.nan
        if len(feet) == 1:
            # in the frame of the sole, which is always the same
            x, y = (observation.zmp - feet[0].position[:2]).tolist()
            cos, sin = math.cos(feet[0].yaw), math.sin(feet[0].yaw)
            return self._sole.slack(np.array([cos * x + sin * y, cos * y - sin * x]))
        key = [value for foot in feet for value in (*foot.position[:2].tolist(), foot.yaw)]
        known = self._both
        if known is None or max(map(abs, map(sub, key, known[0]))) > _SAME:
            soles = [Foot(position=foot.position[:2], yaw=foot.yaw, sole=self._vertices) for foot in feet]
            self._both = known = key, support_polygon(soles)
        return known[1].slack(observation.zmp)
