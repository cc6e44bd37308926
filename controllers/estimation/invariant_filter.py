"""The right-invariant extended Kalman filter: attitude, velocity and place of the IMU, and its biases.

Its error is what turns and moves the whole estimate in the world's frame, so that what is known of a contact point in
the world is linear in it, wherever the estimate is wrong by. Errors are estimate minus truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.rotation import skew, turn

Array = NDArray[np.float64]

SIZE = 15
TURN, SPEED, PLACE, GYRO, ACCELEROMETER = (slice(i, i + 3) for i in range(0, SIZE, 3))
_UNIT = np.eye(3)
_DIAGONAL = slice(None, None, SIZE + 1)


@dataclass(frozen=True, kw_only=True)
class Noise:
    """How much the state wanders beside what the IMU says.

    Attributes:
        gyro: of its samples [rad/s].
        accelerometer: of its samples, with what shakes the IMU between them [m/s^2].
        gyro_drift: of its bias [rad/s/sqrt(s)].
        accelerometer_drift: of its bias [m/s^2/sqrt(s)].
    """

    gyro: float
    accelerometer: float
    gyro_drift: float
    accelerometer_drift: float


class InvariantFilter:
    """State and covariance; `predict` by the IMU, `correct` by what is known of the contacts.

    Attributes:
        rotation: (3, 3) from the trunk's frame to the world.
        velocity, position: (3,) of the IMU in the world [m/s, m].
        gyro_bias, accelerometer_bias: (3,) [rad/s, m/s^2].
        covariance: (15, 15) of the error, in that order.
    """

    def __init__(self, noise: Noise, gravity: float) -> None:
        self._noise = noise
        self._gravity = np.array([0.0, 0.0, -gravity])
        self._pull = skew(self._gravity)
        self._transition = np.eye(SIZE)
        self.reset(np.eye(3), np.zeros(3), np.zeros(SIZE))

    def reset(self, rotation: Array, position: Array, deviation: Array) -> None:
        """Begin at rest, without biases.

        Args:
            rotation: (3, 3) attitude.
            position: (3,) of the IMU [m].
            deviation: (15,) standard deviations of the error.
        """
        self.rotation, self.position, self.velocity = rotation.copy(), position.copy(), np.zeros(3)
        self.gyro_bias, self.accelerometer_bias = np.zeros(3), np.zeros(3)
        self.covariance = np.diag(deviation**2)

    def predict(self, gyro: Array, accelerometer: Array, dt: float) -> tuple[Array, Array]:
        """Go on by `dt` [s] as the IMU says of the time since its last sample.

        Args:
            gyro: (3,) angular velocity [rad/s].
            accelerometer: (3,) specific force [m/s^2].
            dt: [s].

        Returns:
            Angular velocity (3,) in the trunk's frame [rad/s] and acceleration (3,) in the world [m/s^2], both without
            bias.
        """
        rate, force = gyro - self.gyro_bias, accelerometer - self.accelerometer_bias
        half = self.rotation @ turn(0.5 * dt * rate)
        acceleration: Array = half @ force + self._gravity

        step, turned = self._transition, -dt * self.rotation
        step[SPEED, TURN] = dt * self._pull
        step[3:9, GYRO] = np.concatenate([skew(self.velocity) @ turned, skew(self.position) @ turned])
        step[PLACE, SPEED] = dt * _UNIT
        step[TURN, GYRO] = step[SPEED, ACCELEROMETER] = turned
        self.covariance = step @ self.covariance @ step.T
        self.covariance.ravel()[_DIAGONAL] += self._wandering(dt)

        self.rotation = self.rotation @ turn(dt * rate)
        self.position = self.position + dt * self.velocity + (0.5 * dt * dt) * acceleration
        self.velocity = self.velocity + dt * acceleration
        return rate, acceleration

    def correct(self, H: Array, excess: Array, variance: Array) -> None:
        """Take away what the estimate has in excess.

        Args:
            H: (m, 15) of it by the error.
            excess: (m,) what the estimate says minus what was found.
            variance: (m,) of that.
        """
        spread = self.covariance @ H.T
        innovation = H @ spread
        innovation.ravel()[:: len(excess) + 1] += variance
        gain = np.linalg.solve(innovation, spread.T).T
        error = gain @ excess
        covariance = self.covariance - gain @ spread.T
        self.covariance = 0.5 * (covariance + covariance.T)
        back = turn(-error[TURN])
        self.rotation = back @ self.rotation
        self.velocity = back @ self.velocity - error[SPEED]
        self.position = back @ self.position - error[PLACE]
        self.gyro_bias = self.gyro_bias - error[GYRO]
        self.accelerometer_bias = self.accelerometer_bias - error[ACCELEROMETER]

    def straighten(self) -> None:
        """Make the attitude a rotation again, which rounding wears off."""
        # one Newton step towards the nearest: the error is of the order of rounding
        self.rotation = self.rotation @ (1.5 * _UNIT - 0.5 * self.rotation.T @ self.rotation)

    def _wandering(self, dt: float) -> Array:
        noise = self._noise
        rest = 0.0
        three = np.array(
            [
                (noise.gyro * dt) ** 2,
                (noise.accelerometer * dt) ** 2,
                rest,
                noise.gyro_drift**2 * dt,
                noise.accelerometer_drift**2 * dt,
            ]
        )
        return np.repeat(three, 3)
