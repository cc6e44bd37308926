"""The inertial measurement unit in the trunk."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import cross, from_quaternion
from models.robot import Robot
from scenarios.sensing import Imu
from sim.sensing.streams import constant_of, noise_of

Array = NDArray[np.float64]


class InertialUnit:
    """Measures angular velocity and specific force with noise and bias, up to its range.

    The force is the mean since the last sample, from what the velocity gained. MuJoCo's own accelerometer is not asked:
    it tells the acceleration before its integrator damps the joints, and that is not what the body does. Integrated
    over a push and two steps, it was off by 70 mm/s.
    """

    def __init__(self, figures: Imu, robot: Robot, model: mujoco.MjModel, data: mujoco.MjData, seed: int) -> None:
        self._data, self._at = data, robot.imu
        self._gravity = model.opt.gravity.copy()
        self._noise = noise_of("imu", seed)
        constant = constant_of("imu", seed).standard_normal((2, 3))
        self._bias = constant * np.array([[figures.gyro_bias], [figures.accelerometer_bias]])
        self._spread = np.array([[figures.gyro_noise], [figures.accelerometer_noise]])
        limits = [np.inf if most is None else most for most in (figures.gyro_range, figures.accelerometer_range)]
        self._most = np.array(limits)[:, None]
        self._last: tuple[float, Array, Array] | None = None

    def measure(self) -> Array:
        """(2, 3): angular velocity now [rad/s] and specific force [m/s^2], in the trunk's frame; at first of rest."""
        data = self._data
        attitude, rate = data.qpos[3:7].copy(), data.qvel[3:6].copy()
        velocity = _velocity_at(data.qvel[:3], rate, attitude, self._at)
        then = self._last or (data.time, velocity, attitude)
        self._last = (data.time, velocity, attitude)
        true = _felt(rate, velocity, attitude, then[1], then[2], self._gravity, data.time - then[0])
        said = true + self._bias + self._spread * self._noise.standard_normal((2, 3))
        return np.minimum(np.maximum(said, -self._most), self._most)


@compiled
def _velocity_at(velocity: Array, rate: Array, attitude: Array, arm: Array) -> Array:
    """(3,) in the world of a point of the trunk, by that of its origin in the world and its rate in its own frame."""
    return velocity + from_quaternion(attitude) @ cross(rate, arm)


@compiled
def _felt(
    rate: Array, velocity: Array, attitude: Array, old_velocity: Array, old_attitude: Array, gravity: Array, dt: float
) -> Array:
    """(2, 3) rate, and specific force over the time dt since the old state, in the frame of the attitude halfway."""
    sign = 1.0 if (attitude * old_attitude).sum() > 0.0 else -1.0
    halfway = old_attitude + sign * attitude
    halfway /= math.sqrt((halfway * halfway).sum())
    force = -gravity
    if dt > 0.0:
        force = force + (velocity - old_velocity) / dt
    found = np.empty((2, 3))
    found[0] = rate
    found[1] = from_quaternion(halfway).T @ force
    return found
