"""Who pushes: what the momentum about the floor gains beyond what weight and floor give."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from models.robot import Robot

Array = NDArray[np.float64]

# Share of its standing height below which the COG is that of a fall, which needs more than soles to hold it up.
_UPRIGHT = 0.5


class PushObserver:
    """A horizontal force on the trunk's COM, by the residual of linear and angular momentum.

    Soles that feel normal forces only do not say how the floor holds a push, but about the ZMP the floor has no
    horizontal torque: of the momentum about it only weight and push remain. It is divided by the COG's height here, so
    that for a point mass it is the linear one.

    Attributes:
        force: (3,) in the world [N].
    """

    def __init__(self, robot: Robot, settling: float, threshold: float) -> None:
        """Take what it works with.

        Args:
            robot: the nominal body.
            settling: time constant with which a push is believed [s].
            threshold: force below which none is reported [N].
        """
        self._mass, self._settling, self._threshold = robot.mass, settling, threshold
        self._lowest = _UPRIGHT * robot.cog_height
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self._found = np.zeros(2)
        self._explained: Array | None = None
        self.force = np.zeros(3)

    def take(self, cog: Array, velocity: Array, spin: Array, zmp: Array, load: float, height: float, dt: float) -> None:
        """Look at the next state.

        Args:
            cog: (3,) [m].
            velocity: (3,) of the COG [m/s].
            spin: (3,) angular momentum about the COG [N m s].
            zmp: (2,) [m]; NaN in the air.
            load: normal force of the floor [N].
            height: of the point that is taken to be pushed [m].
            dt: time since the last state [s].
        """
        high = float(cog[2])
        if high < self._lowest:
            self.reset()
            return
        momentum = self._mass * velocity[:2] + np.array([spin[1], -spin[0]]) / high
        if self._explained is None:
            self._explained = momentum
        lever = height / high
        driven = lever * self._found
        if not math.isnan(float(zmp[0])):
            driven = driven + (load / high) * (cog[:2] - zmp)
        self._explained = self._explained + dt * driven
        self._found = (momentum - self._explained) / (self._settling * lever)
        certain = math.hypot(*self._found.tolist()) > self._threshold
        self.force = np.array([*self._found, 0.0]) if certain else np.zeros(3)
