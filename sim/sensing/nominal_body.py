"""The body of the robot's file, simulated beside the world for an estimator that looks ahead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.estimation.look_ahead import BodyState, Held
from models.arena import FLOOR, build_arena
from models.robot import TRUNK, Robot, Side
from sim.sensing.servos import Servos

Array = NDArray[np.float64]

_STEP = 0.001
"""Of its physics at most [s]."""
# Nobody knows the true floor: this one is softer and more slippery than the arena's.
_SOLREF, _FRICTION = (0.008, 1.0), 0.7
# Depth at which a loaded sole stands in the floor at the start [m], so that the floor carries from the first step on:
# more than at rest, for where it matters most, in an impact, soles go deeper.
_SINK = 1e-4
# Nobody reads its sensors, and one body falls into no islands that could be solved apart; both only cost time.
_OFF = mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_SENSOR | mujoco.mjtDisableBit.mjDSBL_ISLAND


class SimulatedBody:
    """The nominal body on a flat floor; see `NominalBody`."""

    def __init__(self, robot: Robot, *, at_drive: bool) -> None:
        """Compile it.

        Args:
            robot: whose file it is.
            at_drive: whether references "where I see the joint" are taken from where the drive finds it.
        """
        model = build_arena(robot.path, timestep=_STEP).compile()
        model.opt.disableflags |= _OFF
        floor = model.geom(FLOOR).id
        model.geom_solref[floor], model.geom_friction[floor, 0] = _SOLREF, _FRICTION
        self._model, self._data, self._at_drive = model, mujoco.MjData(model), at_drive
        self._servos = Servos(model, self._data)
        self._trunk = model.body(TRUNK).id
        self._soles = {side: (model.site(f"{side}_sole").id, robot.sole_vertices[side]) for side in robot.sole_vertices}

    def forward(self, state: BodyState, held: Sequence[Held]) -> tuple[Array, Array]:
        """See `NominalBody`; from where the simulation fails, the state as it was."""
        model, data = self._model, self._data
        # All that a step starts from, so that nothing of the last call is left.
        data.qpos[:], data.qvel[:] = state.configuration, state.velocity
        data.act[:], data.qacc_warmstart[:], data.time = 0.0, 0.0, 0.0
        mujoco.mj_kinematics(model, data)
        lowest = [self._lowest(side) for side in state.loaded]
        shift = min(lowest) + _SINK if lowest else 0.0
        data.qpos[2] -= shift
        data.xfrc_applied[self._trunk, :3] = state.push
        for part in held:
            targets = part.targets
            if targets.from_seen and self._at_drive:
                targets = replace(targets, position=data.qpos[7:], velocity=data.qvel[6:])
            self._servos.set(targets)
            steps = max(1, round(part.duration / _STEP))
            model.opt.timestep = part.duration / steps
            mujoco.mj_step(model, data, steps)
        configuration, velocity = data.qpos.copy(), data.qvel.copy()
        if not (np.isfinite(configuration).all() and np.isfinite(velocity).all()):
            return state.configuration, state.velocity
        configuration[2] += shift
        return configuration, velocity

    def _lowest(self, side: Side) -> float:
        """Height of the lowest corner of a sole [m]."""
        site, corners = self._soles[side]
        turn = self._data.site_xmat[site].reshape(3, 3)
        return float(self._data.site_xpos[site, 2] + (corners @ turn[2, :2]).min())
