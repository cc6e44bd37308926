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
    """State and covariance; `predict` by the IMU, `correct` by what is known of the contacts. All are written over.

    Attributes:
        rotation: (3, 3) from the trunk's frame to the world.
        velocity, position: (3,) of the IMU in the world [m/s, m].
        gyro_bias, accelerometer_bias: (3,) [rad/s, m/s^2].
        covariance: (15, 15) of the error, in that order.
        rate, acceleration: (3,) of the trunk in its frame [rad/s] and of the IMU in the world [m/s^2], by the last
            sample, without bias.
    """

    def __init__(self, noise: Noise, gravity: float) -> None:
        self._noise = noise
        self._gravity = np.array([0.0, 0.0, -gravity])
        self._transition = np.eye(SIZE)
        self.rate, self.acceleration = np.zeros(3), np.zeros(3)
        # by the period: times are sums of decimal fractions, so that periods differ by rounding
        self._wandering: dict[float, Array] = {}
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
        self.rate[:], self.acceleration[:] = 0.0, 0.0

    def predict(self, gyro: Array, accelerometer: Array, dt: float) -> None:
        """Go on by `dt` [s] as the IMU says of the time since its last sample.

        Args:
            gyro: (3,) angular velocity [rad/s].
            accelerometer: (3,) specific force [m/s^2].
            dt: [s].
        """
        if (added := self._wandering.get(dt)) is None:
            added = self._wandering[dt] = self._wanders(dt)
        _without_bias(gyro, accelerometer, self.gyro_bias, self.accelerometer_bias, self.rate, self.acceleration)
        _propagate(
            self.rotation,
            self.velocity,
            self.position,
            self.covariance,
            self._transition,
            added,
            self.rate,
            self.acceleration,
            self._gravity,
            dt,
        )

    def correct(self, H: Array, excess: Array, variance: Array) -> None:
        """Take away what the estimate has in excess.

        Args:
            H: (m, 15) of it by the error.
            excess: (m,) what the estimate says minus what was found.
            variance: (m,) of that.
        """
        _correct(
            self.rotation,
            self.velocity,
            self.position,
            self.gyro_bias,
            self.accelerometer_bias,
            self.covariance,
            H,
            excess,
            variance,
        )

    def straighten(self) -> None:
        """Make the attitude a rotation again, which rounding wears off."""
        _straighten(self.rotation)

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
def _without_bias(
    gyro: Array, accelerometer: Array, gyro_bias: Array, accelerometer_bias: Array, rate: Array, force: Array
) -> None:
    for k in range(3):
        rate[k] = gyro[k] - gyro_bias[k]
        force[k] = accelerometer[k] - accelerometer_bias[k]


@compiled
def _propagate(
    R: Array, v: Array, p: Array, P: Array, F: Array, added: Array, rate: Array, force: Array, gravity: Array, dt: float
) -> None:
    """Take R, v, p and P on by dt; F is the last transition, whose entries that change are set.

    The specific force (3,) in the trunk's frame becomes the acceleration in the world.
    """
    acceleration = (R @ turn(0.5 * dt * rate)) @ force + gravity

    turned = -dt * R
    F[3:6, 0:3] = dt * skew(gravity)
    F[3:6, 9:12] = skew(v) @ turned
    F[6:9, 9:12] = skew(p) @ turned
    F[0:3, 9:12] = turned
    F[3:6, 12:15] = turned
    for i in range(3):
        F[6 + i, 3 + i] = dt
    # F is the unit matrix but for a few blocks of the first nine rows
    gained = np.empty((9, SIZE))
    for i in range(9):
        for k in range(SIZE):
            total = P[i, k]
            for j in range(9, 12):
                total += F[i, j] * P[j, k]
            gained[i, k] = total
    for i in range(3):
        for k in range(SIZE):
            for j in range(3):
                gained[3 + i, k] += F[3 + i, j] * P[j, k] + F[3 + i, 12 + j] * P[12 + j, k]
            gained[6 + i, k] += dt * P[3 + i, k]
    P[:9] = gained
    for i in range(SIZE):
        for k in range(9):
            total = P[i, k]
            for j in range(9, 12):
                total += F[k, j] * P[i, j]
            gained[k, i] = total
        for k in range(3):
            for j in range(3):
                gained[3 + k, i] += F[3 + k, j] * P[i, j] + F[3 + k, 12 + j] * P[i, 12 + j]
            gained[6 + k, i] += dt * P[i, 3 + k]
    for i in range(SIZE):
        for k in range(9):
            P[i, k] = gained[k, i]
    for i in range(SIZE):
        P[i, i] += added[i]

    R[:] = R @ turn(dt * rate)
    p += dt * v + (0.5 * dt * dt) * acceleration
    v += dt * acceleration
    force[:] = acceleration


@compiled
def _taken_in(P: Array, H: Array, excess: Array, variance: Array) -> Array:
    """(15,) error of the estimate; P becomes what is left of it.

    What is measured is taken in row by row, for the rows' errors are independent: the same as all at once.
    """
    error, spread = np.zeros(SIZE), np.empty(SIZE)
    for row in range(len(excess)):
        spread[:] = 0.0
        left = excess[row]
        for j in range(SIZE):
            if H[row, j] != 0.0:
                left -= H[row, j] * error[j]
                for i in range(SIZE):
                    spread[i] += P[i, j] * H[row, j]
        innovation = variance[row]
        for j in range(SIZE):
            innovation += H[row, j] * spread[j]
        for i in range(SIZE):
            gain = spread[i] / innovation
            error[i] += gain * left
            for k in range(i, SIZE):
                P[i, k] -= gain * spread[k]
                P[k, i] = P[i, k]
    return error


@compiled
def _correct(
    R: Array, v: Array, p: Array, gyro: Array, accelerometer: Array, P: Array, H: Array, excess: Array, variance: Array
) -> None:
    """Turn and move the estimate back by what it is off, biases and covariance with it."""
    error = _taken_in(P, H, excess, variance)
    back = turn(-error[0:3])
    R[:] = back @ R
    v[:] = back @ v - error[3:6]
    p[:] = back @ p - error[6:9]
    gyro -= error[9:12]
    accelerometer -= error[12:15]


@compiled
def _straighten(R: Array) -> None:
    """One Newton step towards the nearest rotation: the error is of the order of rounding."""
    R[:] = R @ (1.5 * np.eye(3) - 0.5 * (R.T @ R))
