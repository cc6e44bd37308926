"""The force sensors under the soles."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from models.arena import SIDES
from models.robot import Robot, Side
from scenarios.sensing import FootSensors
from sim.sensing.streams import constant_of, noise_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class FootForce:
    """Measures the normal force on each sole, and the centre of pressure if there is force enough.

    As MuJoCo has it, both are those of the last physics step; `follow` has to be called after every one.
    """

    def __init__(
        self, figures: FootSensors, robot: Robot, model: mujoco.MjModel, data: mujoco.MjData, seed: int
    ) -> None:
        self._figures = figures
        self._sensors, self._where, self._axes = data.sensordata, data.site_xpos, data.site_xmat
        self._at = np.array([int(model.sensor(f"{side}_sole").adr[0]) for side in SIDES])
        self._sites = np.array([model.site(f"{side}_sole").id for side in SIDES])
        self._noise = noise_of("foot", seed)
        self._scale = 1.0 + figures.scale_error * constant_of("foot", seed).standard_normal(2)
        self._spread = figures.cop_noise * (0.5 * robot.mass * robot.gravity)
        self._places, self._turns = np.zeros((2, 3)), np.zeros((2, 3, 3))
        self.follow()

    def follow(self) -> None:
        """Remember where the soles are, as the forces of the next physics step refer to that."""
        _remember(self._where, self._axes, self._sites, self._places, self._turns)

    def measure(self) -> tuple[dict[Side, float], dict[Side, Array]]:
        """Normal force [N], and centre of pressure (2,) in the frame of each sole's site [m], NaN without one."""
        figures, forces, centres = self._figures, np.empty(2), np.empty((2, 2))
        noise = self._noise.standard_normal((2, 3))
        noises = figures.force_noise, figures.least_force, self._spread
        _measured(self._sensors, self._at, self._places, self._turns, self._scale, noise, *noises, forces, centres)
        return dict(zip(SIDES, forces.tolist(), strict=True)), dict(zip(SIDES, centres, strict=True))


@compiled
def _remember(where: Array, axes: Array, sites: Indices, places: Array, turns: Array) -> None:
    for i in range(len(sites)):
        for k in range(3):
            places[i, k] = where[sites[i], k]
            for j in range(3):
                turns[i, k, j] = axes[sites[i], 3 * k + j]


@compiled
def _measured(
    sensors: Array,
    at: Indices,
    places: Array,
    turns: Array,
    scale: Array,
    noise: Array,
    force_noise: float,
    least_force: float,
    spread: float,
    forces: Array,
    centres: Array,
) -> None:
    """Write the forces (2,) and centres (2, 2)."""
    for i in range(len(at)):
        # found, net force of the sole on the floor (3), torque (3), point (3), in the world frame
        sensor = sensors[at[i] : at[i] + 10]
        true, centre = _in_sole(sensor, places[i], turns[i])
        forces[i] = max(0.0, scale[i] * true + force_noise * noise[i, 0])
        centres[i] = math.nan
        if sensor[0] > 0.0 and forces[i] >= least_force:
            for k in range(2):
                centres[i, k] = centre[k] + (spread / forces[i]) * noise[i, 1 + k]


@compiled
def _in_sole(sensor: Array, place: Array, turn: Array) -> tuple[float, Array]:
    """Normal force [N], and its point (2,) in the frame of a sole at a place (3,), turned by (3, 3)."""
    away = sensor[7:10] - place
    centre = np.array([(turn[:, 0] * away).sum(), (turn[:, 1] * away).sum()])
    return -(turn[:, 2] * sensor[1:4]).sum(), centre
