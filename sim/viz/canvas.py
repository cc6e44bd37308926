"""An offscreen OpenGL that draws MuJoCo's scenes.

Not `mujoco.Renderer`, which picks its way to OpenGL for good when MuJoCo is first imported.
"""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from mujoco.egl import GLContext

Frame = NDArray[np.uint8]


class Canvas:
    """Draws scenes of one model, within a `with`."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Prepare for frames of a size [px], no larger than the model's offscreen buffer."""
        self._model, self._window = model, mujoco.MjrRect(0, 0, width, height)

    def __enter__(self) -> Self:
        self._gl = open_gl(self._window.width, self._window.height)
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._context.free()
        self._gl.free()

    def draw(self, scene: mujoco.MjvScene) -> Frame:
        """(height, width, 3) picture of a scene."""
        mujoco.mjr_render(self._window, scene, self._context)
        frame = np.empty((self._window.height, self._window.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(frame, None, self._window, self._context)
        return np.ascontiguousarray(frame[::-1])  # OpenGL counts rows from below


def open_gl(width: int, height: int) -> GLContext:
    """An offscreen OpenGL context, made current."""
    from mujoco.egl import GLContext  # fails where there is no EGL, and only pictures need it

    context = GLContext(width, height)
    context.make_current()
    return context
