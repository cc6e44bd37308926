"""Who pushes: what the momentum about the floor gains beyond what weight and floor give."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
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
            settling: time constant with which a push is believed [s]; that of a state each is the quickest.
            threshold: force below which none is reported [N].
        """
        self._mass, self._settling, self._threshold = robot.mass, settling, threshold
        self._lowest = _UPRIGHT * robot.cog_height
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self._found, self._explained, self.force = np.zeros(2), np.full(2, math.nan), np.zeros(3)

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
        weighed = self._mass, max(self._settling, dt), height / high
        _look(self._found, self._explained, cog, velocity, spin, zmp, load, dt, *weighed)
        x, y = self._found.tolist()
        self.force = np.array([x, y, 0.0]) if math.hypot(x, y) > self._threshold else np.zeros(3)


@compiled
def _look(
    found: Array,
    explained: Array,
    cog: Array,
    velocity: Array,
    spin: Array,
    zmp: Array,
    load: float,
    dt: float,
    mass: float,
    settling: float,
    lever: float,
) -> None:
    """Take the force (2,) that was found and the momentum (2,) that it explains, NaN at first, to the next state."""
    high = cog[2]
    for k in range(2):
        momentum = mass * velocity[k] + (spin[1] if k == 0 else -spin[0]) / high
        if math.isnan(explained[k]):
            explained[k] = momentum
        driven = lever * found[k]
        if not math.isnan(zmp[0]):
            driven += (load / high) * (cog[k] - zmp[k])
        explained[k] += dt * driven
        found[k] = (momentum - explained[k]) / (settling * lever)
