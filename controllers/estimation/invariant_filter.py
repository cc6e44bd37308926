"""The right-invariant extended Kalman filter: attitude, velocity and place of the IMU, and its biases.

Its error is what turns and moves the whole estimate in the world's frame, so that what is known of a contact point in
the world is linear in it, wherever the estimate is wrong by. Errors are estimate minus truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import skew, turn

Array = NDArray[np.float64]

SIZE = 15
TURN, SPEED, PLACE, GYRO, ACCELEROMETER = (slice(i, i + 3) for i in range(0, SIZE, 3))
_UNIT = np.eye(3)


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
        self._transition = np.eye(SIZE)
        self._period, self._wandering = 0.0, np.zeros(SIZE)
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
        if dt != self._period:
            self._period, self._wandering = dt, self._wanders(dt)
        acceleration: Array = _propagate(
            self.rotation,
            self.velocity,
            self.position,
            self.covariance,
            self._transition,
            self._wandering,
            rate,
            force,
            self._gravity,
            dt,
        )
        return rate, acceleration

    def correct(self, H: Array, excess: Array, variance: Array) -> None:
        """Take away what the estimate has in excess.

        Args:
            H: (m, 15) of it by the error.
            excess: (m,) what the estimate says minus what was found.
            variance: (m,) of that.
        """
        error = _gain_times_excess(self.covariance, H, excess, variance)
        _take_back(self.rotation, self.velocity, self.position, error)
        self.gyro_bias -= error[GYRO]
        self.accelerometer_bias -= error[ACCELEROMETER]

    def straighten(self) -> None:
        """Make the attitude a rotation again, which rounding wears off."""
        # one Newton step towards the nearest: the error is of the order of rounding
        self.rotation = self.rotation @ (1.5 * _UNIT - 0.5 * self.rotation.T @ self.rotation)

    def _wanders(self, dt: float) -> Array:
        """(15,) variance that a step adds."""
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


@compiled
def _propagate(
    R: Array, v: Array, p: Array, P: Array, F: Array, added: Array, rate: Array, force: Array, gravity: Array, dt: float
) -> Array:
    """Take R, v, p and P on by dt; F is the last transition, whose entries that change are set. The acceleration."""
    acceleration = (R @ turn(0.5 * dt * rate)) @ force + gravity

    turned = -dt * R
    F[3:6, 0:3] = dt * skew(gravity)
    F[3:6, 9:12] = skew(v) @ turned
    F[6:9, 9:12] = skew(p) @ turned
    F[0:3, 9:12] = turned
    F[3:6, 12:15] = turned
    for i in range(3):
        F[6 + i, 3 + i] = dt
    P[:] = (F @ P) @ F.T
    for i in range(SIZE):
        P[i, i] += added[i]

    R[:] = R @ turn(dt * rate)
    p += dt * v + (0.5 * dt * dt) * acceleration
    v += dt * acceleration
    return acceleration


@compiled
def _gain_times_excess(P: Array, H: Array, excess: Array, variance: Array) -> Array:
    """(15,) error of the estimate; P becomes what is left of it."""
    spread = P @ H.T
    innovation = H @ spread
    for i in range(len(excess)):
        innovation[i, i] += variance[i]
    gain = np.linalg.solve(innovation, spread.T).T
    left = P - gain @ spread.T
    P[:] = 0.5 * (left + left.T)
    return gain @ excess


@compiled
def _take_back(R: Array, v: Array, p: Array, error: Array) -> None:
    """Turn and move the estimate back by what it is off."""
    back = turn(-error[0:3])
    R[:] = back @ R
    v[:] = back @ v - error[3:6]
    p[:] = back @ p - error[6:9]
