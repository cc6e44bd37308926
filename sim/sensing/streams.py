"""Random numbers of the senses: a stream for each sensor, so that the figures of one change nothing of another."""

from __future__ import annotations

from typing import Literal

import numpy as np

# Sets what the senses draw apart from what else is drawn with the scenario's seed.
_STREAM = 3
_SENSORS = ("joint", "imu", "foot")
Sensor = Literal["joint", "imu", "foot"]


def noise_of(sensor: Sensor, seed: int) -> np.random.Generator:
    """What a sensor draws for each sample."""
    return np.random.default_rng([seed, _STREAM, 0, _SENSORS.index(sensor)])


def constant_of(sensor: Sensor, seed: int) -> np.random.Generator:
    """What a sensor draws once an episode."""
    return np.random.default_rng([seed, _STREAM, 1, _SENSORS.index(sensor)])
