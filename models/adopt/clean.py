"""Takes out of a robot's description what only its author's tools need, and sets right what it may say otherwise."""

from __future__ import annotations

import fnmatch
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from models.adopt.hints import Hints
from models.arena import FLOOR, SIDES, TRUNK
from models.conventions import FREE_JOINT
from models.errors import InputError

_GRAVITY = 9.81


def clean(spec: mujoco.MjSpec, hints: Hints, path: Path, notes: list[str]) -> None:
    """Leave one floating tree of hinges, with names that do not clash with ours.

    Args:
        spec: as read; is changed.
        hints: what the user says of the robot.
        path: its file.
        notes: gets what was done, in words.

    Raises:
        InputError: if there is no such tree; names the part that is in the way.
    """
    _refuse_loops(spec, path)
    _take_out_the_world(spec, notes)
    _weld(spec, hints, path, notes)
    _float(spec, path, notes)
    _name_all(spec)
    _refuse_other_joints(spec, path)
    _set_options(spec, notes)
    _give_way_to_ours(spec, notes)
    for body in spec.bodies:
        if body.gravcomp:
            notes.append(f"the body {body.name!r} had gravcomp; now it has its weight")
            body.gravcomp = 0.0


def without_references(spec: mujoco.MjSpec, model: mujoco.MjModel, notes: list[str]) -> mujoco.MjModel:
    """The model with angles that are 0 where the file draws the robot, whatever `ref` says."""
    address = {model.joint(j).name: int(model.jnt_qposadr[j]) for j in range(1, model.njnt)}
    away = [joint for joint in spec.joints if joint.name in address and joint.ref != 0.0]
    if not away:
        return model
    for joint in away:
        for key in spec.keys:
            if len(key.qpos) == model.nq:
                qpos = np.array(key.qpos)
                qpos[address[joint.name]] -= model.qpos0[address[joint.name]]
                key.qpos = qpos
        joint.range = np.array(joint.range) - joint.ref
        joint.springref -= joint.ref
        joint.ref = 0.0
    notes.append(f"angles are counted from the drawn pose, not from ref: {listed(joint.name for joint in away)}")
    return spec.compile()


def listed(names: Any) -> str:
    """Names in one line, six at most."""
    names = list(names)
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _refuse_loops(spec: mujoco.MjSpec, path: Path) -> None:
    for what, things in (("equality constraint", spec.equalities), ("tendon", spec.tendons), ("flex", spec.flexes)):
        for thing in things:
            name = f"the {what} {thing.name!r}" if thing.name else f"an {what}" if what[0] == "e" else f"a {what}"
            raise InputError(f"{path}: has {name}; only trees of links with a motor a joint are taken")


def _refuse_other_joints(spec: mujoco.MjSpec, path: Path) -> None:
    root = spec.worldbody.bodies[0]
    if len(root.joints) != 1:
        raise InputError(
            f"{path}: the root body {root.name!r} has {len(root.joints)} joints; one, the free one, is allowed"
        )
    for joint in spec.joints:
        if joint == root.joints[0]:
            continue
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            kind = mujoco.mjtJoint(joint.type).name.removeprefix("mjJNT_").lower()
            raise InputError(
                f'{path}: the joint {joint.name!r} is a {kind} joint, no hinge; weld = ["{joint.name}"] in robot.toml '
                f"takes it out"
            )


def _take_out_the_world(spec: mujoco.MjSpec, notes: list[str]) -> None:
    # Geoms of explicit pairs are solid though their bits are 0.
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for kind in (spec.pairs, spec.excludes, spec.sensors, spec.lights, spec.cameras, spec.skins, spec.tuples):
        for thing in list(kind):
            spec.delete(thing)
    for texture in list(spec.textures):
        if texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX:
            spec.delete(texture)
    world = list(spec.worldbody.geoms)
    for geom in world:
        spec.delete(geom)
    if world:
        notes.append(f"the world's own geoms, {len(world)}, were left out; the program has a floor")
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
    names = [joint.name for joint in spec.joints if joint.name and joint.type != mujoco.mjtJoint.mjJNT_FREE]
    hints.check_patterns("weld", names, str(path))
    gone = {name for name in names if any(fnmatch.fnmatchcase(name, pattern) for pattern in hints.weld)}
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
            name = root.joints[0].name
            what = f"the joint {name!r}" if name else "a joint without a name"
            raise InputError(f"{path}: the root body {root.name!r} has {what} to the world; it must float or be fixed")
        root.add_freejoint()
        for key in list(spec.keys):
            spec.delete(key)
        notes.append(f"the root body {root.name!r} was fixed to the world; now it floats")


def _set_options(spec: mujoco.MjSpec, notes: list[str]) -> None:
    option, compiler = spec.option, spec.compiler
    x, y, z = option.gravity
    if x or y or z >= 0.0:
        option.gravity = [0.0, 0.0, -_GRAVITY]
        notes.append(f"gravity was [{x:g}, {y:g}, {z:g}]; it is [0, 0, {-_GRAVITY}] now")
    if option.disableflags or option.enableflags:
        option.disableflags = option.enableflags = 0
        notes.append("flags of <option> were taken back to MuJoCo's defaults")
    # Bodies and geoms of the compiled robot are those of its description.
    compiler.fusestatic = compiler.discardvisual = False


def _name_all(spec: mujoco.MjSpec) -> None:
    for kind, things in (("body", spec.bodies[1:]), ("joint", spec.joints)):
        taken = {thing.name for thing in things}
        for i, thing in enumerate(things):
            if not thing.name:
                thing.name = next(name for k in range(len(taken) + 1) if (name := f"{kind}_{i + k}") not in taken)
                taken.add(thing.name)


def _give_way_to_ours(spec: mujoco.MjSpec, notes: list[str]) -> None:
    """Rename what is called like something that the program adds or looks for."""
    root, soles = spec.worldbody.bodies[0], [f"{side}_sole" for side in SIDES]
    (free,) = root.joints
    for kind, things, ours in (
        ("body", spec.bodies[1:], {TRUNK, *soles}),
        ("joint", spec.joints, {TRUNK, FREE_JOINT, *soles}),
        ("site", spec.sites, {TRUNK, *soles}),
        ("geom", spec.geoms, {FLOOR, *soles}),
    ):
        taken = {thing.name for thing in things}
        for thing in things:
            name = thing.name
            if name not in ours or (name == TRUNK and thing == root) or (name == FREE_JOINT and thing == free):
                continue
            new = f"{name}_of_file"
            while new in taken:
                new += "_"
            taken.add(new)
            thing.name = new
            if kind == "joint":
                for actuator in spec.actuators:
                    if actuator.target == name:
                        actuator.target = new
            notes.append(f"the {kind} {name!r} is called {new!r} now: the program has a use for its name")
