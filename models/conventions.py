"""What a robot's file must keep to, checked on the compiled model: one line names the file and what is wrong."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.arena import FLOOR, SIDES, TRUNK, Side
from models.errors import InputError

Array = NDArray[np.float64]

FREE_JOINT = "root_joint"
_SOLES = tuple(f"{side}_sole" for side in SIDES)
STAND = "stand"
GRAVITY = (0.1, 100.0)
"""Strength of a gravity that a robot can stand in [m/s^2]; that of the Moon is 1.6."""
COG_HEIGHT = (0.05, 5.0)
"""Height of the COG over the soles [m]; the floor's contact gives a millimetre, in 5 ms."""
MASS = (0.05, 5000.0)
"""Of a robot [kg]."""
MOST_JOINTS = 200
SLIVER = 0.02
"""Least side of a sole, as a share of the COG's height."""
LEVEL = math.radians(1.0)
"""Tilt of a sole in the keyframe `stand`, at most [rad]."""
TOED = math.radians(45.0)
"""Turn of a sole inward or outward in the keyframe `stand`, at most [rad]."""
NEAR = 1e-3
"""What is this near to the floor when the soles are on it touches it: they give way so much [m]."""
CLEARANCE = 0.004
"""Between the soles as they pass each other, at least [m]."""
EVEN = 1e-3
"""Distances in the keyframe and on the feet that must be the same are so to within this share of the COG's height."""

# MuJoCo's code of the inputs "pos vel ff" of a <dcmotor>.
_POS_VEL_FF = 1 | 2 | 4
# Flags of <option> without which nobody stands.
_NEEDED = ("CONSTRAINT", "CONTACT", "GRAVITY", "ACTUATION", "CLAMPCTRL", "LIMIT", "SENSOR", "FRICTIONLOSS")
_NAMED = (
    ("joint", FREE_JOINT),
    ("body", TRUNK),
    ("keyframe", STAND),
    *(("geom", f"{side}_sole") for side in SIDES),
    *(("site", f"{side}_sole") for side in SIDES),
)


def check_names(spec: mujoco.MjSpec, path: Path) -> None:
    """Check that a robot has what the program asks for by name, before anything refers to it.

    Args:
        spec: robot and floor, as `build_arena` makes it, not compiled.
        path: the robot's file.

    Raises:
        InputError: names what is missing.
    """
    for kind, name in _NAMED:
        if getattr(spec, "key" if kind == "keyframe" else kind)(name) is None:
            raise _refusal(path, f"the robot has no {kind} named {name!r}")


def check_conventions(model: mujoco.MjModel, path: Path) -> None:
    """Check that a robot can be used.

    Args:
        model: robot and floor, as `build_arena` makes it, compiled after `check_names`.
        path: the robot's file.

    Raises:
        InputError: if it does not keep the conventions of `models/utmu2.xml`.
    """
    # Each check may rely on those before it.
    for check in (_names, _gravity, _tree, _joints, _motors, _feet, _stand, _touched):
        for wrong in check(model):
            raise _refusal(path, wrong)


def _refusal(path: Path, wrong: str) -> InputError:
    return InputError(f"{path}: {wrong}; models/utmu2.xml lists the conventions")


def _names(model: mujoco.MjModel) -> Iterator[str]:
    called = [part(i).name for count, part in _parts(model) for i in range(count)]
    for name in (TRUNK, *(f"{side}_sole" for side in SIDES)):
        if called.count(name) > 1:
            yield f"{name!r} is the name of several bodies, joints and sites; placo cannot tell them apart"
    for kind, count, part in (("body", model.nbody, model.body), ("joint", model.njnt, model.joint)):
        nameless = [i for i in range(count) if not part(i).name]
        if nameless:
            yield f"{kind} {nameless[0]} has no name; every one must have one"


def _parts(model: mujoco.MjModel) -> tuple[tuple[int, Callable[[int], Any]], ...]:
    return (model.nbody, model.body), (model.njnt, model.joint), (model.nsite, model.site)


def _gravity(model: mujoco.MjModel) -> Iterator[str]:
    gravity, (least, most) = model.opt.gravity, GRAVITY
    if gravity[0] or gravity[1] or not least <= -gravity[2] <= most:
        yield f"gravity is {gravity.tolist()}; it must be straight down, [0, 0, -g] with g from {least:g} to {most:g}"
    for name in _NEEDED:
        if model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"):
            yield f'<option><flag {name.lower()}="disable"/> is not allowed'
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        yield '<option><flag override="enable"/> is not allowed, for it takes the place of the floor\'s contact'


def _tree(model: mujoco.MjModel) -> Iterator[str]:
    trunk = model.body(TRUNK).id
    if model.joint(FREE_JOINT).type[0] != mujoco.mjtJoint.mjJNT_FREE or model.joint(FREE_JOINT).bodyid[0] != trunk:
        yield f"{FREE_JOINT!r} is not the free joint of the body {TRUNK!r}"
    roots = [model.body(i).name for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    if roots != [TRUNK]:
        yield f"the root bodies are {roots}; {TRUNK!r} must be the only one"
    if any(model.geom_bodyid[i] == 0 and model.geom(i).name != FLOOR for i in range(model.ngeom)):
        yield "the world has geoms of its own; the program puts the floor under the robot, and there is nothing else"
    for what, count in (("equality constraints", model.neq), ("tendons", model.ntendon), ("flexes", model.nflex)):
        if count:
            yield f"it has {what}; only trees of links with a motor a joint are allowed"
    mass, (least, most) = float(model.body_subtreemass[trunk]), MASS
    if not least <= mass <= most:
        yield f"the mass is {mass:.3g} kg; it must be from {least:g} to {most:g}"
    if min(len(leg_chain(model, side)) for side in SIDES) < 2:
        yield "the soles are not at the ends of two legs: on its way to the trunk each must have two bodies of its own"


def _joints(model: mujoco.MjModel) -> Iterator[str]:
    if model.njnt - 1 > MOST_JOINTS:
        yield f"it has {model.njnt - 1} joints; at most {MOST_JOINTS} are allowed"
    for i in range(1, model.njnt):
        name, (low, high) = model.joint(i).name, model.jnt_range[i]
        if model.jnt_type[i] != mujoco.mjtJoint.mjJNT_HINGE:
            yield f"the joint {name!r} is no hinge"
        elif not (model.jnt_limited[i] and low < high):
            yield f"the joint {name!r} has no range"
        elif model.qpos0[model.jnt_qposadr[i]] != 0.0:
            yield f"the joint {name!r} has a ref; it must be 0"


def _motors(model: mujoco.MjModel) -> Iterator[str]:
    kind = '<dcmotor joint="..." input="pos vel ff" nominal="volts torque speed"/>'
    joints, driven = range(1, model.njnt), model.actuator_trnid[:, 0].tolist()
    for i, joint in enumerate(driven):
        name = model.actuator(i).name
        what = f"the actuator {name!r}" if name else f"actuator {i}"
        resistance, constant, volts = model.actuator_gainprm[i, [0, 1, 7]]
        if model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_JOINT or joint not in joints:
            yield f"{what} drives no joint; every hinge needs one {kind}, and nothing else any"
        if model.actuator_gaintype[i] != mujoco.mjtGain.mjGAIN_DCMOTOR or model.actuator_ctrlspec[i] != _POS_VEL_FF:
            yield f"{what} is not of the kind {kind}"
        if model.actuator_gear[i, 0] != 1.0 or not min(resistance, constant, volts) > 0.0:
            yield f"{what} must have no gear, and more than 0 of resistance, torque and volts"
        if not (model.actuator_forcelimited[i] and model.actuator_forcerange[i, 1] > 0.0):
            yield f"{what} has no limit of its torque, saturation"
        first = model.actuator_ctrladr[i]
        if model.actuator_ctrllimited[first : first + model.actuator_ctrlnum[i]].any():
            yield f"{what} has a range of its controls; their limits must be those of the joint and of the torque"
    for joint in joints:
        if driven.count(joint) != 1:
            yield f"the joint {model.joint(joint).name!r} has {driven.count(joint)} actuators; it needs one {kind}"


def _feet(model: mujoco.MjModel) -> Iterator[str]:
    for side in SIDES:
        geom, site = model.geom(f"{side}_sole"), model.site(f"{side}_sole")
        if geom.type[0] != mujoco.mjtGeom.mjGEOM_BOX:
            yield f"the geom '{side}_sole' is no box"
        if geom.bodyid[0] != site.bodyid[0]:
            yield f"geom and site '{side}_sole' are of different bodies"
        if abs(float(geom.quat @ site.quat)) < 1.0 - 1e-9:
            yield f"the geom and the site '{side}_sole' are not turned alike; the site's axes must be those of the box"
        lower = geom.pos - turn_of(site) @ [0.0, 0.0, geom.size[2]]
        if np.abs(lower - site.pos).max() > 0.1 * geom.size.min():
            yield f"the site '{side}_sole' is not in the middle of the sole's lower face, {np.round(lower, 6).tolist()}"
        if not geom.contype[0] & 1:
            yield f"the geom '{side}_sole' cannot touch the floor; its contype must have the bit 1"
        if geom.margin[0] or geom.gap[0] or geom.priority[0]:
            yield f"the geom '{side}_sole' has a margin, gap or priority; its contact must be that of the floor"
    left, right = (model.geom(f"{side}_sole") for side in SIDES)
    if not np.allclose(left.size[:2], right.size[:2], rtol=1e-6):
        yield f"the soles differ, {left.size[:2].tolist()} and {right.size[:2].tolist()} m; they must be alike"


def _stand(model: mujoco.MjModel) -> Iterator[str]:
    if not np.isfinite(model.key(STAND).qpos).all():
        yield f"the keyframe {STAND!r} is not finite"
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_forward(model, data)
    sites = [data.site(f"{side}_sole") for side in SIDES]
    if not np.isfinite(data.qacc).all():
        yield f"the keyframe {STAND!r} cannot be simulated"
    height, (least, most) = float(data.subtree_com[model.body(TRUNK).id][2] - sites[0].xpos[2]), COG_HEIGHT
    if not least <= height <= most:
        yield f"in {STAND!r} the COG is {height:.3g} m over the soles; it must be from {least:g} to {most:g}"
    for side, site in zip(SIDES, sites, strict=True):
        yaw, size = math.atan2(site.xmat[3], site.xmat[0]), 2 * model.geom(f"{side}_sole").size[:2]
        if site.xmat[8] < math.cos(LEVEL):
            yield f"in {STAND!r} the {side} sole is not level"
        if abs(yaw) > TOED:
            yield f"in {STAND!r} the {side} sole is turned by {math.degrees(yaw):.0f} deg from forward"
        if size.min() < SLIVER * height:
            yield f"the {side} sole is {size[0]:.3g} x {size[1]:.3g} m, too thin; at least {SLIVER * height:.3g}"
    if abs(sites[0].xpos[2] - sites[1].xpos[2]) > EVEN * height:
        yield f"in {STAND!r} the soles are not at one height"
    low, high = model.jnt_range[1:].T
    outside = (data.qpos[7:] < low - EVEN) | (data.qpos[7:] > high + EVEN)
    if outside.any():
        yield f"in {STAND!r} the joint {model.joint(1 + int(outside.argmax())).name!r} is outside of its range"
    width, apart = 2 * model.geom("left_sole").size[1], sites[0].xpos[1] - sites[1].xpos[1]
    if apart < width + CLEARANCE or not _apart(model, data):
        yield (
            f"in {STAND!r} the soles touch or overlap: the left one is {apart:.3g} m to the left of the right one; "
            f"they are {width:.3g} m wide, and need {CLEARANCE:g} m to pass each other"
        )


def _touched(model: mujoco.MjModel) -> Iterator[str]:
    """Only the soles may be on the floor, and legs not inside of each other."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_kinematics(model, data)
    data.qpos[2] -= min(data.site(f"{side}_sole").xpos[2] for side in SIDES) + NEAR
    mujoco.mj_fwdPosition(model, data)
    floor = model.geom(FLOOR).id
    for contact in data.contact:
        pair = [int(geom) for geom in contact.geom]
        if floor in pair and model.geom(other := pair[pair[0] == floor]).name not in _SOLES:
            yield f"in {STAND!r} {_called(model, other)} touches the floor; only the geoms of the soles may"
        if floor not in pair and contact.dist < -EVEN * data.subtree_com[model.body(TRUNK).id][2]:
            yield f"in {STAND!r} {_called(model, pair[0])} is inside of {_called(model, pair[1])}"


def _called(model: mujoco.MjModel, geom: int) -> str:
    body = model.body(int(model.geom_bodyid[geom])).name
    if name := model.geom(geom).name:
        return f"the geom {name!r} of the body {body!r}"
    kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
    return f"a {kind} of the body {body!r}"


def _apart(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether a line along one of the soles' sides has the left sole to its left, and the right one to its right."""
    corners: dict[str, tuple[Array, Array]] = {}
    for side in SIDES:
        x, y, _ = model.geom(f"{side}_sole").size
        offsets = np.array([[i * x, j * y] for i, j in itertools.product((-1, 1), repeat=2)])
        frame = data.geom(f"{side}_sole").xmat.reshape(3, 3)[:2, :2]
        corners[side] = data.geom(f"{side}_sole").xpos[:2] + offsets @ frame.T, frame[:, 1]
    return any(
        float((corners["left"][0] @ across).min() - (corners["right"][0] @ across).max()) > 1e-6
        for across in (corners[side][1] for side in SIDES)
    )


def turn_of(part: Any) -> Array:
    """(3, 3) from the frame of a geom or a site of the model to that of its body."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, part.quat)
    return turn.reshape(3, 3)


def leg_chain(model: mujoco.MjModel, side: Side) -> list[int]:
    """Bodies from the foot up to the hip: those of this leg alone, without the trunk and a waist that both share."""
    shared = _upwards(model, "right" if side == "left" else "left")
    return [body for body in _upwards(model, side) if body not in shared]


def _upwards(model: mujoco.MjModel, side: Side) -> list[int]:
    """Bodies from the foot up to the trunk or the world, without these."""
    chain = []
    body = int(model.site(f"{side}_sole").bodyid[0])
    while body not in (0, model.body(TRUNK).id):
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain
