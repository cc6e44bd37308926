"""The encoders at the joints."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from scenarios.sensing import JointSensors
from sim.sensing.streams import constant_of

Array = NDArray[np.float64]


class Encoders:
    """Measures joint angles with a constant error each, rounded to counts.

    Attributes:
        offset: (n,) the constant errors [rad].
    """

    def __init__(self, figures: JointSensors, joints: int, seed: int) -> None:
        self.offset: Array = figures.offset * constant_of("joint", seed).standard_normal(joints)
        self._count = 2.0 * math.pi / figures.counts if figures.counts else None

    def measure(self, angle: Array) -> Array:
        """(n,) what they say of (n,) true angles [rad]."""
        return angle + self.offset if self._count is None else _counted(angle, self.offset, self._count)


@compiled
def _counted(angle: Array, offset: Array, count: float) -> Array:
    return np.rint((angle + offset) / count) * count
