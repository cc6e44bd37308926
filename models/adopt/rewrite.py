"""Rewrites a robot's description into our conventions, and writes it with its meshes beside it."""

from __future__ import annotations

import math
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np

from models.adopt.clean import listed
from models.adopt.servos import Servo
from models.adopt.soles import Sole, lowest_point
from models.adopt.source import Source
from models.adopt.stand import Stand
from models.arena import SIDES, TRUNK, Side
from models.conventions import FREE_JOINT, STAND
from models.errors import InputError, one_line

ASSETS = "assets"

_LIMIT = math.pi
"""Range of a joint that has none in its file [rad]."""
_VOLTS = 24.0
"""Of all motors: only torque and speed matter, which are stated at the joint."""
_THICK, _THICKEST = 0.1, 0.01
"""Half the thickness of a sole's box: a share of its depth below the ankle, and at most so much [m]."""
_UNDER_FOOT = 0.02
"""What of a foot is this near to its lowest point [m] is in the sole's place."""
_SHRUNK = 0.85
"""Size of the capsule that stands for a mesh, in its bounding box, whose corners no mesh fills."""
_BITS = {"left": (3, 4), "right": (5, 2), None: (1, 0)}
"""contype and conaffinity: 1 the floor, 2 and 4 the legs against each other."""
_SEEN, _HIDDEN = 0, 3
_SOLE_COLOUR = (0.2, 0.4, 0.7, 1.0)
_PLAIN_COLOUR = (0.80, 0.80, 0.82, 1.0)
# What a geom of ours has whatever the defaults of the file are.
_PLAIN = {"mass": 0.0, "margin": 0.0, "gap": 0.0, "priority": 0}
# MuJoCo's code of the inputs "pos vel ff".
_POS_VEL_FF = 1 | 2 | 4


def rewrite(source: Source, soles: dict[Side, Sole], stand: Stand, servos: list[Servo]) -> mujoco.MjSpec:
    """The robot in our conventions, as a compiled specification; `write` puts it into files."""
    spec = source.spec
    _write_inertias_out(source)
    _set_contacts(source, stand)
    for side in SIDES:
        _add_sole(source, side, soles[side])
    _set_root(source)
    _set_joints(source, servos)
    for key in list(spec.keys):
        spec.delete(key)
    spec.add_key(name=STAND, qpos=stand.qpos)
    try:
        spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{source.path}: cannot be rewritten: {one_line(error)}") from None
    return spec


def write(spec: mujoco.MjSpec, source: Path, folder: Path, name: str) -> Path:
    """Write the robot and copies of its meshes and textures.

    Args:
        spec: as `rewrite` gives it.
        source: the file that it came from.
        folder: exists; gets `<name>.xml` and `assets/`.
        name: of the robot.

    Raises:
        InputError: if a mesh or a texture cannot be read.
    """
    try:
        tree = ET.fromstring(spec.to_xml())
    except ET.ParseError as error:
        raise InputError(f"{source}: holds a name that cannot be written: {error}") from None
    tree.set("model", name)
    compiler = tree.find("compiler")
    if compiler is None:
        compiler = ET.SubElement(tree, "compiler")
    for key in ("meshdir", "texturedir", "assetdir", "strippath"):
        compiler.attrib.pop(key, None)
    _copy_assets(spec, tree, source, folder)
    _give_way_to_the_floor(tree)
    ET.indent(tree)
    path = folder / f"{name}.xml"
    path.write_text(ET.tostring(tree, encoding="unicode") + "\n", encoding="utf-8")
    return path


def _copy_assets(spec: mujoco.MjSpec, tree: ET.Element, source: Path, folder: Path) -> None:
    taken: dict[str, Path] = {}
    for kind, beside in (("mesh", spec.meshdir), ("texture", spec.texturedir)):
        named_files = [
            (element, key, named)
            for element in tree.iterfind(f"asset/{kind}")
            for key, named in element.items()
            if key.startswith("file")
        ]
        for element, key, named in named_files:
            original = Path(spec.modelfiledir or source.parent) / (beside or "") / named
            if kind == "mesh" and element.get("name") is None:
                element.set("name", Path(named).stem)
            target = Path(named).name
            while taken.get(target, original) != original:
                target = f"_{target}"
            if target not in taken:
                try:
                    (folder / ASSETS).mkdir(exist_ok=True)
                    shutil.copyfile(original, folder / ASSETS / target)
                except OSError as error:
                    raise InputError(f"{source}: {original} cannot be copied: {error.strerror}") from None
            taken[target] = original
            element.set(key, f"{ASSETS}/{target}")


def _give_way_to_the_floor(tree: ET.Element) -> None:
    """Rename a texture and a material that are called like those of the program's floor."""
    for kind in ("texture", "material"):
        for called in tree.iterfind(f"asset/{kind}"):
            if called.get("name") in ("floor", "sky"):
                called.set("name", f"{called.get('name')}_of_file")
        for user in tree.iter():
            if user.get(kind) in ("floor", "sky"):
                user.set(kind, f"{user.get(kind)}_of_file")


def _write_inertias_out(source: Source) -> None:
    """What MuJoCo made of geoms and density stands in the file, so that geoms may change."""
    model, compiler = source.model, source.spec.compiler
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    compiler.settotalmass, compiler.boundmass, compiler.boundinertia = -1.0, 0.0, 0.0
    for i in range(1, model.nbody):
        body = source.spec.body(model.body(i).name)
        body.explicitinertial = True
        body.mass, body.ipos, body.iquat = model.body_mass[i], model.body_ipos[i], model.body_iquat[i]
        body.inertia = model.body_inertia[i]
        body.fullinertia = [math.nan] + [0.0] * 5
        if model.body_mass[i] == 0.0:  # a frame for cameras and the like; placo wants some
            body.mass, body.inertia = 1e-6, [1e-9] * 3


def _set_contacts(source: Source, stand: Stand) -> None:
    """Primitives keep their contact; a capsule stands for a mesh; what is only seen touches nothing."""
    model, data, spec = source.model, source.data, source.spec
    data.qpos[:] = stand.qpos  # the soles are level
    mujoco.mj_kinematics(model, data)
    on_leg = {side: {int(model.jnt_bodyid[j]) for j in source.legs[side]} for side in SIDES}
    for i in range(1, model.nbody):
        chain = source.chain(i)
        side = next((side for side in SIDES if on_leg[side] & set(chain)), None)
        contype, conaffinity = _BITS[side if source.hints.legs_collide else None]
        geoms = list(range(model.body_geomadr[i], model.body_geomadr[i] + model.body_geomnum[i]))
        solid = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
        seen = [g for g in geoms if g not in solid]
        of_foot = any(source.feet[each] in chain for each in SIDES)
        ground = min((lowest_point(model, data, g) for g in solid), default=0.0)
        body = spec.body(model.body(i).name)
        assert len(body.geoms) == len(geoms)
        primitives = [g for g in solid if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_MESH]
        for geom, g in zip(list(body.geoms), geoms, strict=True):
            geom.mass = 0.0
            geom.margin = geom.gap = 0.0
            geom.priority = 0
            if g in seen:
                geom.contype = geom.conaffinity = 0
                continue
            under = of_foot and lowest_point(model, data, g) - ground < _UNDER_FOOT
            if g not in primitives and not under and not primitives:
                _add_capsule(body, model, g, contype, conaffinity)
            if g not in primitives or under:
                if seen:
                    spec.delete(geom)  # there is something better to look at
                else:
                    geom.contype = geom.conaffinity = 0
                continue
            geom.contype, geom.conaffinity = contype, conaffinity
            geom.group = _HIDDEN if seen else _SEEN
    used = {geom.meshname for geom in spec.geoms}
    for mesh in [mesh for mesh in spec.meshes if (mesh.name or Path(mesh.file).stem) not in used]:
        spec.delete(mesh)
    for field in list(spec.hfields):
        spec.delete(field)


def _add_capsule(body: mujoco.MjsBody, model: mujoco.MjModel, g: int, contype: int, conaffinity: int) -> None:
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, model.geom_quat[g])
    centre, half = model.geom_aabb[g][:3], model.geom_aabb[g][3:]
    axis = int(half.argmax())
    radius = float(np.delete(half, axis).min())
    tip = np.zeros(3)
    tip[axis] = max(_SHRUNK * half[axis] - radius, 1e-3)
    ends = [model.geom_pos[g] + frame.reshape(3, 3) @ (centre + sign * tip) for sign in (-1.0, 1.0)]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=np.concatenate(ends),
        size=[_SHRUNK * radius, 0.0, 0.0],
        contype=contype,
        conaffinity=conaffinity,
        **_PLAIN,
        group=_HIDDEN,
        rgba=_PLAIN_COLOUR,
    )


def _add_sole(source: Source, side: Side, sole: Sole) -> None:
    contype, conaffinity = _BITS[side if source.hints.legs_collide else None]
    body = source.spec.body(source.model.body(sole.body).name)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(sole.turn).ravel())
    half = min(_THICK * sole.depth, _THICKEST)
    body.add_geom(
        name=f"{side}_sole",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[*(sole.size / 2), half],
        pos=sole.centre + sole.turn @ [0.0, 0.0, half],
        quat=quat,
        contype=contype,
        conaffinity=conaffinity,
        **_PLAIN,
        group=_SEEN,
        rgba=_SOLE_COLOUR,
    )
    body.add_site(name=f"{side}_sole", pos=sole.centre, quat=quat, size=[0.005] * 3, group=4)


def _set_root(source: Source) -> None:
    spec = source.spec
    root = spec.body(source.model.body(source.root).name)
    (free,) = (joint for joint in root.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE)
    root.name, free.name = TRUNK, FREE_JOINT
    root.pos, root.quat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]


def _set_joints(source: Source, servos: list[Servo]) -> None:
    spec, unlimited = source.spec, []
    per_radian = math.degrees(1.0) if spec.compiler.degree else 1.0
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for servo, j in zip(servos, range(1, source.model.njnt), strict=True):
        joint = spec.joint(servo.joint)
        limited = bool(source.model.jnt_limited[j])
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = per_radian * (source.model.jnt_range[j] if limited else np.array([-_LIMIT, _LIMIT]))
        unlimited += [] if limited else [servo.joint]
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        joint.armature, joint.frictionloss, joint.damping = servo.armature, servo.friction, [servo.damping, 0.0, 0.0]
        motor = spec.add_actuator(name=servo.joint, target=servo.joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        # The defaults of the file's own motors are none of this one's.
        motor.ctrllimited = motor.actlimited = mujoco.mjtLimited.mjLIMITED_FALSE
        motor.gear, motor.delay, motor.armature = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0, 0.0
        motor.set_to_dcmotor(
            [0.0, 0.0],
            0.0,
            nominal=[_VOLTS, servo.torque, servo.speed],
            saturation=[servo.torque, 0.0, 0.0],
            controller=[servo.stiffness, 0.0, servo.servo_damping, 0.0, 0.0, _VOLTS],
            ctrlspec=_POS_VEL_FF,
        )
    if unlimited:
        source.notes.append(f"joints without a range got -pi to pi: {listed(unlimited)}")
    springs = [joint.name for joint in spec.joints if np.any(joint.stiffness)]
    if springs:
        source.notes.append(f"springs were left in, of which the built-in controllers know nothing: {listed(springs)}")
