"""Somebody else's robot, read: its root, its legs and its pose at home."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from models.adopt.clean import clean, without_references
from models.adopt.hints import Hints
from models.arena import SIDES, Side
from models.errors import InputError, one_line

_UPRIGHT = 0.866
"""Cosine of the turn from which on a root's attitude at home is none to stand in."""


@dataclass(kw_only=True)
class Source:
    """A robot as its file has it, without world, sensors and what only its author's tools need.

    Attributes:
        path: its MJCF file.
        hints: what its user says of it.
        spec: its description, still without our names.
        model, data: compiled, and in the pose at home.
        root: body that floats.
        feet: side -> body of the foot.
        legs: side -> hinges from the root to the foot that the other leg does not have.
        notes: what was taken out or set right, in words.
    """

    path: Path
    hints: Hints
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    data: mujoco.MjData
    root: int
    feet: dict[Side, int] = field(default_factory=dict)
    legs: dict[Side, list[int]] = field(default_factory=dict)
    notes: list[str]

    def chain(self, body: int) -> list[int]:
        """Bodies from one up to the root, both included."""
        found = [body]
        while found[-1] != self.root:
            found.append(int(self.model.body_parentid[found[-1]]))
        return found

    def hinges(self, body: int) -> list[int]:
        """Hinges from the root down to a body."""
        model = self.model
        return [
            j
            for each in reversed(self.chain(body)[:-1])
            for j in range(model.body_jntadr[each], model.body_jntadr[each] + model.body_jntnum[each])
        ]

    def go_home(self) -> None:
        """Put the data into the pose at home, with an upright root that looks along x."""
        key = self._key()
        if key is None:
            mujoco.mj_resetData(self.model, self.data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, self.data, key)
        if 2 * self.data.qpos[3] ** 2 - 1 < _UPRIGHT:
            self.data.qpos[3:7] = [1.0, 0.0, 0.0, 0.0]
        mujoco.mj_kinematics(self.model, self.data)

    @property
    def home(self) -> str:
        """The pose at home, in words."""
        key = self._key()
        if key is None:
            return "the pose with all joints at 0"
        return f"the keyframe {self.model.key(key).name or key!r}"

    def _key(self) -> int | None:
        if self.hints.keyframe is not None:
            return int(self.model.key(self.hints.keyframe).id)
        return 0 if self.model.nkey else None

    def find_legs(self, feet: dict[Side, int]) -> None:
        """Take the feet, and find the hinges of either leg.

        Raises:
            InputError: if the feet are not at the ends of two legs.
        """
        if feet["left"] == feet["right"]:
            raise InputError(f"{self.path}: {self.model.body(feet['left']).name!r} is named as both feet")
        left, right = (float(self.data.xpos[feet[side]][1]) for side in SIDES)
        if left <= right:
            raise InputError(
                f"{self.path}: in {self.home} the left foot {self.model.body(feet['left']).name!r} is to the right of "
                f"the right one, y {left:.3g} and {right:.3g} m; y is to the left"
            )
        self.feet = feet
        all_of = {side: self.hinges(feet[side]) for side in SIDES}
        shared = set(all_of["left"]) & set(all_of["right"])
        self.legs = {side: [j for j in all_of[side] if j not in shared] for side in SIDES}
        names = {side: [self.model.joint(j).name for j in self.legs[side]] for side in SIDES}
        if min(map(len, self.legs.values())) < 3 or len(self.legs["left"]) != len(self.legs["right"]):
            raise InputError(
                f"{self.path}: the legs to the feet {self.model.body(feet['left']).name!r} and "
                f"{self.model.body(feet['right']).name!r} have the joints {names['left']} and {names['right']}; each "
                f"needs as many as the other, and at least 3; left_foot and right_foot in robot.toml can name others"
            )


def read_source(path: Path, hints: Hints) -> Source:
    """Read somebody else's robot.

    Raises:
        InputError: if it is no MJCF of one floating robot with hinges; names the cause.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, OSError, mujoco.FatalError) as error:
        raise InputError(f"{path}: not a readable MJCF robot: {one_line(error)}") from None
    notes: list[str] = []
    clean(spec, hints, path, notes)
    if hints.keyframe is not None and hints.keyframe not in (names := [key.name for key in spec.keys]):
        raise InputError(f"{path}: keyframe: {hints.keyframe!r} is none of {names}")
    try:
        model = without_references(spec, spec.compile(), notes)
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path}: cannot be compiled: {one_line(error)}") from None
    _refuse_no_numbers(model, path)
    source = Source(path=path, hints=hints, spec=spec, model=model, data=mujoco.MjData(model), root=1, notes=notes)
    source.go_home()
    if not np.isfinite(source.data.qpos).all():
        raise InputError(f"{path}: {source.home} is not finite")
    return source


def _refuse_no_numbers(model: mujoco.MjModel, path: Path) -> None:
    for what, part, arrays in (
        ("body", model.body, (model.body_pos, model.body_quat, model.body_ipos, model.body_mass, model.body_inertia)),
        ("joint", model.joint, (model.jnt_pos, model.jnt_axis, model.jnt_range)),
        ("joint", lambda dof: model.joint(model.dof_jntid[dof]), (model.dof_armature, model.dof_damping)),
        ("geom", model.geom, (model.geom_pos, model.geom_quat, model.geom_size)),
        ("actuator", model.actuator, (model.actuator_gear, model.actuator_gainprm, model.actuator_forcerange)),
    ):
        for array in arrays:
            for i, numbers in enumerate(array):
                if not np.isfinite(numbers).all():
                    raise InputError(f"{path}: the {what} {part(i).name!r} has a number that is not finite")
