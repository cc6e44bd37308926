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
        self._wanted: tuple[float, float] | None = None
        self._offset = 0.0, 0.0

    def see(self, measured: Array, dcm_rate: Array) -> None:
        """Learn from the measured ZMP (2,) [m] of the last tick's command, NaN without floor contact."""
        # Plain floats throughout, for every tick that only stands asks.
        x, y = measured.tolist()
        if self._wanted is None or not math.isfinite(x) or math.hypot(*dcm_rate.tolist()) > self._calm:
            return
        (wanted_x, wanted_y), (offset_x, offset_y) = self._wanted, self._offset
        self._offset = (
            self._limited(offset_x + self._share * (x - wanted_x)),
            self._limited(offset_y + self._share * (y - wanted_y)),
        )

    def _limited(self, offset: float) -> float:
        return -self._most if offset < -self._most else self._most if offset > self._most else offset

    def made_up(self, wanted: Array, support: SupportPolygon) -> Array:
        """(2,) what to command within the support, so that the ZMP comes to be where it is wanted (2,) [m]."""
        x, y = wanted.tolist()
        self._wanted = support.nearest_to(x, y)
        return np.array(support.nearest_to(x - self._offset[0], y - self._offset[1]))
