"""Outlines of the sets behind a push, for drawing: slices of the state space at the measured state."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controllers.moa import regulator_set
from controllers.supervisor import Supervisor

Array = NDArray[np.float64]
Plane = Literal["x-xdot", "y-ydot"]

PLANES: dict[Plane, tuple[int, int]] = {"x-xdot": (0, 1), "y-ydot": (2, 3)}
RAYS = 32
BISECTIONS = 9


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPolygon:
    """A set of states as it was when a push had ended, cut down to a plane.

    Attributes:
        name: whose maximal output admissible set it is.
        push: number of the push, from 1.
        plane: its axes; position [m] and velocity [m/s] of the COG in the world, relative to nothing.
        kind: "slice" at the other axis' measured state, or "projection" over all of its states.
        vertices: (n, 2) in order around it; n = 0 if the set is empty there.
    """

    name: Literal["regulator", "tracking"]
    push: int
    plane: Plane = "x-xdot"
    kind: Literal["slice", "projection"]
    vertices: Array

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64).reshape(-1, 2)
        if not np.isfinite(vertices).all():
            raise ValueError(f"the {self.name} set of push {self.push} has vertices that are not finite")
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)


def admissible_polygons(
    supervisor: Supervisor, x: Array, *, push: int, planes: Sequence[Plane] = ("x-xdot",)
) -> tuple[SetPolygon, ...]:
    """Slices of the regulator's set and of the stepping trackers' set through a state.

    The regulator's is that of the latest double support. The trackers' is the set of states from which a stepping
    reference that starts at the state itself keeps the ZMP inside (membership with e_0 = 0), found along rays, which
    suffices since it is convex for each foot and number of steps; where these differ it is their union as seen from
    the middle.

    Args:
        supervisor: holds the latest stance.
        x: (4,) measured state that the slice goes through.
        push: number of the push, from 1.
        planes: which planes to cut.
    """
    regulator = supervisor.regulator
    if regulator is None:
        return ()
    reach = _reach(supervisor)
    bounded = regulator_set(
        regulator.admissible.pendulum, regulator.gain, regulator.polygon, regulator.admissible.centre, bounds=reach
    )
    polygons = []
    for plane in planes:
        axes = PLANES[plane]
        vertices = bounded.in_world().slice(axes, x).vertices()
        polygons.append(SetPolygon(name="regulator", push=push, plane=plane, kind="slice", vertices=vertices))
        middle = x.copy()
        middle[list(axes)] = bounded.x_C[list(axes)]

        def member(state: Array) -> bool:
            choice = supervisor.best_step(state)
            return choice is not None and choice.plan.slack >= 0.0

        outline = _outline(member, middle, axes, reach)
        polygons.append(SetPolygon(name="tracking", push=push, plane=plane, kind="slice", vertices=outline))
    return tuple(polygons)


def _reach(supervisor: Supervisor) -> tuple[float, float]:
    """Largest offset of the COG that the legs allow [m], and three times the speed whose DCM is that far out [m/s]."""
    return supervisor.robot.hip_reach, 3.0 * supervisor.robot.omega * supervisor.robot.hip_reach


def _outline(member: Callable[[Array], bool], middle: Array, axes: tuple[int, int], reach: tuple[float, float]) -> Array:
    """Boundary of a set around a member, along rays that are even in units of the reach."""
    if not member(middle):
        return np.empty((0, 2))
    points = []
    for angle in np.arange(RAYS) * 2.0 * math.pi / RAYS:
        ray = np.zeros(4)
        ray[axes[0]], ray[axes[1]] = math.cos(angle) * reach[0], math.sin(angle) * reach[1]
        # Up to the box of the reach, beyond which the model means nothing.
        inside, outside = 0.0, 1.0 / max(abs(math.cos(angle)), abs(math.sin(angle)))
        if member(middle + outside * ray):
            inside = outside
        else:
            for _ in range(BISECTIONS):
                half = 0.5 * (inside + outside)
                inside, outside = (half, outside) if member(middle + half * ray) else (inside, half)
        points.append((middle + inside * ray)[list(axes)])
    return np.array(points)
