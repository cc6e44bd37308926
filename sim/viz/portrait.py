"""A picture of a robot that stands."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from models.arena import build_arena, drawn_size
from models.robot import STAND, load_robot
from sim.viz.video import open_gl

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
    gl = open_gl(*_SIZE)
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
    try:
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
        option, everything = mujoco.MjvOption(), mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, option, None, camera, everything, scene)
        window = mujoco.MjrRect(0, 0, *_SIZE)
        mujoco.mjr_render(window, scene, context)
        frame = np.empty((_SIZE[1], _SIZE[0], 3), dtype=np.uint8)
        mujoco.mjr_readPixels(frame, None, window, context)
    finally:
        context.free()
        gl.free()
    Image.fromarray(frame[::-1]).save(picture)
