"""A capture-point controller: the ZMP beyond the capture point, as far as the feet allow. It never steps."""

import numpy as np

from controllers import BalanceCommand, FootReference, Observation, Setting, Strict
from controllers.geometry import Foot, support_polygon


class CapturePoint:
    label, colour = "capture point", "#cc79a7"

    class Options(Strict):
        k: float = 1.5  # ZMP per distance of the capture point from the middle of the feet [1]
        margin: float = 0.008  # that the ZMP keeps from the edges of the feet [m]

    def __init__(self, setting: Setting, options: Options) -> None:
        self.robot, self.options = setting.robot, options

    def command(self, seen: Observation) -> BalanceCommand:
        sole = self.robot.sole_vertices
        feet = [Foot(position=foot.position[:2], yaw=foot.yaw, sole=sole[side]) for side, foot in seen.feet.items()]
        middle = 0.5 * (feet[0].position + feet[1].position)
        capture_point = seen.cog[:2] + seen.cog_velocity[:2] / self.robot.omega
        inside = support_polygon(feet).shrunk(self.options.margin)
        zmp: np.ndarray = inside.nearest(middle + self.options.k * (capture_point - middle))
        return BalanceCommand(zmp=zmp, feet={side: FootReference.standing(f, f.yaw) for side, f in seen.feet.items()})
