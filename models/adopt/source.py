"""Somebody else's robot, read: its root, its legs and its pose at home."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass, field
from pathlib import Path

import mujoco

from models.adopt.hints import Hints
from models.arena import SIDES, Side
from models.errors import InputError, one_line

_GRAVITY = 9.81


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
        """Put the data into the pose at home."""
        name = self.hints.keyframe
        if name is None and self.model.nkey == 0:
            mujoco.mj_resetData(self.model, self.data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0 if name is None else self.model.key(name).id)
        mujoco.mj_kinematics(self.model, self.data)

    def find_legs(self, feet: dict[Side, int]) -> None:
        """Take the feet, and find the hinges of either leg.

        Raises:
            InputError: if the feet are not at the ends of two legs.
        """
        self.feet = feet
        all_of = {side: self.hinges(feet[side]) for side in SIDES}
        shared = set(all_of["left"]) & set(all_of["right"])
        self.legs = {side: [j for j in all_of[side] if j not in shared] for side in SIDES}
        names = {side: [self.model.joint(j).name for j in self.legs[side]] for side in SIDES}
        if min(map(len, self.legs.values())) < 3 or len(self.legs["left"]) != len(self.legs["right"]):
            raise InputError(
                f"{self.path}: the legs to the feet {self.model.body(feet['left']).name!r} and "
                f"{self.model.body(feet['right']).name!r} have the joints {names['left']} and {names['right']}; each "
                f"needs as many as the other, and at least 3"
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
    _refuse_loops(spec, path)
    _take_out_the_world(spec, notes)
    _weld(spec, hints, path, notes)
    _float(spec, path, notes)
    _set_options(spec, notes)
    _name_all(spec)
    if hints.keyframe is not None and hints.keyframe not in (names := [key.name for key in spec.keys]):
        raise InputError(f"{path}: keyframe: {hints.keyframe!r} is none of {names}")
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path}: cannot be compiled: {one_line(error)}") from None
    source = Source(path=path, hints=hints, spec=spec, model=model, data=mujoco.MjData(model), root=1, notes=notes)
    for i in range(1, model.njnt):
        if model.jnt_type[i] != mujoco.mjtJoint.mjJNT_HINGE:
            raise InputError(
                f'{path}: the joint {model.joint(i).name!r} is no hinge; weld = ["{model.joint(i).name}"] '
                f"in robot.toml takes it out"
            )
    source.go_home()
    return source


def _refuse_loops(spec: mujoco.MjSpec, path: Path) -> None:
    for what, things in (("equality constraint", spec.equalities), ("tendon", spec.tendons), ("flex", spec.flexes)):
        for thing in things:
            raise InputError(
                f"{path}: has the {what} {thing.name!r}; only trees of links with a motor a joint are taken"
            )


def _take_out_the_world(spec: mujoco.MjSpec, notes: list[str]) -> None:
    # Geoms of explicit pairs are solid though their bits are 0.
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for kind in (spec.pairs, spec.excludes, spec.sensors, spec.lights, spec.cameras, spec.skins):
        for thing in list(kind):
            spec.delete(thing)
    world = list(spec.worldbody.geoms)
    for geom in world:
        spec.delete(geom)
    if world:
        notes.append(f"{len(world)} geoms of the world were left out; the program has a floor of its own")
    for geom in spec.geoms:
        if geom.name and geom.name in paired:
            geom.contype = geom.conaffinity = 1
    for body in list(spec.worldbody.bodies):
        if len(spec.worldbody.bodies) > 1 and not _moves(body):
            notes.append(f"the body {body.name!r}, which stands still, was left out")
            spec.delete(body)


def _moves(body: mujoco.MjsBody) -> bool:
    return bool(len(body.joints)) or any(_moves(child) for child in body.bodies)


def _weld(spec: mujoco.MjSpec, hints: Hints, path: Path, notes: list[str]) -> None:
    hints.check_patterns([joint.name for joint in spec.joints], str(path))
    gone = {joint.name for joint in spec.joints if any(fnmatch.fnmatchcase(joint.name, p) for p in hints.weld)}
    if not gone:
        return
    for actuator in [each for each in spec.actuators if each.target in gone]:
        spec.delete(actuator)
    for joint in [each for each in spec.joints if each.name in gone]:
        spec.delete(joint)
    for key in list(spec.keys):  # their qpos is of another size
        spec.delete(key)
    notes.append(f"welded, as asked: {', '.join(sorted(gone))}; the keyframes went with them")


def _float(spec: mujoco.MjSpec, path: Path, notes: list[str]) -> None:
    roots = list(spec.worldbody.bodies)
    if len(roots) != 1:
        raise InputError(f"{path}: has {len(roots)} bodies at its root, {[body.name for body in roots]}; one is needed")
    (root,) = roots
    free = [joint for joint in root.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if not free:
        if len(root.joints):
            raise InputError(f"{path}: the root body {root.name!r} has the joint {root.joints[0].name!r} to the world")
        root.add_freejoint()
        for key in list(spec.keys):
            spec.delete(key)
        notes.append(f"the root body {root.name!r} was fixed to the world; now it floats")


def _set_options(spec: mujoco.MjSpec, notes: list[str]) -> None:
    option = spec.option
    x, y, z = option.gravity
    if x or y or z >= 0.0:
        option.gravity = [0.0, 0.0, -_GRAVITY]
        notes.append(f"gravity was [{x:g}, {y:g}, {z:g}]; it is [0, 0, {-_GRAVITY}] now")
    if option.disableflags or option.enableflags:
        option.disableflags = option.enableflags = 0
        notes.append("flags of <option> were taken back to MuJoCo's defaults")


def _name_all(spec: mujoco.MjSpec) -> None:
    for kind, things in (("body", spec.bodies[1:]), ("joint", spec.joints)):
        taken = {thing.name for thing in things}
        for i, thing in enumerate(things):
            if not thing.name:
                thing.name = next(name for k in range(len(taken) + 1) if (name := f"{kind}_{i + k}") not in taken)
                taken.add(thing.name)
