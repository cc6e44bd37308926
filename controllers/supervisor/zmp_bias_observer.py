"""What the ZMP of a standing body stays off its command by, learned from what is measured."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import SupportPolygon
from models.scale import Scale

Array = NDArray[np.float64]

# Friction and strain between the legs hold the ZMP back. How far is seen while the DCM is slower than this [m/s],
# smoothed over this time [s], and made up for as far as this along each axis [m]; all of a robot of scale 1.
CALM, SMOOTHING, MOST = 0.1, 0.1, 0.02


class ZmpBiasObserver:
    """Integrates what is left between the ZMP that was wanted and the one that came of it."""

    def __init__(self, dt: float, scale: Scale) -> None:
        """Begin without an offset, with a control period of `dt` [s], for a robot of that scale."""
        self._share = dt / (SMOOTHING * scale.time)
        self._calm, self._most = CALM * scale.speed, MOST * scale.length
        self.forget()

    def forget(self) -> None:
        """A foot is lifted: another stance has another offset."""
        self._wanted: Array | None = None
        self._offset = np.zeros(2)

    def see(self, measured: Array, dcm_rate: Array) -> None:
        """Learn from the measured ZMP (2,) [m] of the last tick's command, NaN without floor contact."""
        if self._wanted is None or not math.isfinite(measured[0]) or math.hypot(*dcm_rate) > self._calm:
            return
        error = measured - self._wanted
        # At every tick that only stands; np.clip says the same in twice the time.
        self._offset = np.minimum(np.maximum(self._offset + self._share * error, -self._most), self._most)

    def made_up(self, wanted: Array, support: SupportPolygon) -> Array:
        """(2,) what to command within the support, so that the ZMP comes to be where it is wanted (2,) [m]."""
        self._wanted = support.nearest(wanted)
        return support.nearest(wanted - self._offset)
