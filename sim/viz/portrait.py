"""A picture of a robot that stands."""

from __future__ import annotations

from pathlib import Path

import mujoco
from PIL import Image

from models.arena import build_arena, drawn_size
from models.robot import STAND, load_robot
from sim.viz.canvas import Canvas

_SIZE = (640, 640)


def draw_portrait(robot: Path, picture: Path) -> None:
    """Draw a robot in its stand into a PNG.

    Args:
        robot: its MJCF file.
        picture: file to write.

    Raises:
        InputError: if the robot cannot be read.
    """
    size = drawn_size(load_robot(str(robot)).cog_height)
    spec = build_arena(robot, size=size)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = _SIZE
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera("three_quarter").id
    scene = mujoco.MjvScene(model, maxgeom=2000)
    option, everything = mujoco.MjvOption(), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, option, None, camera, everything, scene)
    with Canvas(model, *_SIZE) as canvas:
        Image.fromarray(canvas.draw(scene)).save(picture)
