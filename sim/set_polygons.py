"""Outlines of the sets behind a push, for drawing: slices of the state space at the measured state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controllers.moa import regulator_set
from controllers.parametric_slice import admissible_slice
from controllers.polytope import EmptyPolytopeError
from controllers.supervisor import Supervisor

Array = NDArray[np.float64]
Plane = Literal["x-xdot", "y-ydot"]

PLANES: dict[Plane, tuple[int, int]] = {"x-xdot": (0, 1), "y-ydot": (2, 3)}


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
    """Slices of the regulator's set and of the steppers' set through a state.

    The regulator's is that of the latest double support. The steppers' is that of the best first step from there: all
    states from which a reference that starts at the state itself keeps the ZMP inside, so that it is a member of that
    reference's tracking set with no error.

    Args:
        supervisor: holds the latest stance.
        x: (4,) measured state that the slice goes through.
        push: number of the push, from 1.
        planes: which planes to cut.
    """
    regulator = supervisor.regulator
    if regulator is None:
        return ()
    pendulum, reach = regulator.admissible.pendulum, _reach(supervisor)
    bounded = regulator_set(pendulum, regulator.gain, regulator.polygon, regulator.admissible.centre, bounds=reach)
    choice = supervisor.best_step(x)
    polygons = []
    for plane in planes:
        axes = PLANES[plane]
        try:
            vertices = bounded.in_world().slice(axes, x).vertices()
        except EmptyPolytopeError:
            vertices = np.empty((0, 2))
        polygons.append(SetPolygon(name="regulator", push=push, plane=plane, kind="slice", vertices=vertices))
        if choice is not None:
            plan, limits = choice.plan, supervisor.options.limits
            outline = admissible_slice(
                pendulum, regulator.feet, plan.swing, plan.step_time, limits, axes=axes, at=x, box=reach
            )
            polygons.append(SetPolygon(name="tracking", push=push, plane=plane, kind="slice", vertices=outline))
    return tuple(polygons)


def _reach(supervisor: Supervisor) -> tuple[float, float]:
    """Largest offset of the COG that the legs allow [m], and three times the speed whose DCM is that far out [m/s]."""
    return supervisor.robot.hip_reach, 3.0 * supervisor.robot.omega * supervisor.robot.hip_reach
