"""The walk of Section IV-C as the set figures need it: the reference, its sets, and where the feet are at each tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.tracking_sets import TrackingSets, tracking_sets
from controllers.baselines.paper import FIRST, STEP_TIME, STRIDE
from controllers.gains import Gain, lqr
from controllers.geometry.polytope import Polytope, polygon_area
from controllers.geometry.support_polygon import Foot, standing_feet, support_polygon
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference
from controllers.reference.walking_reference import Stride, walk_plan
from models.arena import SIDES, Side
from models.robot import Robot

Array = NDArray[np.float64]
Kind = Literal["projection", "slice"]
T = TypeVar("T")

# Section IV-C: period and number of steps; the weights of the LQR are Q = I, R = 1.
DT, STEPS = 0.005, 4
PLANES: dict[str, tuple[int, int]] = {"x-xdot": (0, 1), "y-ydot": (2, 3)}
SWING_HEIGHT = 0.03
_REPEATS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk:
    """A stepping reference from rest with everything that is computed on it.

    Attributes:
        robot, pendulum, gain, feet: whose walk it is, and where the feet stand at first.
        reference: xi, mu and supports (26).
        strides: where and when the feet land.
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
    strides: tuple[Stride, ...]
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


def plan_walk(robot: Robot, *, steps: int = STEPS) -> Walk:
    """Plan the walk of Section IV-C from the robot's stand, and compute its sets."""
    pendulum = Pendulum(robot.omega, DT)
    gain = lqr(pendulum, (1.0, 1.0), 1.0)
    feet = standing_feet(robot)
    middle = 0.5 * (feet["left"].position + feet["right"].position)
    stance = support_polygon([feet["left"], feet["right"]])
    timings: dict[str, float] = {}

    def timed(name: str, compute: Callable[[], T]) -> T:
        result, timings[name] = best_of(_REPEATS, compute)
        return result

    regulator = timed("regulator_set", lambda: regulator_set(pendulum, gain, stance, middle))
    plan = timed("reference", lambda: walk_plan(pendulum, feet, STRIDE, steps, STEP_TIME, first=FIRST))
    reference = plan.reference
    terminal = regulator_set(pendulum, gain, reference.final, centre=reference.xi[-1, 0::2])
    sets = timed("tracking_sets", lambda: tracking_sets(pendulum, gain, reference, terminal))
    return Walk(
        robot=robot, pendulum=pendulum, gain=gain, feet=feet, reference=reference, strides=plan.strides,
        regulator=regulator, terminal=terminal, sets=sets, timings_ms=timings,
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


def feet_course(walk: Walk) -> FeetCourse:
    """The feet of a walk in the air and on the floor."""
    m = walk.reference.m
    position = {side: np.tile([*walk.feet[side].position, 0.0], (m + 1, 1)) for side in SIDES}
    down = {side: np.ones(m + 1, dtype=bool) for side in SIDES}
    for stride in walk.strides:
        ticks, path = np.arange(stride.lift, stride.landing), position[stride.side]
        start, landing = path[stride.lift, :2].copy(), stride.foothold.position
        progress = (ticks - stride.lift) / len(ticks)
        # At rest when it leaves the floor and when it comes back.
        way = progress**3 * (10.0 - 15.0 * progress + 6.0 * progress**2)
        path[ticks, :2] = start + way[:, None] * (landing - start)
        path[ticks, 2] = 16.0 * SWING_HEIGHT * (progress * (1.0 - progress)) ** 2
        path[stride.landing :, :2] = landing
        down[stride.side][ticks] = False
    return FeetCourse(position=position, down=down)
