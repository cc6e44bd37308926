"""Outlines of the sets behind a push, for drawing: slices of the state space at the measured state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.polytope import EmptyPolytopeError, Polytope
from controllers.interface import Region, Regional
from controllers.supervisor.regulator import leg_bounds
from models.robot import Robot

Array = NDArray[np.float64]
Plane = Literal["x-xdot", "y-ydot"]
Name = Literal["regulator", "tracking"]

_SAME = 1e-9  # [m], [m/s]

PLANES: dict[Plane, tuple[int, int]] = {"x-xdot": (0, 1), "y-ydot": (2, 3)}


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPolygon:
    """A set of states as it was when a push had ended, cut down to a plane.

    Attributes:
        name: whose maximal output admissible set it is: "tracking" is of the steps.
        push: number of the push, from 1.
        plane: its axes; position [m] and velocity [m/s] of the COG in the world, relative to nothing.
        kind: "slice" at the other axis' measured state, or "projection" over all of its states.
        vertices: (n, 2) in order around it; n = 0 if the set is empty there.
        cut: (n,) whether the edge from each vertex to the next is no edge of the set, but where the legs end.
    """

    name: Name
    push: int
    plane: Plane = "x-xdot"
    kind: Literal["slice", "projection"]
    vertices: Array
    cut: NDArray[np.bool_]

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64).reshape(-1, 2)
        if not np.isfinite(vertices).all():
            raise ValueError(f"the {self.name} set of push {self.push} has vertices that are not finite")
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)


def admissible_polygons(
    controller: Regional, robot: Robot, x: Array, *, push: int, planes: Sequence[Plane] = ("x-xdot",)
) -> tuple[SetPolygon, ...]:
    """Slices of a controller's sets through a state.

    Args:
        controller: whose sets.
        robot: whom it balances; what its legs cannot reach is not drawn.
        x: (4,) measured state that the slice goes through.
        push: number of the push, from 1.
        planes: which planes to cut.
    """
    regions = controller.regions(x)
    return tuple(_slice(region, plane, x, robot, push) for plane in planes for region in regions)


def _slice(region: Region, plane: Plane, x: Array, robot: Robot, push: int) -> SetPolygon:
    """A slice within what the legs allow."""
    axes = PLANES[plane]
    room, middle = np.full(4, np.inf), np.zeros(4)
    room[list(axes)], middle[0::2] = leg_bounds(robot), region.centre
    bounded = region.states.intersect(Polytope.box(middle - room, middle + room))
    try:
        vertices = bounded.slice(axes, x).vertices()
    except EmptyPolytopeError:
        vertices = np.empty((0, 2))
    # Both ends of an edge are at the same bound.
    away = vertices - middle[list(axes)]
    at_bound = np.abs(np.hstack((away - room[list(axes)], away + room[list(axes)]))) < _SAME
    cut = (at_bound & np.roll(at_bound, -1, axis=0)).any(axis=1)
    return SetPolygon(name=region.name, push=push, plane=plane, kind="slice", vertices=vertices, cut=cut)
