"""The walk of Section IV-C as the set figures need it: the reference, its sets, and where the feet are at each tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain, lqr
from controllers.moa import MoaSet, regulator_set
from controllers.pendulum import Pendulum
from controllers.polytope import Polytope, polygon_area
from controllers.reference import Reference
from controllers.support import Foot, support_polygon
from controllers.tracking_sets import TrackingSets, tracking_sets
from controllers.walk import walk_reference
from models.arena import SIDES, Side
from models.robot import Robot, other

Array = NDArray[np.float64]
Kind = Literal["projection", "slice"]
T = TypeVar("T")

# Section IV-C: period, duration of a step, stride, and the weights of the LQR (Q = I, R = 1).
DT, STEP_TIME, STRIDE, STEPS = 0.005, 0.5, 0.1, 4
PLANES: dict[str, tuple[int, int]] = {"x-xdot": (0, 1), "y-ydot": (2, 3)}
SWING_HEIGHT = 0.03
_FIRST: Side = "right"
_REPEATS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk:
    """A stepping reference from rest with everything that is computed on it.

    Attributes:
        robot, pendulum, gain, feet: whose walk it is, and where the feet stand at first.
        reference: xi, mu and supports (26).
        regulator: MOA set of the regulator at the first stance (21)-(24).
        terminal: the same at the last stance.
        sets: tracking sets kO_inf of all phases (28)-(41).
        timings_ms: best wall time of each of these computations [ms].
    """

    robot: Robot
    pendulum: Pendulum
    gain: Gain
    feet: Mapping[Side, Foot]
    reference: Reference
    regulator: MoaSet
    terminal: MoaSet
    sets: TrackingSets
    timings_ms: Mapping[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Outline:
    """A set cut down to a plane, and what to know of it.

    Attributes:
        kind: "projection" over the other coordinates, or "slice" at their referential values.
        vertices: (p, 2) counter-clockwise [m], [m/s].
        facts: figure, set, time, plane, kind, area [m^2/s], rows and t_star; JSON types.
    """

    kind: Kind
    vertices: Array
    facts: dict[str, Any]


def standing_feet(robot: Robot) -> dict[Side, Foot]:
    """The feet of a robot in its stand."""
    stance = robot.sole_stance
    return {
        side: Foot(position=np.array(stance[side][:2]), yaw=stance[side][2], sole=robot.sole_vertices[side])
        for side in SIDES
    }


def plan_walk(robot: Robot, *, steps: int = STEPS, feet: Mapping[Side, Foot] | None = None) -> Walk:
    """Plan the walk of Section IV-C and compute its sets; `feet` other than in the robot's stand if given."""
    pendulum = Pendulum(robot.omega, DT)
    gain = lqr(pendulum, (1.0, 1.0), 1.0)
    feet = standing_feet(robot) if feet is None else feet
    middle = 0.5 * (feet["left"].position + feet["right"].position)
    stance = support_polygon([feet["left"], feet["right"]])
    timings: dict[str, float] = {}

    def timed(name: str, compute: Callable[[], T]) -> T:
        result, timings[name] = best_of(_REPEATS, compute)
        return result

    regulator = timed("regulator_set", lambda: regulator_set(pendulum, gain, stance, middle))
    reference = timed("reference", lambda: walk_reference(pendulum, feet, STRIDE, steps, STEP_TIME, first=_FIRST))
    terminal = regulator_set(pendulum, gain, reference.final, centre=reference.xi[-1, 0::2])
    sets = timed("tracking_sets", lambda: tracking_sets(pendulum, gain, reference, terminal))
    return Walk(
        robot=robot, pendulum=pendulum, gain=gain, feet=dict(feet), reference=reference, regulator=regulator,
        terminal=terminal, sets=sets, timings_ms=timings,
    )  # fmt: skip


def best_of(repeats: int, compute: Callable[[], T]) -> tuple[T, float]:
    """Result of `compute` and its best wall time over `repeats` runs [ms]."""
    best = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        result = compute()
        best = min(best, time.perf_counter() - begin)
    return result, 1e3 * float(best)


def tracking_outline(walk: Walk, k: int, plane: str, kind: Kind, figure: str) -> Outline:
    """Set of phase k in a plane; a slice goes through xi_k."""
    sample = walk.sets.sample[walk.sets.start[k] : walk.sets.start[k + 1]]
    facts = {"figure": figure, "set": "tracking", "time": k * walk.reference.dt, "t_star": int(sample.max()) - k}
    return _outline(walk.sets.polytope(k), plane, kind, walk.reference.xi[k], facts)


def regulator_outline(at: MoaSet, plane: str, kind: Kind, figure: str) -> Outline:
    """A regulator's set in a plane; a slice goes through rest."""
    facts = {"figure": figure, "set": "regulator", "time": 0.0, "t_star": at.t_star}
    return _outline(at.in_world(), plane, kind, at.x_C, facts)


def _outline(polytope: Polytope, plane: str, kind: Kind, through: Array, facts: dict[str, Any]) -> Outline:
    axes = PLANES[plane]
    vertices = polytope.project(axes) if kind == "projection" else polytope.slice(axes, through).vertices()
    more = {"plane": plane, "kind": kind, "area": polygon_area(vertices), "rows": len(polytope.a)}
    return Outline(kind=kind, vertices=vertices, facts=facts | more)


@dataclass(frozen=True, kw_only=True, eq=False)
class FeetCourse:
    """Where the feet of a walk are at ticks 0..m.

    Attributes:
        position: side -> (m + 1, 3) [m].
        down: side -> (m + 1,) whether it carries weight during that tick.
    """

    position: dict[Side, Array]
    down: dict[Side, NDArray[np.bool_]]


def feet_course(reference: Reference, feet: Mapping[Side, Foot]) -> FeetCourse:
    """Feet under a `walk_reference` of parallel feet, read off its supports: double, single, double a step."""
    m = reference.m
    position = {side: np.tile([*feet[side].position, 0.0], (m + 1, 1)) for side in SIDES}
    down = {side: np.ones(m + 1, dtype=bool) for side in SIDES}
    side = _FIRST
    for phase in range(1, len(reference.supports), 3):
        ticks = np.flatnonzero(reference.support_of == phase)
        landing = _outer_foot(reference.supports[phase + 1].vertices, side, feet[side])
        start = position[side][ticks[0], :2].copy()
        progress = (ticks - ticks[0]) / len(ticks)
        # At rest when it leaves the floor and when it comes back.
        way = progress**3 * (10.0 - 15.0 * progress + 6.0 * progress**2)
        position[side][ticks, :2] = start + way[:, None] * (landing - start)
        position[side][ticks, 2] = 16.0 * SWING_HEIGHT * (progress * (1.0 - progress)) ** 2
        position[side][ticks[-1] + 1 :, :2] = landing
        down[side][ticks] = False
        side = other(side)
    return FeetCourse(position=position, down=down)


def _outer_foot(hull: Array, side: Side, foot: Foot) -> Array:
    """Position (2,) of the foot whose outer edge bounds a hull of two parallel feet."""
    outward = 1.0 if side == "left" else -1.0

    def edge(points: Array) -> Array:
        reach = outward * points[:, 1]
        return np.asarray(points[reach > reach.max() - 1e-9].mean(axis=0))

    return edge(hull) - edge(foot.vertices) + foot.position
