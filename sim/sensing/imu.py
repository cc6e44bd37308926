"""The inertial measurement unit in the trunk."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

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
        self._gravity = model.opt.gravity
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
        velocity = data.qvel[:3] + _turned(np.cross(rate, self._at), attitude)
        last = self._last or (data.time, velocity, attitude)
        self._last = (data.time, velocity, attitude)
        force = -self._gravity
        if data.time > last[0]:
            force = force + (velocity - last[1]) / (data.time - last[0])
        true = np.array([rate, _turned(force, _backward(_between(last[2], attitude)))])
        said = true + self._bias + self._spread * self._noise.standard_normal((2, 3))
        return np.clip(said, -self._most, self._most)


def _between(first: Array, second: Array) -> Array:
    """The attitude halfway between two near ones, as quaternions."""
    middle = first + second if first @ second > 0.0 else first - second
    found: Array = middle / np.linalg.norm(middle)
    return found


def _backward(attitude: Array) -> Array:
    """The opposite turn of a quaternion."""
    return attitude * np.array([1.0, -1.0, -1.0, -1.0])


def _turned(vector: Array, attitude: Array) -> Array:
    """(3,) turned by a quaternion."""
    turned = np.zeros(3)
    mujoco.mju_rotVecQuat(turned, vector, attitude)
    return turned
