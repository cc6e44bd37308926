"""Facts of a robot, read off the compiled model: the one place where its numbers come from."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.arena import SIDES, build_arena
from models.arena import TRUNK as TRUNK
from models.arena import Side as Side  # re-exported: a side is a fact of a robot
from models.conventions import FREE_JOINT as FREE_JOINT
from models.conventions import STAND as STAND
from models.conventions import check_conventions, check_names, leg_chain, turn_of
from models.errors import InputError, one_line
from models.flat import fingerprint, flat_mjcf
from models.reach import inertia_about, limb_swings, outward_roll, straight_leg, swinging_hinges
from models.scale import Scale, scale_of
from models.spoken import warnings_kept

Array = NDArray[np.float64]

MODELS = Path(__file__).parent
_STEEPEST = math.radians(60.0)
IMU = "imu"
"""The trunk's site that an IMU sits at."""


def other(side: Side) -> Side:
    """The opposite side."""
    return "right" if side == "left" else "left"


@dataclass(frozen=True, kw_only=True)
class Robot:
    """What the controllers may know of a body.

    Attributes:
        name: the robot's name.
        path: its MJCF file, the only description for MuJoCo and placo alike.
        sha256: of that file and all that it includes or refers to.
        flat: the compiled body as MJCF that refers to nothing; see `models.flat.flat_mjcf`.
        mass: total mass [kg].
        gravity: g [m/s^2].
        cog_height: height of the COG above the soles in the keyframe `stand` [m].
        joint_names: the actuated joints, in the order of the configuration vector.
        leg_joints: those of them that lie between the trunk and a sole.
        limb_swings: names of the joints that swing an arm or the head forward and back in `stand`.
        joint_range: (n, 2) lower and upper limit of each [rad].
        stall_torque: (n,) torque at standstill [N m].
        no_load_speed: (n,) speed at which the motor has no torque left [rad/s].
        servo_stiffness: (n,) gain of the servo on the angle's error [N m/rad].
        servo_damping: (n,) the same on the speed's [N m s/rad].
        joint_damping: (n,) viscous friction [N m s/rad].
        joint_friction: (n,) dry friction [N m].
        stand: (7 + n,) configuration of the keyframe `stand`: base position [m], quaternion (w x y z), joints [rad].
        sole_vertices: side -> (4, 2) corners of the sole, counter-clockwise, in the frame of the sole's site [m].
        sole_stance: side -> (x, y, yaw) of the sole's site in `stand` [m, m, rad].
        body_names: every body that a push can act on.
        leg_length: from hip to sole with a straight leg [m].
        swing_time: sqrt(I / tau) of the hinge that swings the leg the slowest, with the leg's inertia I about it and
            the stall torque tau of its motor [s].
        swing_speed: of the foot, with the leg swung by the slowest of these hinges at its no-load speed [m/s].
        widest: distance between the soles' middles in the widest stance with flat soles, the hip at its height [m].
        hip_reach: how far the ankle gets from under the hip, horizontally, with the hip at its standing height [m].
        imu: (3,) where the IMU sits in the trunk's frame [m]: the trunk's site `imu`, or its origin if it has none.
    """

    name: str
    path: Path
    sha256: str
    flat: str
    mass: float
    gravity: float
    cog_height: float
    joint_names: tuple[str, ...]
    leg_joints: frozenset[str]
    limb_swings: frozenset[str]
    joint_range: Array
    stall_torque: Array
    no_load_speed: Array
    servo_stiffness: Array
    servo_damping: Array
    joint_damping: Array
    joint_friction: Array
    stand: Array
    sole_vertices: Mapping[Side, Array]
    sole_stance: Mapping[Side, tuple[float, float, float]]
    body_names: tuple[str, ...]
    leg_length: float
    swing_time: float
    swing_speed: float
    widest: float
    hip_reach: float
    imu: Array

    @property
    def omega(self) -> float:
        """Natural frequency of the COG-ZMP pendulum, (3) with a constant height [1/s]."""
        return math.sqrt(self.gravity / self.cog_height)

    @property
    def scale(self) -> Scale:
        """How it compares to the robot that the controllers' numbers were found for."""
        return scale_of(
            leg_length=self.leg_length,
            cog_height=self.cog_height,
            gravity=self.gravity,
            mass=self.mass,
            swing_time=self.swing_time,
        )

    @property
    def stance_width(self) -> float:
        """Distance between the soles' middles in `stand` [m]."""
        return abs(self.sole_stance["left"][1] - self.sole_stance["right"][1])

    @property
    def sole_width(self) -> float:
        """Extent of a sole sideways [m]."""
        return float(np.ptp(self.sole_vertices["left"][:, 1]))

    @property
    def sole_length(self) -> float:
        """Extent of a sole forward [m]."""
        return float(np.ptp(self.sole_vertices["left"][:, 0]))


def robot_path(name: str) -> Path:
    """Find a robot's file.

    Args:
        name: a file of `models/` without its ending, a robot of `models.adopt.catalogue`, or a path to an `.xml` file.

    Raises:
        InputError: if there is no such robot; names those there are.
    """
    shipped = {path.stem: path for path in sorted(MODELS.glob("*.xml"))}
    if name in shipped:
        return shipped[name]
    path = Path(name)
    if path.suffix == ".xml":
        if os.path.isfile(path):  # False, too, for a name that no system can have
            return path.resolve()
        raise InputError(f"robot: no file {name!r}")
    from models.adopt.catalogue import KNOWN, adopted  # which adopts by what is in this file

    if name in KNOWN:
        return adopted(name)
    names = (*shipped, *KNOWN)
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise InputError(f"robot: {name!r} is neither one of {', '.join(names)} nor a path to an .xml file{hint}")


def load_robot(name: str) -> Robot:
    """Compile a robot and read its facts.

    Args:
        name: see `robot_path`.

    Raises:
        InputError: if the robot is unknown, or its file does not keep the conventions of `models/utmu2.xml`.
    """
    path = robot_path(name)
    try:
        with warnings_kept() as said:
            robot = read_robot(_compiled(path), path)
    except UnicodeDecodeError:
        raise InputError(f"{path}: holds a name that is not UTF-8") from None
    if said:
        raise InputError(f"{path}: MuJoCo warns: {said[0]}")
    return robot


def _compiled(path: Path) -> mujoco.MjModel:
    try:
        spec = build_arena(path)
        check_names(spec, path)
        given = next((len(key.qpos) for key in spec.keys if key.name == STAND), None)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path}: {one_line(error)}") from None
    # MuJoCo fills up a short one.
    if given not in (None, model.nq):
        raise InputError(f"{path}: the keyframe {STAND!r} has {given} numbers in qpos; it must have {model.nq}")
    return model


def read_robot(model: mujoco.MjModel, path: Path) -> Robot:
    """Read the facts off a compiled model (robot and floor, as `build_arena` makes it)."""
    check_conventions(model, path)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_forward(model, data)
    trunk = model.body(TRUNK).id
    joints = [model.joint(i).name for i in range(1, model.njnt)]
    ground = min(data.site(f"{side}_sole").xpos[2] for side in SIDES)
    # <dcmotor>: resistance, constant, ..., stiffness at [4], damping at [6], volts at [7]
    motor = model.actuator_gainprm
    by_joint = [model.actuator_trnid[:, 0].tolist().index(model.joint(name).id) for name in joints]
    resistance, constant, volts = motor[by_joint, 0], motor[by_joint, 1], motor[by_joint, 7]
    torque = np.minimum(constant * volts / resistance, model.actuator_forcerange[by_joint, 1])
    speed = volts / constant
    hinges = _leg_hinges(model)
    leg_length, hip_height = _leg(model, data, hinges)
    swinging = swinging_hinges(model, data, hinges, "left_sole")
    legs = {body for side in SIDES for body in leg_chain(model, side)}
    ankle_height = float(data.xanchor[hinges[-1]][2] - data.site("left_sole").xpos[2])
    bent = hip_height - ankle_height
    straight = leg_length - ankle_height
    return Robot(
        name=path.stem,
        path=path,
        sha256=fingerprint(path),
        flat=flat_mjcf(model),
        mass=float(model.body_subtreemass[trunk]),
        gravity=float(-model.opt.gravity[2]),
        cog_height=float(data.subtree_com[trunk][2] - ground),
        joint_names=tuple(joints),
        leg_joints=frozenset(joints[i - 1] for i in range(1, model.njnt) if model.jnt_bodyid[i] in legs),
        limb_swings=frozenset(joints[i - 1] for i in limb_swings(model, data, legs)),
        joint_range=_frozen(model.jnt_range[1:]),
        stall_torque=_frozen(torque),
        no_load_speed=_frozen(speed),
        servo_stiffness=_frozen(motor[by_joint, 4]),
        servo_damping=_frozen(motor[by_joint, 6]),
        joint_damping=_frozen(model.dof_damping[6:]),
        joint_friction=_frozen(model.dof_frictionloss[6:]),
        stand=_frozen(model.key(STAND).qpos),
        sole_vertices=MappingProxyType({side: _sole(model, side) for side in SIDES}),
        sole_stance=MappingProxyType({side: _stance(data, side) for side in SIDES}),
        body_names=tuple(model.body(i).name for i in range(1, model.nbody)),
        leg_length=leg_length,
        swing_time=max(math.sqrt(inertia_about(model, data, j) / torque[j - 1]) for j in swinging),
        swing_speed=leg_length * min(float(speed[j - 1]) for j in swinging),
        widest=_widest(model, data, hinges, bent),
        hip_reach=math.sqrt(max(straight**2 - bent**2, 0.0)),
        imu=_frozen(_imu(model)),
    )


def _sole(model: mujoco.MjModel, side: str) -> Array:
    geom, site = model.geom(f"{side}_sole"), model.site(f"{side}_sole")
    centre = (turn_of(site).T @ (geom.pos - site.pos))[:2]
    x, y = geom.size[:2]
    return _frozen(centre + np.array([[x, -y], [x, y], [-x, y], [-x, -y]]))


def _imu(model: mujoco.MjModel) -> Array:
    trunk = model.body(TRUNK).id
    sites = [i for i in range(model.nsite) if model.site(i).name == IMU and model.site_bodyid[i] == trunk]
    return model.site_pos[sites[0]] if sites else np.zeros(3)


def _stance(data: mujoco.MjData, side: str) -> tuple[float, float, float]:
    site = data.site(f"{side}_sole")
    return float(site.xpos[0]), float(site.xpos[1]), float(math.atan2(site.xmat[3], site.xmat[0]))


def _widest(model: mujoco.MjModel, data: mujoco.MjData, hinges: list[int], hip_height: float) -> float:
    """Between the soles, as far as the rolls of hip and ankle allow [m]."""
    foot, trunk = data.site("left_sole").xpos[1], data.xpos[model.body(TRUNK).id][1]
    hip = data.xanchor[hinges[0]][1]
    lean = math.atan2(foot - hip, hip_height) + outward_roll(model, data, hinges)
    return max(float(2 * (hip - trunk + hip_height * math.tan(min(lean, _STEEPEST)))), 2 * float(foot - trunk))


def _leg(model: mujoco.MjModel, data: mujoco.MjData, hinges: list[int]) -> tuple[float, float]:
    """Length of a straight leg down to the sole, and the hip's height now [m]."""
    foot, site = leg_chain(model, "left")[0], model.site("left_sole")
    ankle = model.jnt_pos[hinges[-1]]
    if model.jnt_bodyid[hinges[-1]] != foot:  # the sole is of a body that is fixed to the one that the ankle turns
        still = mujoco.MjData(model)
        mujoco.mj_kinematics(model, still)
        ankle = still.xmat[foot].reshape(3, 3).T @ (still.xanchor[hinges[-1]] - still.xpos[foot])
    sole = float(abs((turn_of(site).T @ (site.pos - ankle))[2]))
    links = straight_leg(model, hinges)
    return links + sole, float(data.xanchor[hinges[0]][2] - data.site("left_sole").xpos[2])


def _leg_hinges(model: mujoco.MjModel) -> list[int]:
    """Hinges of the left leg, from the hip down."""
    chain = leg_chain(model, "left")
    return [j for j in range(1, model.njnt) if model.jnt_bodyid[j] in chain]


def _frozen(values: Array) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
