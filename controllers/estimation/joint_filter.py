"""Joint speeds from encoders that give angles only."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]


# Tracking index at which the speed is corrected by the whole error: beyond, as for slow encoders, it would overshoot.
_DIFFERENCE = 2.0 + math.sqrt(2.0)


class JointFilter:
    """An alpha-beta filter a joint, at the steady gains of a Kalman filter for a randomly accelerated angle.

    Attributes:
        position, velocity: (n,) of the joints [rad, rad/s]; written over.
    """

    def __init__(self, noise: float, acceleration: float) -> None:
        """Take the two figures that the gains follow from.

        Args:
            noise: standard deviation of an angle [rad].
            acceleration: standard deviation of a joint's acceleration, constant from sample to sample [rad/s^2].
        """
        self._noise, self._acceleration = noise, acceleration
        self._gains: dict[float, tuple[float, float]] = {}
        self.position = np.zeros(0)
        self.velocity = np.zeros(0)
        self._since = 0.0

    def reset(self, position: Array) -> None:
        """Begin at rest at angles (n,) [rad]."""
        self.position, self.velocity = position.copy(), np.zeros_like(position)
        self._since = 0.0

    def predict(self, dt: float) -> None:
        """Go on at the present speeds for `dt` [s]."""
        _go_on(self.position, self.velocity, dt)
        self._since += dt

    def correct(self, measured: Array) -> None:
        """Take in angles (n,) [rad] of now."""
        if self._since <= 0.0:
            return
        # periods are sums of decimal fractions: those that differ by rounding are one
        period = round(self._since, 9)
        alpha, beta = self._gains.get(period) or self._gains.setdefault(period, self._steady(period))
        _correct(self.position, self.velocity, measured, alpha, beta / period)
        self._since = 0.0

    def _steady(self, dt: float) -> tuple[float, float]:
        """Gains for a period [s], by Kalata's tracking index."""
        index = min(self._acceleration * dt * dt / self._noise, _DIFFERENCE)
        root = (4.0 + index - math.sqrt(8.0 * index + index * index)) / 4.0
        alpha = 1.0 - root * root
        return alpha, 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)


@compiled
def _go_on(position: Array, velocity: Array, dt: float) -> None:
    for i in range(len(position)):
        position[i] += dt * velocity[i]


@compiled
def _correct(position: Array, velocity: Array, measured: Array, alpha: float, per_time: float) -> None:
    for i in range(len(position)):
        error = measured[i] - position[i]
        position[i] += alpha * error
        velocity[i] += per_time * error
