"""The scene in the browser: robot or pendulum, floor, and the marks of the video, moved from moment to moment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.arena import SIDES, Side, build_arena, drawn_size
from sim.record.palette import COG, DCM, PUSH, SEEN, SUPPORT, ZMP, rgb
from sim.viewer.geoms import body_meshes
from sim.viewer.moment import Moment

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

OPACITY = 0.5
"""Of the robot: what lies in it or under its soles must be seen."""
LEGEND = (("COG", COG), ("DCM", DCM), ("ZMP", ZMP), ("ZMP command", ZMP), ("support", SUPPORT), ("push", PUSH))
"""What the marks are called."""
GHOST = ("COG as seen", SEEN)
"""What is marked besides where the controllers do not see the true state."""
_HOLLOW = "ZMP command"
_CORNERS = 8  # of the hull of two soles with four corners each, at most
_PAINT = 0.001  # [m] above the floor
_FOLLOW = 0.5  # [s] over which the way of the COG is smoothed
_OVER_HEAD = 1.05  # of the COG's height, above the COG
_MOVED = 1e-4  # [m] by which the support has to change to be drawn anew
_RING = np.array([(math.cos(a), math.sin(a), 0.0) for a in np.linspace(0.0, 2.0 * math.pi, 25)])
_FAN = np.array([(0, i, i + 1) for i in range(1, _CORNERS - 1)], dtype=np.uint32)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def legend_html(*, ghost: bool) -> str:
    """What the marks mean, as HTML; `ghost`: whether the COG is marked as the controllers see it, too."""
    return "".join(
        '<span style="white-space:nowrap;margin-right:.9em"><span style="display:inline-block;width:.6em;height:.6em;'
        f"margin-right:.35em;border-radius:50%;border:2px solid {colour};"
        f'background:{"transparent" if name == _HOLLOW else colour}"></span>{name}</span>'
        for name, colour in (*LEGEND, *((GHOST,) if ghost else ()))
    )


class Scene:
    """Draws moments into viser's scene."""

    def __init__(
        self,
        server: viser.ViserServer,
        robot_xml: Path,
        facts: Mapping[str, Any],
        *,
        humanoid: bool,
        ghost: bool,
    ) -> None:
        """Put up what does not change.

        Args:
            server: whose scene it is.
            robot_xml: MJCF file of the robot.
            facts: of the robot, as in the metadata of a trace.
            humanoid: whether the body is drawn, or the pendulum.
            ghost: whether the COG is marked as the controllers see it, too.

        Raises:
            InputError: if the robot's file cannot be read.
        """
        self._server, self._scene = server, server.scene
        self._support: Array | None = None
        self._height = float(facts["cog_height"])
        self._size = drawn_size(self._height)
        # All moves under the camera, which is the user's.
        self._world = self._scene.add_frame("/world", show_axes=False)
        self._aim: Array | None = None
        self._drawn_at = 0.0
        self._floor()
        self._model = build_arena(robot_xml).compile()
        self._data = mujoco.MjData(self._model)
        self._bodies = self._body_frames() if humanoid else {}
        self._feet = (
            {}
            if humanoid
            else {side: self._pendulum_foot(side, np.array(facts["sole_vertices"][side])) for side in SIDES}
        )
        if not humanoid:
            self._mass = self._scene.add_icosphere(
                "/world/pendulum/mass", radius=0.035 * self._size, color=rgb("#c9ced6"), opacity=OPACITY
            )
            self._rod = self._line("/world/pendulum/leg", "#9aa0a8", 6.0)
        self._marks()
        self._ghost = self._halo() if ghost else None
        self._place_camera()

    def draw(self, moment: Moment, words: str) -> None:
        """Show a moment, with words over the robot's head."""
        with self._server.atomic():
            self._follow(moment)
            self._draw_body(moment)
            self._draw_support(moment.support)
            cog = moment.cog
            self._cog.position = tuple(cog)
            self._plumb.points = _segment(cog, (cog[0], cog[1], 0.0))
            self._foot_of_cog.position = (cog[0], cog[1], _PAINT)
            for mark, point, height in (
                (self._dcm, moment.dcm, 2 * _PAINT),
                (self._zmp, moment.zmp, 3 * _PAINT),
                (self._command, moment.zmp_command, 3 * _PAINT),
            ):
                there = bool(np.isfinite(point).all())
                if mark.visible != there:
                    mark.visible = there
                if there:
                    mark.position = (float(point[0]), float(point[1]), height)
            if self._ghost is not None:
                seen = bool(np.isfinite(moment.seen_cog).all())
                if self._ghost.visible != seen:
                    self._ghost.visible = seen
                if seen:
                    self._ghost.position = tuple(moment.seen_cog)
            for shapes, pieces in ((self._arrows, moment.arrows), (self._arcs, moment.arcs)):
                there = bool(len(pieces))
                if shapes.visible != there:
                    shapes.visible = there
                if there:
                    shapes.points = pieces.astype(np.float32)
            self._words.position = (cog[0], cog[1], cog[2] + _OVER_HEAD * self._height)
            if self._words.text != words:
                self._words.text = words

    def _follow(self, moment: Moment) -> None:
        """Keep the COG in view, smoothly, as the camera of the video does."""
        passed, place = moment.time - self._drawn_at, moment.cog[:2]
        if self._aim is None or passed < 0.0:
            self._aim = place.copy()
        self._aim += (place - self._aim) * -math.expm1(-max(passed, 0.0) / _FOLLOW)
        self._drawn_at = moment.time
        self._world.position = (-self._aim[0], -self._aim[1], 0.0)

    def _draw_body(self, moment: Moment) -> None:
        if moment.pose is not None:
            self._data.qpos[:] = moment.pose
            mujoco.mj_kinematics(self._model, self._data)
            for body, frame in self._bodies.items():
                frame.position, frame.wxyz = self._data.xpos[body], self._data.xquat[body]
            return
        self._mass.position = tuple(moment.cog)
        for side, foot in self._feet.items():
            x, y, z, yaw = moment.feet[side].tolist()
            foot.position, foot.wxyz = (x, y, z), (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        there = bool(np.isfinite(moment.zmp).all())
        self._rod.visible = there
        if there:
            self._rod.points = _segment(moment.cog, (moment.zmp[0], moment.zmp[1], 0.0))

    def _draw_support(self, corners: Array | None) -> None:
        visible = corners is not None
        if self._area.visible != visible:
            self._area.visible = self._edge.visible = visible
        if corners is None:
            return
        # A fixed number of corners, so that vertices may change without the faces.
        points = np.full((_CORNERS, 3), _PAINT)
        points[:, :2] = corners[np.minimum(np.arange(_CORNERS), len(corners) - 1)]
        if self._support is not None and np.abs(points - self._support).max() < _MOVED:
            return
        self._support = points
        self._area.vertices = points.astype(np.float32)
        self._edge.points = np.stack([points, np.roll(points, -1, axis=0)], axis=1).astype(np.float32)

    def _floor(self) -> None:
        self._scene.add_grid(
            "/world/floor",
            width=8.0 * self._size,
            height=8.0 * self._size,
            cell_size=0.1 * math.ceil(self._size),
            cell_color=(188, 192, 197),
            section_size=1.0 * math.ceil(self._size),
            section_color=(170, 175, 181),
            plane_color=(222, 225, 229),
            plane_opacity=1.0,
            position=(0.0, 0.0, -_PAINT),
        )

    def _body_frames(self) -> dict[int, viser.FrameHandle]:
        frames: dict[int, viser.FrameHandle] = {}
        for i, mesh in enumerate(body_meshes(self._model)):
            name = f"/world/robot/{self._model.body(mesh.body).name}"
            if mesh.body not in frames:
                frames[mesh.body] = self._scene.add_frame(name, show_axes=False)
            self._scene.add_mesh_simple(
                f"{name}/{i}",
                mesh.vertices,
                mesh.faces,
                color=mesh.rgba[:3],
                opacity=OPACITY * mesh.rgba[3],
                flat_shading=mesh.flat,
            )
        return frames

    def _pendulum_foot(self, side: Side, sole: Array) -> viser.FrameHandle:
        frame = self._scene.add_frame(f"/world/pendulum/{side}", show_axes=False)
        low, high = sole.min(axis=0), sole.max(axis=0)
        middle = (low + high) / 2
        self._scene.add_box(
            f"/world/pendulum/{side}/foot",
            dimensions=(float(high[0] - low[0]), float(high[1] - low[1]), 0.01),
            position=(float(middle[0]), float(middle[1]), 0.006),
            color=rgb("#8fa3bf"),
            opacity=OPACITY,
        )
        return frame

    def _marks(self) -> None:
        add = self._scene
        corners = np.zeros((_CORNERS, 3), dtype=np.float32)
        self._area = add.add_mesh_simple(
            "/world/support/area", corners, _FAN, color=rgb(SUPPORT), opacity=0.35, side="double", cast_shadow=False
        )
        self._edge = self._line("/world/support/edge", SUPPORT, 2.5, segments=_CORNERS)
        self._cog = self._ball("/world/cog", 0.013, COG)
        self._plumb = self._line("/world/plumb", COG, 2.0)
        self._foot_of_cog = self._ball("/world/cog_on_floor", 0.005, COG)
        self._dcm = self._ball("/world/dcm", 0.011, DCM)
        self._zmp = self._ball("/world/zmp", 0.009, ZMP)
        ring = 0.014 * self._size * np.stack([_RING[:-1], _RING[1:]], axis=1)
        self._command = add.add_line_segments(
            "/world/zmp_command", ring.astype(np.float32), rgb(ZMP), thickness=2.0, thickness_units="screen"
        )
        self._arrows = add.add_arrows(
            "/world/push/arrows",
            np.zeros((1, 2, 3), dtype=np.float32),
            rgb(PUSH),
            shaft_radius=0.008 * self._size,
            head_radius=0.02 * self._size,
            head_length=0.045 * self._size,
            visible=False,
        )
        self._arcs = add.add_line_segments(
            "/world/push/arcs",
            np.zeros((1, 2, 3), dtype=np.float32),
            rgb(PUSH),
            thickness=0.012 * self._size,
            visible=False,
        )
        self._words = add.add_label("/world/words", "", anchor="bottom-center", font_screen_scale=1.2)

    def _halo(self) -> viser.IcosphereHandle:
        return self._scene.add_icosphere(
            "/world/cog_as_seen",
            radius=0.024 * self._size,
            color=rgb(SEEN),
            opacity=0.4,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _ball(self, name: str, radius: float, colour: str) -> viser.IcosphereHandle:
        return self._scene.add_icosphere(
            name, radius=radius * self._size, color=rgb(colour), cast_shadow=False, receive_shadow=False
        )

    def _line(self, name: str, colour: str, width: float, segments: int = 1) -> viser.LineSegmentsHandle:
        points = np.zeros((segments, 2, 3), dtype=np.float32)
        return self._scene.add_line_segments(name, points, rgb(colour), thickness=width, thickness_units="screen")

    def _place_camera(self) -> None:
        """Look at the robot as the three-quarter camera of the video does."""
        camera = self._server.initial_camera
        camera.position = (0.75 * self._size, -0.95 * self._size, 0.50 * self._size)
        camera.look_at = (0.0, 0.0, 0.22 * self._size)
        camera.fov = math.radians(38.0)


def _segment(start: Array, end: tuple[float, float, float]) -> NDArray[np.float32]:
    return np.array([[start, end]], dtype=np.float32)
