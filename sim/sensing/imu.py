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
        self._qpos, self._qvel = data.qpos, data.qvel
        # of the last sample: when it was; velocity (3,) and attitude (4,) then
        self._then = math.nan
        self._velocity, self._attitude = np.zeros(3), np.zeros(4)

    def measure(self) -> Array:
        """(2, 3): angular velocity now [rad/s] and specific force [m/s^2], in the trunk's frame; at first of rest."""
        now = self._data.time
        said = np.empty((2, 3))
        _measured(
            self._qpos,
            self._qvel,
            self._velocity,
            self._attitude,
            self._at,
            self._gravity,
            0.0 if math.isnan(self._then) else now - self._then,
            self._bias,
            self._spread,
            self._most,
            self._noise.standard_normal((2, 3)),
            said,
        )
        self._then = now
        return said


@compiled
def _measured(
    qpos: Array,
    qvel: Array,
    old_velocity: Array,
    old_attitude: Array,
    arm: Array,
    gravity: Array,
    dt: float,
    bias: Array,
    spread: Array,
    most: Array,
    noise: Array,
    said: Array,
) -> None:
    """Write what it says (2, 3), and the IMU's velocity and the attitude of now over the old ones."""
    rate, attitude = qvel[3:6].copy(), qpos[3:7].copy()
    velocity = qvel[:3] + from_quaternion(attitude) @ cross(rate, arm)
    if not dt > 0.0:
        old_velocity[:], old_attitude[:] = velocity, attitude
    true = _felt(rate, velocity, attitude, old_velocity, old_attitude, gravity, dt)
    old_velocity[:], old_attitude[:] = velocity, attitude
    for i in range(2):
        for k in range(3):
            felt = true[i, k] + bias[i, k] + spread[i, 0] * noise[i, k]
            said[i, k] = min(max(felt, -most[i, 0]), most[i, 0])


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
