"""The geoms of a compiled robot as triangles, one mesh for each look that a body has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from models.arena import FLOOR

Array = NDArray[np.float64]
Kind = mujoco.mjtGeom

_UNSET = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's colour of a geom that says none; then its material's is drawn
_AROUND = 20  # corners of what is round


@dataclass(frozen=True, kw_only=True)
class BodyMesh:
    """Triangles that move with a body and look alike.

    Attributes:
        body: number of the body in the model.
        rgba: colour and opacity, each from 0 to 1.
        flat: whether its faces are flat rather than an approximation of what is round.
        vertices: (v, 3) in the body's frame [m].
        faces: (f, 3) numbers of vertices.
    """

    body: int
    rgba: tuple[float, float, float, float]
    flat: bool
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]


def body_meshes(model: mujoco.MjModel) -> list[BodyMesh]:
    """All that MuJoCo draws of a model unless told otherwise, but for the floor and other endless geoms."""
    alike: dict[tuple[int, tuple[float, ...], bool], list[tuple[Array, NDArray[np.int64]]]] = {}
    for geom, flat, vertices, faces in _drawn(model):
        key = int(model.geom_bodyid[geom]), _rgba(model, geom), flat
        alike.setdefault(key, []).append((vertices, faces))
    found = []
    for (body, rgba, flat), parts in alike.items():
        first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
        found.append(
            BodyMesh(
                body=body,
                rgba=(rgba[0], rgba[1], rgba[2], rgba[3]),
                flat=flat,
                vertices=np.concatenate([vertices for vertices, _ in parts]).astype(np.float32),
                faces=np.concatenate([faces + n for (_, faces), n in zip(parts, first, strict=False)]).astype(
                    np.uint32
                ),
            )
        )
    return found


def _drawn(model: mujoco.MjModel) -> Iterator[tuple[int, bool, Array, NDArray[np.int64]]]:
    """Number, flatness, vertices in the body's frame and faces of each geom that is drawn."""
    shown = mujoco.MjvOption().geomgroup
    floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, FLOOR)
    for geom in range(model.ngeom):
        group = min(max(int(model.geom_group[geom]), 0), len(shown) - 1)
        if geom == floor or not shown[group] or _rgba(model, geom)[3] == 0.0:
            continue
        shape = _shape(model, geom)
        if shape is None:
            continue
        vertices, faces, flat = shape
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        yield geom, flat, vertices @ turn.reshape(3, 3).T + model.geom_pos[geom], faces


def _shape(model: mujoco.MjModel, geom: int) -> tuple[Array, NDArray[np.int64], bool] | None:
    """Vertices in the geom's frame, faces, and whether these are flat; None of what has no surface of its own."""
    kind, size = Kind(model.geom_type[geom]), model.geom_size[geom]
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF):
        mesh = int(model.geom_dataid[geom])
        corner, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        return model.mesh_vert[corner : corner + count], model.mesh_face[face : face + faces], True
    from trimesh import creation as make  # comes with viser, and is asked for first when something is drawn

    if kind == Kind.mjGEOM_BOX:
        solid, flat = make.box(extents=2.0 * size), True
    elif kind == Kind.mjGEOM_CYLINDER:
        solid, flat = make.cylinder(radius=size[0], height=2.0 * size[1], sections=2 * _AROUND), True
    elif kind == Kind.mjGEOM_CAPSULE:
        solid, flat = make.capsule(radius=size[0], height=2.0 * size[1], count=[_AROUND, _AROUND]), False
    elif kind in (Kind.mjGEOM_SPHERE, Kind.mjGEOM_ELLIPSOID):
        solid, flat = make.uv_sphere(radius=1.0, count=[_AROUND, _AROUND]), False
        solid.apply_scale(size if kind == Kind.mjGEOM_ELLIPSOID else size[0])
    else:
        return None
    return np.asarray(solid.vertices), np.asarray(solid.faces), flat


def _rgba(model: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    material = int(model.geom_matid[geom])
    own = tuple(model.geom_rgba[geom].tolist())
    return own if material < 0 or own != _UNSET else tuple(model.mat_rgba[material].tolist())
