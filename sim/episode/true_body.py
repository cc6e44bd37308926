"""The true body and floor, which differ from the robot's file as a scenario says."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.arena import FLOOR
from scenarios.schema import Scenario

Array = NDArray[np.float64]

# Sets these errors apart from what else is drawn with the scenario's seed.
_STREAM = 4


class TrueBody:
    """Makes a compiled model differ from what the controllers know of it: by `[disturbance]`, and `[body]` by the seed.

    Attributes:
        errors: what was drawn for this episode, by the names of links and joints: factors, and shifts [m]; empty if
            nothing was.
    """

    def __init__(self, model: mujoco.MjModel, scenario: Scenario) -> None:
        """Apply what all episodes have in common."""
        self._model, disturbance = model, scenario.disturbance
        if disturbance.mass_scale != 1.0:
            model.body_mass *= disturbance.mass_scale
            model.body_inertia *= disturbance.mass_scale
            # What MuJoCo derives from masses when it compiles.
            mujoco.mj_setConst(model, mujoco.MjData(model))
        if disturbance.friction is not None:
            model.geom(FLOOR).friction[0] = disturbance.friction
        self._floor = model.geom(FLOOR).id
        self._nominal = {name: array.copy() for name, array in self._arrays().items()} if scenario.body.scale else {}
        self.errors: dict[str, Any] = {}

    def _arrays(self) -> dict[str, Array]:
        """All that is changed, as views."""
        model = self._model
        return {
            "mass": model.body_mass,
            "inertia": model.body_inertia,
            "com": model.body_ipos,
            "dry": model.dof_frictionloss,
            "viscous": model.dof_damping,
            "motor": model.actuator_gainprm,
            "floor": model.geom_friction,
        }

    def draw(self, scenario: Scenario) -> None:
        """Begin an episode of a scenario that is alike in what is compiled."""
        body, model = scenario.body, self._model
        if not body.scale:
            return
        now = self._arrays()
        for name, array in now.items():
            array[...] = self._nominal[name]
        rng = np.random.default_rng([scenario.seed, _STREAM])
        links, joints = model.nbody - 1, model.njnt - 1

        def factors(share: float, count: int) -> Array:
            # Of the logarithm, so that no figure can make a mass negative.
            return np.exp(body.scale * share * rng.standard_normal(count))

        mass, friction = factors(body.mass, links), factors(body.joint_friction, joints)
        motor, floor = factors(body.motor, model.actuator_gainprm.shape[0]), float(factors(body.floor_friction, 1)[0])
        com = body.scale * body.com * rng.standard_normal((links, 3))
        now["mass"][1:] *= mass
        now["inertia"][1:] *= mass[:, None]
        now["com"][1:] += com
        now["dry"][6:] *= friction
        now["viscous"][6:] *= friction
        now["motor"][:, 1] *= motor
        now["floor"][self._floor, 0] *= floor
        mujoco.mj_setConst(model, mujoco.MjData(model))
        names = [model.body(i).name for i in range(1, model.nbody)]
        hinges = [model.joint(i).name for i in range(1, model.njnt)]
        driven = [model.joint(int(joint)).name for joint in model.actuator_trnid[:, 0]]
        self.errors = {
            "mass": dict(zip(names, mass.tolist(), strict=True)),
            "com": dict(zip(names, com.tolist(), strict=True)),
            "joint_friction": dict(zip(hinges, friction.tolist(), strict=True)),
            "motor": dict(zip(driven, motor.tolist(), strict=True)),
            "floor_friction": floor,
        }
