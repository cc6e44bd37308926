"""The world: physics, episodes, pictures, command line."""

import ctypes.util
import os

# Offscreen rendering goes through EGL. Chosen before mujoco or dm_control is imported, which read it once; where EGL
# is missing they must not go looking for a display, and everything but the video still works.
os.environ.setdefault("MUJOCO_GL", "egl" if ctypes.util.find_library("EGL") else "disable")
