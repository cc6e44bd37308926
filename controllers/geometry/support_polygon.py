"""Feet and the support polygon (9)-(10) that they span on a flat floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from controllers.geometry.planar import COLLINEAR, hull
from controllers.geometry.planar_kernel import clipped, nearest
from models.errors import OkiagariError

if TYPE_CHECKING:
    from models.robot import Robot, Side

# Corners closer than this [m] are one: less than `hull` leaves between any two.
_SAME = 0.5 * COLLINEAR
_COMPASS = ("front", "front left", "left", "rear left", "rear", "rear right", "right", "front right")


Point = np.ndarray | Sequence[float]


class SupportError(OkiagariError):
    """A foot or a support polygon that cannot be: not finite, not convex, clockwise, or flat."""


class EmptyPolygonError(SupportError):
    """Nothing is left of a polygon after it was shrunk."""


def _planar(name: str, value: ArrayLike) -> np.ndarray:
    array = np.array(value, dtype=float)
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 3 or not np.isfinite(array).all():
        raise SupportError(f"{name} must be three or more finite points of the plane, got shape {array.shape}")
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True, eq=False)
class SupportPolygon:
    """Convex polygon {u : M u <= v}, rows in metres.

    Attributes:
        vertices: (n, 2) counter-clockwise, world frame [m].
        M: (n, 2) outward unit normals; row i belongs to the edge from vertex i to vertex i + 1 (10).
        v: (n,) offsets [m].
        centre: (2,) centroid of the area [m].
    """

    vertices: np.ndarray
    M: np.ndarray = field(init=False, repr=False)
    v: np.ndarray = field(init=False, repr=False)
    centre: np.ndarray = field(init=False, repr=False)
    _edges: tuple[tuple[float, float, float], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = _planar("vertices", self.vertices)
        corners = [(float(x), float(y)) for x, y in vertices.tolist()]
        edges, area, moment_x, moment_y, reversals = [], 0.0, 0.0, 0.0, 0
        ox, oy = corners[0]
        for i, (x, y) in enumerate(corners):
            nx, ny = corners[(i + 1) % len(corners)]
            fx, fy = corners[(i + 2) % len(corners)]
            length = math.hypot(nx - x, ny - y)
            turn = (nx - x) * (fy - ny) - (ny - y) * (fx - nx)
            if length <= _SAME or turn <= 0.0:
                raise SupportError("vertices must be distinct, strictly convex and counter-clockwise")
            reversals += (ny < y) != (fy < ny)
            mx, my = (ny - y) / length, (x - nx) / length
            edges.append((mx, my, mx * x + my * y))
            twice = (x - ox) * (ny - oy) - (y - oy) * (nx - ox)
            area += twice
            moment_x += twice * (x + nx - 2.0 * ox)
            moment_y += twice * (y + ny - 2.0 * oy)
        # Left turns only, but round more than once.
        if reversals != 2:
            raise SupportError("vertices must go round once")
        rows = np.array(edges)
        centre = np.array([ox + moment_x / (3.0 * area), oy + moment_y / (3.0 * area)])
        normals, offsets = np.ascontiguousarray(rows[:, :2]), np.ascontiguousarray(rows[:, 2])
        for name, value in (("vertices", vertices), ("M", normals), ("v", offsets), ("centre", centre)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_edges", tuple(edges))

    def slack(self, u: Point) -> float:
        """Distance [m] from the point u (2,) to the nearest edge line, negative outside, -inf if not finite."""
        return self._slack(float(u[0]), float(u[1]))

    def _slack(self, x: float, y: float) -> float:
        if not (math.isfinite(x) and math.isfinite(y)):
            return -math.inf
        best = math.inf
        # A loop over four to six float triples is several times faster than numpy on one point.
        for mx, my, v in self._edges:
            s = v - mx * x - my * y
            if s < best:
                best = s
        return best

    def slacks(self, points: ArrayLike) -> np.ndarray:
        """`slack` of each point of (..., 2), as (...,) [m]."""
        return np.min(self.v - np.asarray(points, dtype=float) @ self.M.T, axis=-1)

    def contains(self, u: Point) -> bool:
        """Whether u (2,) is in the closed polygon."""
        return self.slack(u) >= 0.0

    def nearest(self, u: Point) -> np.ndarray:
        """Point (2,) of the polygon nearest to u (2,) [m].

        Raises:
            SupportError: u is not finite.
        """
        return np.array(self.nearest_to(float(u[0]), float(u[1])))

    def nearest_to(self, x: float, y: float) -> tuple[float, float]:
        """`nearest` in plain numbers, four times as fast."""
        inside = self._slack(x, y)
        if inside >= 0.0:
            return x, y
        if inside == -math.inf:
            raise SupportError(f"no point of the polygon is nearest to ({x!r}, {y!r})")
        return nearest(self.vertices, x, y)

    def shrunk(self, margin: float) -> SupportPolygon:
        """Polygon of the points at least `margin` [m] inside.

        Raises:
            SupportError: margin is negative or not finite.
            EmptyPolygonError: no area is left.
        """
        if not (math.isfinite(margin) and margin >= 0.0):
            raise SupportError(f"margin must be a finite non-negative number of metres, got {margin!r}")
        if margin == 0.0:
            return self
        points = [(x, y) for x, y in clipped(self.vertices, self.M, self.v - margin).tolist()]
        corners = hull(points) if points else []
        if len(corners) < 3:
            raise EmptyPolygonError(f"nothing is left of the polygon {margin} m inside its edges")
        return SupportPolygon(np.array(corners))

    def moved(self, offset: Point) -> SupportPolygon:
        """The polygon shifted by `offset` (2,) [m]; skips the checks that a shift cannot break."""
        dx, dy = float(offset[0]), float(offset[1])
        if not (math.isfinite(dx) and math.isfinite(dy)):
            raise SupportError(f"a polygon cannot be shifted by {offset!r}")
        shift = np.array([dx, dy])
        polygon = object.__new__(SupportPolygon)
        edges = tuple([(mx, my, v + mx * dx + my * dy) for mx, my, v in self._edges])
        offsets = np.array([v for _, _, v in edges])
        vertices, centre = self.vertices + shift, self.centre + shift
        for array in (offsets, vertices, centre):
            array.setflags(write=False)
        values = (vertices, self.M, offsets, centre, edges)
        for name, value in zip(SupportPolygon.__slots__, values, strict=True):
            object.__setattr__(polygon, name, value)
        return polygon

    def edge_name(self, i: int) -> str:
        """Human name of edge i by the direction it faces: "front", "left", "rear right", ..."""
        mx, my, _ = self._edges[i]
        return _COMPASS[round(math.atan2(my, mx) / (math.pi / 4)) % 8]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Foot:
    """A sole that lies flat on the floor.

    Attributes:
        position: (2,) of the foot point, world frame [m].
        yaw: heading about z [rad].
        sole: (n, 2) convex outline, counter-clockwise, foot frame [m].
        vertices: (n, 2) outline in the world frame [m].
    """

    position: np.ndarray
    yaw: float
    sole: np.ndarray
    vertices: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        position = np.array(self.position, dtype=float)
        if position.shape != (2,) or not (np.isfinite(position).all() and math.isfinite(self.yaw)):
            raise SupportError(f"a foot needs a finite position (2,) and yaw, got {position!r}, {self.yaw!r}")
        sole = _planar("sole", self.sole)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        vertices = sole @ np.array([[c, s], [-s, c]]) + position
        for name, value in (("position", position), ("sole", sole), ("vertices", vertices)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "yaw", float(self.yaw))

    def moved(self, position: ArrayLike) -> Foot:
        """The same sole with the same heading at another `position` (2,) [m]."""
        return Foot(position=np.asarray(position, dtype=float), yaw=self.yaw, sole=self.sole)


def standing_feet(robot: Robot) -> dict[Side, Foot]:
    """The feet of a robot in its stand."""
    return {
        side: Foot(position=np.array([x, y]), yaw=yaw, sole=robot.sole_vertices[side])
        for side, (x, y, yaw) in robot.sole_stance.items()
    }


def support_polygon(feet: Sequence[Foot]) -> SupportPolygon:
    """Convex hull of the soles on the floor, points on an edge dropped.

    Raises:
        SupportError: there is no foot.
    """
    points = [(x, y) for foot in feet for x, y in foot.vertices.tolist()]
    if not points:
        raise SupportError("no foot on the floor: there is no support polygon")
    return SupportPolygon(np.array(hull(points)))
