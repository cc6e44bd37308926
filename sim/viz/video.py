"""Films a saved trace: poses from the trace, MuJoCo draws them offscreen, ffmpeg packs them. No physics."""

from __future__ import annotations

import math
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Self

# MuJoCo looks here for the way to OpenGL when it first draws.
os.environ.setdefault("MUJOCO_GL", "egl")

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from models.arena import CAMERAS, FLOOR, build_arena
from models.errors import InputError, one_line
from models.robot import FREE_JOINT, robot_path
from sim.record.trace import Trace
from sim.viz.canvas import Canvas, Frame, open_gl
from sim.viz.captions import Caption
from sim.viz.overlay import Overlay
from sim.viz.playback import Playback

Array = NDArray[np.float64]

SIZES = (160, 3840)  # [px] smallest and largest side of a frame
_FOLLOW = 0.3  # [s] over which the camera averages the way of the COG
_MAX_GEOMS = 1000
HOLD = 1.0
"""How long the last frame of a fall stays [s]."""
_IN_WORK = 4  # frames that may wait for words and ffmpeg while the next is drawn
_FLOOR_COLOUR, _FLOOR_SIZE = (0.74, 0.755, 0.77, 1.0), (40.0, 40.0, 40.0)


@lru_cache(maxsize=1)
def missing_renderer() -> str | None:
    """What keeps this machine from making videos, as a sentence that names the remedy; None if nothing does."""
    # A display that fails half-way complains again when it is collected; once is enough.
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        open_gl(64, 64).free()
    except Exception as error:  # noqa: BLE001 - drivers fail in their own ways: ImportError, AttributeError, GLError
        reason = (one_line(error) or type(error).__name__).rstrip(".")
        return (
            "no video: MuJoCo cannot draw without a screen through EGL here; on Debian install "
            f"libegl1, libegl-mesa0, libopengl0 and libgl1-mesa-dri ({reason})"
        )
    finally:
        sys.unraisablehook = hook
    try:
        imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        return f"no video: the ffmpeg of imageio-ffmpeg is missing; install ffmpeg ({one_line(error)})"
    return None


def render_episode(
    trace: Trace,
    path: Path,
    *,
    camera: str = "three_quarter",
    size: tuple[int, int] = (640, 480),
    fps: float = 60.0,
    slow: float = 1.0,
    span: tuple[float, float] = (0.0, math.inf),
    hold: float = HOLD,
    explained_once: bool = False,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Film an episode into an mp4 file; the file appears only when it is complete.

    Args:
        trace: of either world; on the pendulum its ball, rod and soles are drawn instead of the robot.
        path: file to write.
        camera: one of `models.arena.CAMERAS`; it follows the COG.
        size: (width, height) [px], both even.
        fps: frames a second.
        slow: 2 shows everything at half speed.
        span: which part of the episode, from when to when [s].
        hold: how long the last frame of a fall stays [s].
        explained_once: whether only the first frame has the legend.
        progress: called now and then with the fraction that is done.

    Raises:
        InputError: an argument is out of range, or the robot's file is gone.
        RuntimeError: ffmpeg failed.
    """
    _check(camera, size, fps, slow)
    playback = Playback(trace)
    first, last = span
    ticks = [tick for tick in _ticks(playback, fps * slow) if first <= playback.time[tick] <= last]
    if not ticks:
        raise InputError(f"no frame lies between {first:g} s and {last:g} s at {fps:g} frames a second")
    if hold and playback.outcome.time_of_fall is not None and last >= playback.time[-1]:
        # A fall ends the episode: without a moment more nobody could read how.
        ticks += [len(trace) - 1] * round(hold * fps)
    caption = Caption(playback, size, explained_once=explained_once)
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    partial = path.with_name(f".{path.stem}.partial.mp4")
    # The encoder shares two cores with the drawing: a slower preset halves the file and loses real time.
    options = ["-preset", "superfast", "-crf", "21", "-threads", "1", "-movflags", "+faststart"]
    try:
        with (
            _Studio(playback, camera, size) as studio,
            mediapy.VideoWriter(partial, size[::-1], fps=fps, ffmpeg_args=options) as film,
            ThreadPoolExecutor(max_workers=1) as desk,
        ):

            def finish(frame: Frame, tick: int) -> None:
                caption.write(frame, tick)
                film.add_image(frame)

            unfinished: deque[Future[None]] = deque()
            for i, (tick, aim) in enumerate(zip(ticks, _aims(playback, ticks, fps * slow), strict=True)):
                unfinished.append(desk.submit(finish, studio.shoot(tick, aim), tick))
                if len(unfinished) > _IN_WORK:
                    unfinished.popleft().result()
                if progress is not None and i % 15 == 0:
                    progress(i / len(ticks))
            for frame in unfinished:
                frame.result()
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    if progress is not None:
        progress(1.0)


def _check(camera: str, size: tuple[int, int], fps: float, slow: float) -> None:
    if camera not in CAMERAS:
        raise InputError(f"camera: {camera!r} is not one of {', '.join(CAMERAS)}")
    low, high = SIZES
    if any(side % 2 or not low <= side <= high for side in size):
        raise InputError(f"size: {size[0]}x{size[1]} must be two even numbers of pixels from {low} to {high}")
    if not 1.0 <= fps <= 240.0:
        raise InputError(f"fps: {fps!r} must be from 1 to 240")
    if not 0.01 <= slow <= 1000.0:
        raise InputError(f"slow: {slow!r} must be from 0.01 to 1000 (2 is half speed)")


def _ticks(playback: Playback, rate: float) -> Iterator[int]:
    """The tick of each frame, at `rate` frames for a second of the trace."""
    start, end = float(playback.time[0]), float(playback.time[-1])
    for i in range(math.floor((end - start) * rate + 1e-6) + 1):
        yield playback.tick(start + i / rate)


def _aims(playback: Playback, ticks: list[int], rate: float) -> Array:
    """(frames, 3) what the camera follows: the way of the COG over the floor, smoothed to both sides in time."""
    way = playback.cog[ticks].copy()
    way[:, 2] = 0.0
    way[:, :2] = gaussian_filter1d(way[:, :2], sigma=_FOLLOW * rate, axis=0, mode="nearest")
    return way


class _Studio:
    """Robot, floor, lights and camera, and the canvas that they are drawn on."""

    def __init__(self, playback: Playback, camera: str, size: tuple[int, int]) -> None:
        self._playback = playback
        self._model = _scenery(playback, size)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = self._model.camera(camera).id
        self._stand = self._data.cam_xpos[self._camera.fixedcamid].copy()
        self._forward = -self._data.cam_xmat[self._camera.fixedcamid].reshape(3, 3)[:, 2]
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._scene = mujoco.MjvScene(self._model, maxgeom=_MAX_GEOMS)
        self._scene.flags[:] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_CULL_FACE] = 1
        self._overlay = Overlay(self._scene, playback)
        self._poses, self._addresses = self._read_poses()
        self._canvas = Canvas(self._model, *size)

    def __enter__(self) -> Self:
        self._canvas.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._canvas.__exit__(kind, error, trace)

    def shoot(self, tick: int, aim: Array) -> Frame:
        """(height, width, 3) picture of a tick, the camera moved by `aim` (3,) [m]."""
        eye = self._stand + aim
        if self._addresses:
            self._data.qpos[self._addresses] = self._poses[tick]
            mujoco.mj_kinematics(self._model, self._data)
        self._data.cam_xpos[self._camera.fixedcamid] = eye
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, self._option, None, self._camera, everything, self._scene)
        self._overlay.draw(tick, eye, self._forward)
        return self._canvas.draw(self._scene)

    def _read_poses(self) -> tuple[Array, list[int]]:
        if not self._playback.is_humanoid:
            return np.empty((0, 0)), []
        trace, model = self._playback.trace, self._model
        root = int(model.joint(FREE_JOINT).qposadr[0])
        columns = [f"root_{name}" for name in ("x", "y", "z", "qw", "qx", "qy", "qz")]
        addresses = list(range(root, root + 7))
        for channel in trace.channels:
            if channel.startswith("q_"):
                columns.append(channel)
                addresses.append(int(model.joint(channel[2:]).qposadr[0]))
        return np.column_stack([trace[name] for name in columns]), addresses


def _scenery(playback: Playback, size: tuple[int, int]) -> mujoco.MjModel:
    """The arena made cheap to draw in software: textures, shadows and multisampling cost most of a frame each."""
    spec = build_arena(robot_path(playback.scenario.robot), size=playback.size)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = size
    quality = spec.visual.quality
    quality.offsamples, quality.shadowsize = 0, 0
    quality.numslices, quality.numstacks, quality.numquads = 16, 10, 1
    model = spec.compile()
    floor = model.geom(FLOOR).id
    model.geom_matid[floor] = -1
    model.geom_rgba[floor] = _FLOOR_COLOUR
    model.geom_size[floor] = _FLOOR_SIZE
    model.vis.headlight.diffuse[:] = 0.2  # from above, the floor and the robot would both be white
    model.light_type[:] = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    if not playback.is_humanoid:
        model.geom_rgba[model.geom_bodyid > 0, 3] = 0.0
    return model
