"""What is drawn into the scene besides the robot: COG, ZMP, DCM, true and seen, support, push, and the pendulum."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arena import SIDES
from sim.record.palette import COG, DCM, PUSH, SEEN, SUPPORT, ZMP, rgb
from sim.viz.playback import Playback, PushMark
from sim.viz.push_shapes import FADE, arc, arrow

Array = NDArray[np.float64]
Geom = mujoco.mjtGeom

# Marks are drawn this fraction of the way from the camera to where they are, in proportion: in the picture that
# is the same place and size, but no part of the robot can hide them.
_XRAY = 0.4
_XRAY_BEHIND = 0.41  # polygon and ghost lie just behind the other marks, which keep their colours
_PUSHES_DRAWN = 16  # at once, the latest ones: a scene holds so many marks and no more
_PAINT = 0.0006  # [m] above the floor
_GRID, _GRID_REACH = 0.1, 15  # [m] between lines for a robot of size 1, and how many there are to each side
_GRID_LINES = 2 * (2 * _GRID_REACH + 1)
_RING = [(math.cos(a), math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 21)]
_IDENTITY = np.eye(3).ravel()
_FLOOR_LINE = (0.63, 0.65, 0.67, 1.0)


class Overlay:
    """Adds the marks of one tick to a scene that already holds the robot.

    Args:
        scene: of `mujoco.mjv_updateScene`.
        playback: what is shown.
    """

    def __init__(self, scene: mujoco.MjvScene, playback: Playback) -> None:
        self._scene = scene
        self._playback = playback
        self._eye = np.zeros(3)
        self._size = playback.size
        self._grid: tuple[int, int] | None = None
        self._acted = lru_cache(maxsize=64)(playback.acted)
        self._half_sole = {side: np.ptp(sole, axis=0) / 2 for side, sole in playback.soles.items()}
        self._mid_sole = {side: (sole.max(axis=0) + sole.min(axis=0)) / 2 for side, sole in playback.soles.items()}

    def draw(self, tick: int, eye: Array, forward: Array) -> None:
        """Add the marks of a tick.

        Args:
            tick: row of the trace.
            eye: (3,) where the camera is [m].
            forward: (3,) unit vector in which it looks.
        """
        self._eye = eye
        self._backdrop(forward)
        self._floor_grid()
        self._support(tick)
        if not self._playback.is_humanoid:
            self._pendulum(tick)
        self._marks(tick)
        self._push(tick)

    def _backdrop(self, forward: Array) -> None:
        """A bright wall far behind: MuJoCo's sky costs as much as the robot."""
        turn = np.zeros(4)
        mujoco.mju_quatZ2Vec(turn, -forward)
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, turn)
        wall = self._add(Geom.mjGEOM_BOX, [20, 20, 0.01], self._eye + 12.0 * forward, (0.93, 0.95, 0.97, 1.0), matrix)
        wall.emission = 1.0

    def _floor_grid(self) -> None:
        # What was added in the last picture is still there unless MuJoCo has overwritten it: half of all the
        # marks need not be made again.
        first = self._scene.ngeom
        if self._grid == (first, first + _GRID_LINES):
            self._scene.ngeom += _GRID_LINES
            return
        grid = _GRID * math.ceil(self._size)
        middle = np.round(self._playback.cog[0, :2] / grid) * grid
        for i in range(-_GRID_REACH, _GRID_REACH + 1):
            for axis in (0, 1):
                start, end = np.append(middle, _PAINT / 2), np.append(middle, _PAINT / 2)
                start[axis] += i * grid
                end[axis] += i * grid
                start[1 - axis] -= grid * _GRID_REACH
                end[1 - axis] += grid * _GRID_REACH
                self._line(start, end, 1.0, _FLOOR_LINE)
        self._grid = (first, self._scene.ngeom)

    def _support(self, tick: int) -> None:
        corners = self._playback.support(tick)
        if corners is None:
            return
        points = np.column_stack([corners, np.full(len(corners), _PAINT)])
        points = np.array([self._near(point, _XRAY_BEHIND) for point in points])
        for a, b in pairwise(points[1:]):
            # MuJoCo's triangle is (0,0), (1,0), (0,1): two of its edges as columns make any other of it.
            matrix = np.column_stack([a - points[0], b - points[0], [0.0, 0.0, 1.0]]).ravel()
            self._add(Geom.mjGEOM_TRIANGLE, [1, 1, 1], points[0], _rgba(SUPPORT, 0.3), matrix).emission = 0.6
        for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
            self._line(a, b, 3.0, _rgba(SUPPORT))

    def _pendulum(self, tick: int) -> None:
        play = self._playback
        for side in SIDES:
            x, y, z, yaw = play.feet[side][tick]
            c, s = math.cos(yaw), math.sin(yaw)
            middle = np.array([[c, -s], [s, c]]) @ self._mid_sole[side] + (x, y)
            size = [*self._half_sole[side], 0.005]
            matrix = np.array([c, -s, 0, s, c, 0, 0, 0, 1], dtype=np.float64)
            self._add(Geom.mjGEOM_BOX, size, [*middle, z + 0.006], _rgba("#8fa3bf"), matrix)
        if np.isfinite(play.zmp[tick]).all():
            foot = np.append(play.zmp[tick], 0.0)
            rod = self._add(Geom.mjGEOM_CAPSULE, [1, 1, 1], foot, _rgba("#9aa0a8"))
            mujoco.mjv_connector(rod, Geom.mjGEOM_CAPSULE, 0.006 * self._size, foot, play.cog[tick])
        self._add(Geom.mjGEOM_SPHERE, [0.035 * self._size] * 3, play.cog[tick], _rgba("#c9ced6"))

    def _marks(self, tick: int) -> None:
        play = self._playback
        cog = play.cog[tick]
        floor = np.array([cog[0], cog[1], 0.0])
        self._line(self._near(cog), self._near(floor), 2.0, _rgba(COG)).emission = 0.5
        self._add(Geom.mjGEOM_SPHERE, [0.013 * _XRAY * self._size] * 3, self._near(cog), _rgba(COG)).emission = 0.3
        self._disc(floor[:2], 0.005, _rgba(COG))
        self._disc(play.dcm[tick], 0.011, _rgba(DCM))
        self._disc(play.zmp[tick], 0.009, _rgba(ZMP))
        self._circle(play.zmp_command[tick], 0.014, _rgba(ZMP))
        if play.seen is not None:
            self._ghost(play.seen.cog[tick], play.seen.dcm[tick])

    def _ghost(self, cog: Array, dcm: Array) -> None:
        """COG and DCM as the controllers see them: a halo that is off the true one by as much as they are."""
        if np.isfinite(cog).all():
            radius, place = 0.024 * _XRAY_BEHIND * self._size, self._near(cog, _XRAY_BEHIND)
            self._add(Geom.mjGEOM_SPHERE, [radius] * 3, place, _rgba(SEEN, 0.4)).emission = 0.5
        self._circle(dcm, 0.017, _rgba(SEEN))

    def _push(self, tick: int) -> None:
        for push in self._playback.recent(self._playback.time[tick], FADE)[-_PUSHES_DRAWN:]:
            self._one_push(push, tick)

    def _one_push(self, push: PushMark, tick: int) -> None:
        play = self._playback
        values, points = self._acted(push)
        rows = np.arange(play.tick(push.start), min(tick, play.tick(push.end)) + 1)
        sizes = np.linalg.norm(values[rows], axis=1)
        if not sizes.any():
            return
        # Afterwards its largest force is what should be remembered, not the last of a half sine.
        pushed = tick if tick in rows and sizes[-1] > 0.0 else int(rows[sizes.argmax()])
        value = values[pushed]
        colour = _rgba(PUSH, 1.0 - max(0.0, (play.time[tick] - push.end) / FADE))
        point = points[pushed] + play.cog[tick] - play.cog[pushed]
        if push.is_torque:
            self._turn(*arc(point, value, play.weight, self._size), colour)
        else:
            self._arrow(arrow(point, value, play.weight, self._size), colour)

    def _arrow(self, ends: Array, colour: tuple[float, ...]) -> None:
        tail, tip = ends
        mark = self._add(Geom.mjGEOM_ARROW, [1, 1, 1], tip, colour)
        mujoco.mjv_connector(mark, Geom.mjGEOM_ARROW, 0.011 * _XRAY * self._size, self._near(tail), self._near(tip))
        mark.emission = 0.3
        mark.size[2] *= 2.0  # MuJoCo draws an arrow half as long as its connector says

    def _turn(self, around: Array, head: Array, colour: tuple[float, ...]) -> None:
        for start, end in pairwise(around):
            rod = self._add(Geom.mjGEOM_CAPSULE, [1, 1, 1], start, colour)
            mujoco.mjv_connector(
                rod, Geom.mjGEOM_CAPSULE, 0.006 * _XRAY * self._size, self._near(start), self._near(end)
            )
            rod.emission = 0.3
        self._arrow(head, colour)

    def _near(self, point: Array, fraction: float = _XRAY) -> Array:
        return self._eye + fraction * (point - self._eye)

    def _disc(self, point: Array, radius: float, rgba: tuple[float, ...]) -> None:
        if np.isfinite(point).all():
            place = self._near(np.array([point[0], point[1], _PAINT]))
            self._add(Geom.mjGEOM_CYLINDER, [radius * _XRAY * self._size, 1e-4, 0], place, rgba).emission = 0.5

    def _circle(self, point: Array, radius: float, rgba: tuple[float, ...]) -> None:
        if np.isfinite(point).all():
            radius *= self._size
            ring = [self._near(np.array([point[0] + radius * c, point[1] + radius * s, _PAINT])) for c, s in _RING]
            for a, b in pairwise(ring):
                self._line(a, b, 2.0, rgba)

    def _line(self, start: Array, end: Array, width: float, rgba: tuple[float, ...]) -> mujoco.MjvGeom:
        line = self._add(Geom.mjGEOM_LINE, [1, 1, 1], start, rgba)
        mujoco.mjv_connector(line, Geom.mjGEOM_LINE, width, start, end)
        return line

    def _add(
        self,
        kind: mujoco.mjtGeom,
        size: ArrayLike,
        position: ArrayLike,
        rgba: tuple[float, ...],
        matrix: Array = _IDENTITY,
    ) -> mujoco.MjvGeom:
        geom = self._scene.geoms[self._scene.ngeom]
        mujoco.mjv_initGeom(
            geom,
            kind,
            np.asarray(size, dtype=np.float64),
            np.asarray(position, dtype=np.float64),
            matrix,
            np.array(rgba, dtype=np.float32),
        )
        self._scene.ngeom += 1
        return geom


def _rgba(colour: str, alpha: float = 1.0) -> tuple[float, ...]:
    red, green, blue = rgb(colour)
    return red / 255, green / 255, blue / 255, alpha
