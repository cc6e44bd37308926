"""The force sensors under the soles."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from models.arena import SIDES
from models.robot import Robot, Side
from scenarios.sensing import FootSensors
from sim.sensing.streams import constant_of, noise_of

Array = NDArray[np.float64]


class FootForce:
    """Measures the normal force on each sole, and the centre of pressure if there is force enough.

    As MuJoCo has it, both are those of the last physics step; `follow` has to be called after every one.
    """

    def __init__(
        self, figures: FootSensors, robot: Robot, model: mujoco.MjModel, data: mujoco.MjData, seed: int
    ) -> None:
        self._figures, self._data = figures, data
        self._at: dict[Side, int] = {side: int(model.sensor(f"{side}_sole").adr[0]) for side in SIDES}
        self._site: dict[Side, int] = {side: model.site(f"{side}_sole").id for side in SIDES}
        self._noise = noise_of("foot", seed)
        scale = 1.0 + figures.scale_error * constant_of("foot", seed).standard_normal(2)
        self._scale = dict(zip(SIDES, scale.tolist(), strict=True))
        self._half_weight = 0.5 * robot.mass * robot.gravity
        self.follow()

    def follow(self) -> None:
        """Remember where the soles are, as the forces of the next physics step refer to that."""
        data = self._data
        self._place = {
            side: (data.site_xpos[site].copy(), data.site_xmat[site].reshape(3, 3).copy())
            for side, site in self._site.items()
        }

    def measure(self) -> tuple[dict[Side, float], dict[Side, Array]]:
        """Normal force [N], and centre of pressure (2,) in the frame of each sole's site [m], NaN without one."""
        figures, data = self._figures, self._data
        forces: dict[Side, float] = {}
        centres: dict[Side, Array] = {}
        for side in SIDES:
            noise = self._noise.standard_normal(3)
            at, (place, turn) = self._at[side], self._place[side]
            # found, net force of the sole on the floor (3), torque (3), point (3), in the world frame
            sensor = data.sensordata[at : at + 10]
            true, centre = _in_sole(sensor, place, turn)
            force = max(0.0, self._scale[side] * true + figures.force_noise * float(noise[0]))
            forces[side] = force
            if sensor[0] > 0.0 and force >= figures.least_force:
                centres[side] = centre + (figures.cop_noise * self._half_weight / force) * noise[1:]
            else:
                centres[side] = np.full(2, np.nan)
        return forces, centres


@compiled
def _in_sole(sensor: Array, place: Array, turn: Array) -> tuple[float, Array]:
    """Normal force [N], and its point (2,) in the frame of a sole at a place (3,), turned by (3, 3)."""
    away = sensor[7:10] - place
    centre = np.array([(turn[:, 0] * away).sum(), (turn[:, 1] * away).sum()])
    return -(turn[:, 2] * sensor[1:4]).sum(), centre
