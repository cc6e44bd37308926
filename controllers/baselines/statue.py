"""The null controller `statue`: stands as it stood at first, whatever happens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.interface import BalanceCommand, Decision, FootReference, Observation, Phase, Setting
from controllers.pendulum import Pendulum
from controllers.registry import NoOptions
from models.arena import SIDES

Array = NDArray[np.float64]


class Statue:
    """Null controller: a rigid body on two feet.

    The ZMP it commands is that of a rigid body: whatever stops the COG within one tick, as far as the support polygon
    allows. On the humanoid it is the layer `hold` that acts.

    Attributes:
        decisions: the one at the start.
    """

    label, colour, marker = "statue", "#808080", "^"
    layer = "hold"

    def __init__(self, setting: Setting, options: NoOptions) -> None:
        self._sole = setting.robot.sole_vertices["left"]
        a, b = Pendulum(setting.robot.omega, setting.dt).axis(1)
        # [p, pd] one tick later has pd = a[1] . [p, pd] + b[1] u = 0
        self._stop = np.kron(np.eye(2), -a[1] / b[1])
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self._support: SupportPolygon | None = None

    def command(self, observation: Observation) -> BalanceCommand:
        """Stand."""
        feet = observation.feet
        if self._support is None:
            self._support = support_polygon(
                [Foot(position=feet[side].position[:2], yaw=feet[side].yaw, sole=self._sole) for side in SIDES]
            )
            self.decisions.append(
                Decision(
                    time=observation.time,
                    phase=Phase.STANDING,
                    reason="start: holds the initial joint targets",
                    regulator_slack=float("nan"),
                )
            )
        zmp = self._support.nearest(self._stop @ observation.balance_state())
        return BalanceCommand(
            zmp=zmp, feet={side: FootReference.standing(feet[side], feet[side].yaw) for side in SIDES}
        )
