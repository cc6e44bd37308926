"""Outlines of the sets behind a push, for drawing: slices of the state space at the measured state."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.moa import regulator_set
from controllers.baselines.paper import PaperSupervisor
from controllers.geometry.polytope import EmptyPolytopeError, Polytope
from controllers.pendulum import Pendulum
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import Heading
from controllers.supervisor.regulator import Regulator
from controllers.supervisor.supervisor import Supervisor
from models.robot import Robot, other
from sim.episode.make_controller import BalanceController

Array = NDArray[np.float64]
Plane = Literal["x-xdot", "y-ydot"]
Name = Literal["regulator", "tracking"]

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
    """

    name: Name
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
    controller: BalanceController, x: Array, *, push: int, planes: Sequence[Plane] = ("x-xdot",)
) -> tuple[SetPolygon, ...]:
    """Slices of the regulator's set and of the steppers' set through a state.

    The regulator's is that of the softest gain, in the latest double support. The steppers' is that of the best step
    from there: of its number of steps, its foot and its duration, for sets of different ones make no convex shape
    together. The paper's reference has one set, that of its present phase.

    Args:
        controller: holds the latest stance; one without sets has no polygons.
        x: (4,) measured state that the slice goes through.
        push: number of the push, from 1.
        planes: which planes to cut.
    """
    if not isinstance(controller, Supervisor | PaperSupervisor) or controller.regulator is None:
        return ()
    reach = _reach(controller.robot)
    whole: list[tuple[Name, Polytope]] = [("regulator", _regulator(controller.regulator, reach))]
    if (stepping := _stepping(controller, x)) is not None:
        whole.append(("tracking", stepping))
    polygons = []
    for plane in planes:
        for name, polytope in whole:
            vertices = _cut(polytope, plane, x, controller.regulator.bank.centre, reach)
            polygons.append(SetPolygon(name=name, push=push, plane=plane, kind="slice", vertices=vertices))
    return tuple(polygons)


def dcm_polytope(pendulum: Pendulum, polygon: Polytope, heading: Heading, origin: Array) -> Polytope:
    """States (4,) whose DCM is in a polygon that is seen from a foot at `origin` (2,) [m]."""
    c, s = math.cos(heading.yaw), math.sin(heading.yaw)
    normals = polygon.S @ np.array([[c, s], [-s, c]])
    return Polytope(
        S=normals @ np.kron(np.eye(2), [1.0, 1.0 / pendulum.omega]), a=polygon.a + normals @ np.asarray(origin)
    )


def _regulator(regulator: Regulator, reach: tuple[float, float]) -> Polytope:
    softest = regulator.softest
    return regulator_set(softest.pendulum, softest.gain, softest.polygon, softest.centre, bounds=reach).in_world()


def _stepping(controller: Supervisor | PaperSupervisor, x: Array) -> Polytope | None:
    """States that the steps hold which are best for x (4,)."""
    if isinstance(controller, PaperSupervisor):
        assert controller.tracker is not None
        tracked = controller.tracker.sets.polytope(controller.tracker.phase)
        # The rows are of states where the reference was planned.
        return Polytope(S=tracked.S, a=tracked.a + tracked.S @ (x - controller.seen(x)))
    if not isinstance(controller.rule, SetPolicy):
        return None
    regulator, lift = controller.regulator, controller.best_step(x)
    assert regulator is not None
    stance, sets, heading = other(lift.side), controller.rule.lift_sets, controller.heading
    origin = regulator.feet[stance].position
    swing = heading.local(regulator.feet[lift.side].position, origin)
    polygon = sets.polygon(lift.steps, stance, lift.step_time, swing, step_time=lift.step_time)
    return dcm_polytope(sets.pendulum, polygon, heading, origin)


def _cut(polytope: Polytope, plane: Plane, x: Array, centre: Array, reach: tuple[float, float]) -> Array:
    """Corners of a slice within what the legs allow."""
    axes = PLANES[plane]
    room, middle = np.full(4, np.inf), np.zeros(4)
    room[list(axes)], middle[0::2] = reach, centre
    bounded = polytope.intersect(Polytope.box(middle - room, middle + room))
    try:
        return bounded.slice(axes, x).vertices()
    except EmptyPolytopeError:
        return np.empty((0, 2))


def _reach(robot: Robot) -> tuple[float, float]:
    """Largest offset of the COG that the legs allow [m], and three times the speed whose DCM is that far out [m/s]."""
    return robot.hip_reach, 3.0 * robot.omega * robot.hip_reach
