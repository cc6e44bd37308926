"""The body of the robot's file, simulated beside the world for an estimator that looks ahead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.estimation.look_ahead import BodyState, Held
from models.arena import FLOOR, SIDES, build_arena
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
        self._qpos, self._qvel = self._data.qpos, self._data.qvel
        self._servos = Servos(model, self._data)
        self._act, self._warmstart = self._data.act, self._data.qacc_warmstart
        self._push = self._data.xfrc_applied[model.body(TRUNK).id, :3]
        sites: dict[Side, int] = {side: model.site(f"{side}_sole").id for side in SIDES}
        where, axes = self._data.site_xpos, self._data.site_xmat
        # by geom; -1 is no sole
        self._sole_of = np.full(model.ngeom, -1)
        for index, side in enumerate(SIDES):
            self._sole_of[model.geom_bodyid == model.site_bodyid[sites[side]]] = index
        self._contact_force = np.zeros(6)
        self._soles = {side: (where[i], axes[i], robot.sole_vertices[side].copy()) for side, i in sites.items()}

    def forward(self, state: BodyState, held: Sequence[Held]) -> tuple[Array, Array, Array]:
        """See `NominalBody`; the state as it was if nothing is held, or if the simulation fails."""
        if not held:
            return state.configuration, state.velocity, state.load
        model, data = self._model, self._data
        # All that a step starts from, so that nothing of the last call is left.
        self._qpos[:], self._qvel[:] = state.configuration, state.velocity
        self._act[:], self._warmstart[:], data.time = 0.0, 0.0, 0.0
        mujoco.mj_kinematics(model, data)
        lowest = [self._lowest(side) for side in state.loaded]
        shift = min(lowest) + _SINK if lowest else 0.0
        self._qpos[2] -= shift
        self._push[:] = state.push
        for part in held:
            targets = part.targets
            at = (self._qpos[7:], self._qvel[6:]) if targets.from_seen and self._at_drive else None
            self._servos.set(targets, at)
            steps = max(1, round(part.duration / _STEP))
            model.opt.timestep = part.duration / steps
            mujoco.mj_step(model, data, steps)
        configuration, velocity = self._qpos.copy(), self._qvel.copy()
        # a sum of squares is finite only of finite numbers
        if not math.isfinite(configuration.dot(configuration) + velocity.dot(velocity)):
            return state.configuration, state.velocity, state.load
        configuration[2] += shift
        return configuration, velocity, self._load()

    def _load(self) -> Array:
        """What floor or other leg press on the left and the right foot (2,) [N]; foot on foot counts on the right."""
        load = np.zeros(2)
        for index, sole in enumerate(self._sole_of[self._data.contact.geom].max(axis=1).tolist()):
            if sole >= 0:
                mujoco.mj_contactForce(self._model, self._data, index, self._contact_force)
                load[sole] += self._contact_force[0]
        return load

    def _lowest(self, side: Side) -> float:
        """Height of the lowest corner of a sole [m]."""
        place, axes, corners = self._soles[side]
        return float(place[2] + _lowest_of(axes, corners))


@compiled
def _lowest_of(axes: Array, corners: Array) -> float:
    """Height of the lowest of corners (k, 2) of a sole above its middle; its axes are (9,) by rows."""
    lowest = math.inf
    for i in range(len(corners)):
        lowest = min(lowest, axes[6] * corners[i, 0] + axes[7] * corners[i, 1])
    return lowest
