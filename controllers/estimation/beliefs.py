"""What the estimator believes of sensors and contacts where its options say nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from controllers.estimation.options import EkfOptions
from models.robot import Robot

# No angle is believed to be finer than this [rad], for what joints and links give.
FINEST_ANGLE = 1e-5
# Rate [rad/s] and acceleration [m/s^2] by which the trunk shakes between two samples: what made 0.006 and 0.1 of the
# noise of `typical` sensors, which did best.
SHAKING = (math.sqrt(0.006**2 - 0.005**2), math.sqrt(0.1**2 - 0.05**2))
# Biases believed in at least [rad/s, m/s^2]: one that is taken to be none is never found.
LEAST_BIAS = (0.003, 0.05)
# Half the width of the soles of `utmu2` [m], for which the figures of soles were found.
HALF_SOLE = 0.036
CONTACT_SPEED, EDGE_SPEED, EDGE, FLAT, PUSH_THRESHOLD = 0.01, 0.3, 0.004, 0.010, 3.0
"""For `utmu2`; see the fields of `Beliefs`."""


@dataclass(frozen=True, kw_only=True)
class SensorFigures:
    """What is known of the sensors, and of who else reads them.

    Attributes:
        count: of an encoder [rad]; 0 if it does not round.
        gyro_noise, gyro_bias: standard deviations [rad/s].
        accelerometer_noise, accelerometer_bias: the same [m/s^2].
        at_drive: whether the servos take a reference "where I see the joint" from where they see it themselves.
    """

    count: float = 0.0
    gyro_noise: float = 0.0
    gyro_bias: float = 0.0
    accelerometer_noise: float = 0.0
    accelerometer_bias: float = 0.0
    at_drive: bool = False


@dataclass(frozen=True, kw_only=True)
class Beliefs:
    """The fields of `EkfOptions` of these names, each with a value."""

    encoder: float
    gyro: float
    accelerometer: float
    gyro_bias: float
    accelerometer_bias: float
    contact_speed: float
    edge_speed: float
    edge: float
    flat: float
    push_threshold: float


def beliefs(options: EkfOptions, robot: Robot, sensors: SensorFigures) -> Beliefs:
    """What the options say; what they leave out as the sensors' makers, or the robot's soles, speed and weight do."""
    sole = 0.5 * float(np.ptp(robot.sole_vertices["left"], axis=0).min()) / HALF_SOLE
    figures = {
        "encoder": max(sensors.count / math.sqrt(12.0), FINEST_ANGLE),
        "gyro": math.hypot(sensors.gyro_noise, SHAKING[0]),
        "accelerometer": math.hypot(sensors.accelerometer_noise, SHAKING[1]),
        "gyro_bias": max(sensors.gyro_bias, LEAST_BIAS[0]),
        "accelerometer_bias": max(sensors.accelerometer_bias, LEAST_BIAS[1]),
        "contact_speed": CONTACT_SPEED * robot.scale.speed,
        "edge_speed": EDGE_SPEED * robot.scale.speed,
        "edge": EDGE * sole,
        "flat": FLAT * sole,
        "push_threshold": PUSH_THRESHOLD * robot.scale.force,
    }
    given = {name: getattr(options, name) for name in figures}
    return Beliefs(**{name: figures[name] if value is None else value for name, value in given.items()})
