"""The robot put on a floor, lit and filmed: what MuJoCo simulates and draws."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.errors import InputError, one_line

FLOOR = "floor"
TRUNK = "trunk"
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
CAMERAS = ("three_quarter", "side", "front", "top")

# A hard but well-conditioned contact: 5 ms time constant, critically damped, less than 1 mm of give.
CONTACT_SOLREF = (0.005, 1.0)
CONTACT_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
FLOOR_FRICTION = (0.8, 0.01, 0.001)

_COG_HEIGHT = 0.26
"""Of the robot that the cameras are placed for [m]."""

# MuJoCo's codes of a contact sensor: data (bits found 0, force 1, torque 2, pos 4), reduction (3 = net force), slots.
_SOLE_SENSOR = (1 | 2 | 4 | 16, 3, 1)
_COUNT_SENSOR = (1, 3, 1)


def build_arena(robot_xml: Path, *, timestep: float = 0.001, size: float = 1.0) -> mujoco.MjSpec:
    """Read a robot and put it on a floor.

    Args:
        robot_xml: MJCF file that keeps the conventions written in `models/utmu2.xml`.
        timestep: physics step [s].
        size: of the robot, see `drawn_size`; only the cameras are placed by it.

    Returns:
        An uncompiled `mujoco.MjSpec` with the floor, a contact sensor `<side>_sole` for each sole (its net floor
        force, torque and point), one `floor` that counts all contacts with it, lights and the cameras of `CAMERAS`.

    Raises:
        InputError: if the file cannot be read as a robot.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(robot_xml))
    except (ValueError, OSError, mujoco.FatalError) as error:
        raise InputError(f"{robot_xml}: not a readable MJCF robot: {one_line(error)}") from None

    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.iterations = 20
    spec.option.ls_iterations = 20
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    _add_floor(spec)
    _add_sole_sensors(spec)
    _add_lights_and_cameras(spec, size)
    return spec


def drawn_size(cog_height: float) -> float:
    """How large a robot with that height of the COG [m] is drawn: 1 for `utmu2`, for whom all is placed."""
    return round(cog_height / _COG_HEIGHT, 3)


def _add_floor(spec: mujoco.MjSpec) -> None:
    texture, pattern = mujoco.mjtTexture, mujoco.mjtBuiltin
    for name, kind, builtin, first, second, size in (
        ("floor", texture.mjTEXTURE_2D, pattern.mjBUILTIN_CHECKER, (0.93, 0.93, 0.91), (0.87, 0.88, 0.88), 256),
        ("sky", texture.mjTEXTURE_SKYBOX, pattern.mjBUILTIN_GRADIENT, (0.90, 0.93, 0.97), (0.98, 0.98, 0.98), 64),
    ):
        spec.add_texture(name=name, type=kind, builtin=builtin, rgb1=first, rgb2=second, width=size, height=size)
    textures = [""] * mujoco.mjtTextureRole.mjNTEXROLE
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.add_material(name="floor", textures=textures, texrepeat=[5, 5], texuniform=True)
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[4, 4, 0.1],
        material="floor",
        contype=0,
        conaffinity=1,
        condim=3,
        priority=1,  # the floor's contact parameters hold, whatever the robot's geoms say
        friction=FLOOR_FRICTION,
        solref=CONTACT_SOLREF,
        solimp=CONTACT_SOLIMP,
    )


def _add_sole_sensors(spec: mujoco.MjSpec) -> None:
    for side in SIDES:
        spec.add_sensor(
            name=f"{side}_sole",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname=f"{side}_sole",
            reftype=mujoco.mjtObj.mjOBJ_GEOM,
            refname=FLOOR,
            intprm=_SOLE_SENSOR,
        )
    # MuJoCo works out the speed of the COG only if a sensor asks for it.
    if not any(sensor.type == mujoco.mjtSensor.mjSENS_SUBTREELINVEL for sensor in spec.sensors):
        kind, body = mujoco.mjtSensor.mjSENS_SUBTREELINVEL, mujoco.mjtObj.mjOBJ_BODY
        spec.add_sensor(name="cog_velocity", type=kind, objtype=body, objname=TRUNK)
    spec.add_sensor(
        name=FLOOR,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname=FLOOR,
        reftype=mujoco.mjtObj.mjOBJ_UNKNOWN,
        intprm=_COUNT_SENSOR,
    )


def _add_lights_and_cameras(spec: mujoco.MjSpec, size: float) -> None:
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.global_.offwidth = 1920
    spec.visual.global_.offheight = 1080
    spec.worldbody.add_light(
        name="sun", pos=[0.6, -0.8, 2.5], dir=[-0.25, 0.3, -1.0], diffuse=[0.5, 0.5, 0.5], castshadow=False
    )
    for name, position, target in (
        ("three_quarter", (0.75, -0.95, 0.50), (0.0, 0.0, 0.24)),
        ("side", (0.0, -1.25, 0.30), (0.0, 0.0, 0.26)),
        ("front", (1.25, 0.0, 0.30), (0.0, 0.0, 0.26)),
        ("top", (0.0, -1e-6, 1.15), (0.0, 0.0, 0.0)),
    ):
        quat = _look_at(position, target)
        spec.worldbody.add_camera(name=name, pos=size * np.array(position), quat=quat, fovy=38)


def _look_at(position: tuple[float, ...], target: tuple[float, ...]) -> NDArray[np.float64]:
    """Orientation (w x y z) of a camera, whose view is along its own -z with y up."""
    back = np.subtract(position, target)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.column_stack([right, np.cross(back, right), back]).ravel())
    return quaternion
