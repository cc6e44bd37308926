"""Where a robot's soles are: the feet that carry the lowest geoms, and the rectangles that they stand on."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from models.adopt.source import Source
from models.arena import SIDES, Side
from models.errors import InputError

Array = NDArray[np.float64]

_AT_GROUND = 0.006
"""What is this near to the lowest point of a foot stands on the floor [m]."""
_GRID = 25
"""Lines between which the sides of a sole are sought, along either axis."""
_BACKWARD = 0.005
"""Middles of the soles that are so far behind the ankles [m] are of a robot that may face backward."""
_NEARLY_LEVEL = math.cos(math.radians(35.0))
_TILTED = 0.15
"""A foot's axes that are nearer than this to upright at home are upright: home poses lean a little."""


@dataclass(frozen=True, kw_only=True)
class Sole:
    """A rectangle under a foot.

    Attributes:
        body: the foot.
        centre: (3,) its middle, in the foot's frame [m].
        turn: (3, 3) from the sole's frame (x forward, z up) to the foot's.
        size: (2,) length and width [m].
        depth: of the sole below the foot's origin [m].
    """

    body: int
    centre: Array
    turn: Array
    size: Array
    depth: float


def find_soles(source: Source) -> dict[Side, Sole]:
    """Find both feet and their soles, in the pose at home, and tell the source its legs.

    Raises:
        InputError: if no feet are found, or what they stand on has no area.
    """
    geoms = _solid_geoms(source)
    feet: dict[Side, int] = {side: _foot(source, geoms, side) for side in SIDES}
    source.find_legs(feet)
    found = {side: _sole(source, feet[side], geoms[feet[side]], side) for side in SIDES}
    if max(_toes_ahead(source, sole) for sole in found.values()) < -_BACKWARD:
        source.notes.append("the soles reach farther back than forward of the ankles: does the robot face along x?")
    size = np.minimum(found["left"].size, found["right"].size)
    if not np.allclose(found["left"].size, found["right"].size, atol=2e-3):
        text = {side: f"{100 * found[side].size[0]:.1f} x {100 * found[side].size[1]:.1f} cm" for side in SIDES}
        source.notes.append(f"the soles differ, left {text['left']}, right {text['right']}; both got the lesser sides")
    return {side: replace(sole, size=size) for side, sole in found.items()}


def _toes_ahead(source: Source, sole: Sole) -> float:
    """How far a sole's middle is ahead of the foot's last joint [m]."""
    model = source.model
    first, count = int(model.body_jntadr[sole.body]), int(model.body_jntnum[sole.body])
    ankle = model.jnt_pos[first + count - 1] if count else np.zeros(3)
    return float((sole.turn.T @ (sole.centre - ankle))[0])


def lowest_point(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Height of a geom's lowest point in the present pose [m]; inf for a kind that no foot is made of."""
    points = _points(model, data, geom)
    return float(points[:, 2].min()) if len(points) else math.inf


def _solid_geoms(source: Source) -> dict[int, list[int]]:
    """Geoms that can touch something, by the body that moves them; if there are none, all."""
    model = source.model
    solid = [g for g in range(model.ngeom) if model.geom_contype[g] or model.geom_conaffinity[g]]
    if not solid:
        source.notes.append("no geom can touch anything; the soles were found from what is only to be looked at")
        solid = list(range(model.ngeom))
    by_body: dict[int, list[int]] = {}
    for geom in solid:
        body = int(model.geom_bodyid[geom])
        while body > source.root and not model.body_jntnum[body]:
            body = int(model.body_parentid[body])
        by_body.setdefault(body, []).append(geom)
    return by_body


def _foot(source: Source, geoms: dict[int, list[int]], side: Side) -> int:
    model, data = source.model, source.data
    named = source.hints.left_foot if side == "left" else source.hints.right_foot
    if named is not None:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, named)
        if body not in geoms:
            names = ", ".join(model.body(each).name for each in geoms)
            raise InputError(f"{source.path}: {side}_foot: {named!r} is none of the moving bodies with geoms, {names}")
        return body
    sign = 1.0 if side == "left" else -1.0
    least = min(min(lowest_point(model, data, g) for g in each) for each in geoms.values())
    on_side = [b for b in geoms if sign * (data.xpos[b][1] - data.xpos[source.root][1]) > 0.01 and b != source.root]
    heights = {b: min(lowest_point(model, data, g) for g in geoms[b]) for b in on_side}
    ground = least + 0.1 * (data.xpos[source.root][2] - least)
    if not heights or min(heights.values()) > ground:
        down = [b for b in geoms if b != source.root and min(lowest_point(model, data, g) for g in geoms[b]) <= ground]
        x, y = np.ptp(data.xpos[down][:, :2], axis=0) if down else (0.0, 0.0)
        turned = "; what does is beside each other along x: does the robot face y?" if x > 2 * y + 0.01 else ""
        raise InputError(
            f"{source.path}: no {side} foot found: in {source.home} and with the root body's x forward, y left and z "
            f"up, nothing on the {side} reaches the ground{turned}; {side}_foot or keyframe in robot.toml can name it"
        )
    return min(heights, key=lambda body: heights[body])


def _sole(source: Source, foot: int, geoms: list[int], side: Side) -> Sole:
    model, data = source.model, source.data
    points = np.vstack([_points(model, data, geom) for geom in geoms]) - data.xpos[foot]
    level = np.eye(3)
    box = _largest_rectangle(_lowest(points)[:, :2])
    if box is None:  # the foot may be tilted
        level = _levelled(points)
        points = points @ level.T
        box = _largest_rectangle(_lowest(points)[:, :2])
    if box is None:
        raise InputError(
            f"{source.path}: what the {side} foot {model.body(foot).name!r} stands on in {source.home} has no area to "
            f"speak of; name another keyframe, in which it stands flat, or another body as {side}_foot in robot.toml"
        )
    points = _lowest(points)
    x0, x1, y0, y1 = box
    turn = (level @ data.xmat[foot].reshape(3, 3)).T.copy()
    snapped = np.round(turn)
    if np.abs(turn - snapped).max() < _TILTED and abs(float(np.linalg.det(snapped)) - 1.0) < 1e-9:
        turn = snapped
    depth = -float(points[:, 2].min())
    centre = turn @ [(x0 + x1) / 2, (y0 + y1) / 2, -depth]
    return Sole(body=foot, centre=centre, turn=turn, size=np.array([x1 - x0, y1 - y0]), depth=depth)


def _lowest(points: Array) -> Array:
    return points[points[:, 2] < points[:, 2].min() + _AT_GROUND]


def _levelled(points: Array) -> Array:
    """(3, 3) that turns the largest of the nearly level faces under points (n, 3) down; else the identity."""
    down = np.array([0.0, 0.0, -1.0])
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):  # all in one plane
        across = np.linalg.svd(points - points.mean(axis=0))[2][-1]
        normal = across if across[2] < 0.0 else -across
    else:
        corners = points[hull.simplices]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        normals = hull.equations[:, :3]
        # A face is made of triangles; each counts with all that look the same way.
        alike = (normals @ normals.T > 1.0 - 1e-4) @ areas * (normals @ down > _NEARLY_LEVEL)
        normal = normals[int(alike.argmax())]
    if normal @ down <= _NEARLY_LEVEL:
        return np.eye(3)
    turn, quaternion, axis = np.zeros(9), np.zeros(4), np.cross(normal, down)
    if (sine := float(np.linalg.norm(axis))) < 1e-12:
        return np.eye(3)
    mujoco.mju_axisAngle2Quat(quaternion, axis / sine, math.atan2(sine, float(normal @ down)))
    mujoco.mju_quat2Mat(turn, quaternion)
    return turn.reshape(3, 3)


def _points(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Array:
    """(n, 3) points of a geom that can be its lowest ones, world frame; none for kinds that no foot is made of."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    place, frame = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    geoms = mujoco.mjtGeom
    if kind == geoms.mjGEOM_BOX:
        return np.asarray(place + (np.array(list(itertools.product((-1, 1), repeat=3))) * size) @ frame.T)
    if kind in (int(geoms.mjGEOM_SPHERE), int(geoms.mjGEOM_ELLIPSOID)):
        least = size[0] if kind == geoms.mjGEOM_SPHERE else float(np.linalg.norm(frame[2] * size))
        return np.asarray((place - [0.0, 0.0, least])[None])
    if kind == geoms.mjGEOM_CYLINDER and abs(frame[2, 2]) > _NEARLY_LEVEL:
        around = np.linspace(0.0, 2 * np.pi, 17)[:-1]
        x, y = size[0] * np.cos(around), size[0] * np.sin(around)
        rims = [np.column_stack([x, y, np.full(16, half)]) for half in (-size[1], size[1])]
        return np.asarray(place + np.vstack(rims) @ frame.T)
    if kind in (int(geoms.mjGEOM_CAPSULE), int(geoms.mjGEOM_CYLINDER)):
        ends = place + np.outer([-1.0, 1.0], frame[:, 2] * size[1])
        # One that lies has some width, of which the rounding takes half.
        beside = np.cross(frame[:, 2], [0.0, 0.0, 1.0])
        return np.vstack([ends - [0.0, 0.0, size[0]] + share * size[0] * beside for share in (-0.5, 0.5)])
    if kind == geoms.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return np.asarray(place + model.mesh_vert[first : first + count] @ frame.T)
    return np.zeros((0, 3))


def _largest_rectangle(points: Array) -> tuple[float, float, float, float] | None:
    """x0, x1, y0, y1 of the largest rectangle along the axes in the hull of points (n, 2); None for a line."""
    low, high = points.min(axis=0), points.max(axis=0)
    if len(points) < 3 or (high - low).min() < 1e-3:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    xs, ys = np.linspace(low[0], high[0], _GRID), np.linspace(low[1], high[1], _GRID)
    corners = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    inside = (corners @ hull.equations[:, :2].T + hull.equations[:, 2] <= 1e-9).all(axis=-1)
    first, last = np.triu_indices(_GRID, 1)
    both = inside[first] & inside[last]  # (pairs of x, y)
    fits = both[:, first] & both[:, last]  # (pairs of x, pairs of y)
    area = np.outer(xs[last] - xs[first], ys[last] - ys[first]) * fits
    i, k = np.unravel_index(int(area.argmax()), area.shape)
    if area[i, k] <= 0.0:
        return None
    return float(xs[first[i]]), float(xs[last[i]]), float(ys[first[k]]), float(ys[last[k]])
