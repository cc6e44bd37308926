"""The inertial measurement unit in the trunk."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.robot import TRUNK, Robot
from scenarios.sensing import Imu
from sim.sensing.streams import constant_of, noise_of

Array = NDArray[np.float64]

_SITE, _GYRO, _ACCELEROMETER = "sensed imu", "sensed gyro", "sensed accelerometer"


def add_imu(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Put MuJoCo's gyro and accelerometer into an uncompiled model, at `Robot.imu`, along the trunk's axes."""
    spec.body(TRUNK).add_site(name=_SITE, pos=robot.imu)
    kinds = mujoco.mjtSensor
    for name, kind in ((_GYRO, kinds.mjSENS_GYRO), (_ACCELEROMETER, kinds.mjSENS_ACCELEROMETER)):
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=_SITE)


class InertialUnit:
    """Measures angular velocity and specific force with noise and bias, up to its range.

    As MuJoCo has it, the force is that of the last physics step, and the angular velocity that at its end.
    """

    def __init__(self, figures: Imu, model: mujoco.MjModel, data: mujoco.MjData, seed: int) -> None:
        self._figures, self._sensors = figures, data.sensordata
        self._at = [int(model.sensor(name).adr[0]) for name in (_GYRO, _ACCELEROMETER)]
        self._noise = noise_of("imu", seed)
        constant = constant_of("imu", seed).standard_normal((2, 3))
        self._bias = constant * np.array([[figures.gyro_bias], [figures.accelerometer_bias]])
        self._spread = np.array([[figures.gyro_noise], [figures.accelerometer_noise]])
        limits = [np.inf if most is None else most for most in (figures.gyro_range, figures.accelerometer_range)]
        self._most = np.array(limits)[:, None]

    def measure(self) -> Array:
        """(2, 3): angular velocity [rad/s] and specific force [m/s^2] now, in the trunk's frame."""
        true = np.array([self._sensors[at : at + 3] for at in self._at])
        said = true + self._bias + self._spread * self._noise.standard_normal((2, 3))
        return np.clip(said, -self._most, self._most)
