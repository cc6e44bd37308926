"""Why a state is in an N-step set, or not: footholds and ZMPs to check by simulation, or a line beyond which it lies.

The checks share nothing with the tables: a witness is run tick by tick and held to the soles, the reach of the feet
and the regulator on their hull; a line is drawn again from the extreme ZMPs and footholds in its direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.nstep.box import Box, box_of, flat, within
from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_kernel import corners_of
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import StepSets
from models.errors import InputError
from models.robot import Side, other

# The arguments of `StepSets.foothold` that are not wishes.
Asked = tuple[np.ndarray, Side, float, np.ndarray | None, float, int]
# What rounding and the solver may break [m]; far below what a margin of the ZMP is made for.
TOLERANCE = 1e-7


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Witness:
    """N steps that recover, seen from the first stance foot [m].

    Attributes:
        footholds: (N, 2).
        zmp: (N, 2) held during each step.
        landing_dcm: (N, 2) at each landing.
        slacks: (N,) of each landing in the set of the steps that are left then [m].
    """

    footholds: np.ndarray
    zmp: np.ndarray
    landing_dcm: np.ndarray
    slacks: np.ndarray


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Separation:
    """A line that no state of the set is beyond, whatever the footholds and ZMPs.

    Attributes:
        normal: (2,) unit.
        bound: the most that normal . xi is in the set [m].
    """

    normal: np.ndarray
    bound: float


class Question(NamedTuple):
    """A state and a number of steps, as for `StepSets.foothold`."""

    dcm: np.ndarray
    stance: Side
    time_left: float
    swing: np.ndarray | None
    step_time: float
    steps: int


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepCertificate:
    """Whether a state is in the set of exactly N steps, and why.

    Attributes:
        question: what was asked.
        slack: of the state in the set [m].
        reason: the steps, or the line.
    """

    question: Question
    slack: float
    reason: Witness | Separation

    @property
    def member(self) -> bool:
        """Whether it says that the state is in the set."""
        return isinstance(self.reason, Witness)

    def violation(self, sets: StepSets) -> float:
        """Distance [m] by which the reason breaks what it promises, checked on its own; 0 or less if it holds."""
        if isinstance(self.reason, Witness):
            return _broken(self.question, self.reason, sets)
        normal = self.reason.normal
        bound = _bound(sets, self.question, normal)
        if not abs(float(np.hypot(*normal)) - 1.0) <= TOLERANCE:
            return math.inf
        return max(bound - self.reason.bound, self.reason.bound - float(normal @ self.question.dcm))

    def holds(self, sets: StepSets) -> bool:
        """Whether `violation` is rounding."""
        return self.violation(sets) <= TOLERANCE

    def render(self) -> str:
        """The certificate as lines of plain text."""
        (x, y), steps = 1e3 * self.question.dcm, self.question.steps
        stance, time_left = self.question.stance, self.question.time_left
        head = f"DCM ({x:.1f}, {y:.1f}) mm on the {stance} foot, {time_left:g} s before landing: "
        if isinstance(self.reason, Separation):
            nx, ny = self.reason.normal
            return head + (
                f"lost in {steps} step(s)\n  {-1e3 * self.slack:.2f} mm beyond {nx:+.3f} x {ny:+.3f} y = "
                f"{1e3 * self.reason.bound:.1f} mm, which no footholds and ZMPs reach"
            )
        lines = [head + f"recovers in {steps} step(s), slack {1e3 * self.slack:.2f} mm"]
        reason = self.reason
        rows = zip(1e3 * reason.footholds, 1e3 * reason.zmp, 1e3 * reason.landing_dcm, 1e3 * reason.slacks, strict=True)
        for i, (foot, zmp, landing, slack) in enumerate(rows, 1):
            lines.append(
                f"  step {i}: foot ({foot[0]:.1f}, {foot[1]:.1f}), ZMP ({zmp[0]:.1f}, {zmp[1]:.1f}), "
                f"DCM at landing ({landing[0]:.1f}, {landing[1]:.1f}), slack {slack:.2f} mm"
            )
        return "\n".join(lines)


def certify_steps(sets: StepSets, *asked: *Asked, margin: float = 0.0) -> StepCertificate:
    """Find out why a state is in the set of exactly so many steps, or why not.

    Args:
        sets: the sets; with errors of the ZMP the witness is that of no error.
        asked: dcm, stance, time_left, swing, step_time, steps: the arguments of `choose_foothold`.
        margin: slack [m] that the steps of a witness look for.

    Raises:
        InputError: an argument is none of the sets'.
    """
    question = Question(np.array(asked[0], dtype=float), *asked[1:])
    point, stance, time_left, swing, step_time, steps = question
    sets.require_steps(steps)
    if not np.isfinite(point).all():
        raise InputError(f"dcm: must be finite, got {point.tolist()!r}")
    slack = float(sets.slacks(point, stance, time_left, swing, step_time)[steps - 1])
    reason: Witness | Separation
    if slack >= 0.0:
        reason = _witness(sets, question, margin)
    else:
        polygon = sets.polygon(steps, stance, time_left, swing, step_time=step_time)
        row = int(np.argmin(polygon.a - polygon.S @ point))
        reason = Separation(normal=polygon.S[row], bound=float(polygon.a[row]))
    return StepCertificate(question=question, slack=slack, reason=reason)


def _witness(sets: StepSets, question: Question, margin: float) -> Witness:
    place = np.zeros(2)
    found = []
    for left in range(question.steps, 0, -1):
        outward = sets.limits.stance_width if question.stance == "right" else -sets.limits.stance_width
        step = choose_foothold(sets, *question, toward=np.array([0.0, outward]), margin=margin, held=True)
        found.append((place + step.position, place + step.zmp, place + step.landing_dcm, step.slack))
        place = place + step.position
        question = Question(
            dcm=step.landing_dcm - step.position, stance=other(question.stance), time_left=question.step_time,
            swing=-step.position, step_time=question.step_time, steps=left - 1,
        )  # fmt: skip
    footholds, zmp, landings, slacks = (np.array(column) for column in zip(*found, strict=True))
    return Witness(footholds=footholds, zmp=zmp, landing_dcm=landings, slacks=slacks)


def _broken(question: Question, witness: Witness, sets: StepSets) -> float:
    pendulum, sole, limits = sets.pendulum, sets.sole, sets.limits
    if not len(witness.footholds) == len(witness.zmp) == len(witness.landing_dcm) == question.steps:
        return math.inf
    # A state of the whole pendulum with this DCM: at rest over the stance foot but for the velocity that it takes.
    x = np.zeros(4)
    x[1::2] = pendulum.omega * question.dcm
    place, stance, swing, ticks = np.zeros(2), question.stance, question.swing, sets.tick(question.time_left)
    worst, step = -math.inf, np.zeros(2)
    for foothold, zmp, landing in zip(witness.footholds, witness.zmp, witness.landing_dcm, strict=True):
        worst = max(worst, -sole.slack(zmp - place))
        for _ in range(ticks):
            x = pendulum.step(x, zmp)
        worst = max(worst, float(np.abs(pendulum.dcm(x) - landing).max()))
        reach = _rectangle(limits, stance)
        if swing is not None:
            reach = within(reach, float(swing[0]), float(swing[1]), limits.swing_reach(pendulum.dt * ticks))
        step = foothold - place
        worst = max(worst, float(np.max(reach[0] - step)), float(np.max(step - reach[1])))
        place, swing, stance, ticks = foothold, -step, other(stance), round(question.step_time / pendulum.dt)
    feet = [Foot(position=at, yaw=0.0, sole=sole.vertices) for at in (place, place - step)]
    middle = place - 0.5 * step
    u = middle + sets.gain_k * (pendulum.dcm(x) - middle)
    return max(worst, -support_polygon(feet).slack(u))


def _rectangle(limits: StepLimits, stance: Side) -> Box:
    return box_of(stance, limits.max_stride, limits.min_width, limits.max_width)


def _bound(sets: StepSets, question: Question, normal: np.ndarray) -> float:
    """Most that normal . xi can be, by the extreme ZMPs and footholds of every step in this direction."""
    ticks, times = sets.tick(question.time_left), round(question.step_time / sets.pendulum.dt)
    last, more = sets.boxes(question.stance, ticks, question.swing, question.step_time)
    boxes, stance = [last if question.steps == 1 else more], question.stance
    for _ in range(question.steps - 1):
        stance = other(stance)
        boxes.append(sets.table(stance, question.step_time).box)
    spans = [ticks] + [times] * (question.steps - 1)
    ends = 0.5 - 0.5 / sets.gain_k, 0.5 + 0.5 / sets.gain_k
    shapes = [corners_of(flat(box)) for box in boxes]
    shapes[-1] = np.vstack([share * shapes[-1] for share in ends])
    if sets.error.w_bar:
        return _robust_bound(sets, shapes, spans, normal)
    sole = float((sets.tables.usable.vertices @ normal).max())
    most = sole / sets.gain_k
    for shape, span in zip(reversed(shapes), reversed(spans), strict=True):
        decay = math.exp(-sets.pendulum.omega * sets.pendulum.dt * span)
        # Seen from the stance foot before.
        most = decay * (float((shape @ normal).max()) + most) + (1.0 - decay) * sole
    return most


def _robust_bound(sets: StepSets, shapes: list[np.ndarray], spans: list[int], normal: np.ndarray) -> float:
    """The same whatever the errors of the ZMP: the sets themselves, tick by tick, by their vertices.

    An error takes an erosion from a set, and the support function of that is no difference of support functions.
    """
    growth, usable = math.exp(sets.pendulum.omega * sets.pendulum.dt), sets.tables.usable.vertices
    corner = (growth - 1.0) * np.array(sets.error.half_widths)
    target = usable / sets.gain_k
    for shape, span in zip(reversed(shapes), reversed(spans), strict=True):
        for _ in range(span):
            target = _sum(_eroded(target, corner), (growth - 1.0) * usable) / growth
        target = _sum(target, growth**-span * shape)
    return float((target @ normal).max())


def _eroded(points: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Vertices of what all translates of a convex polygon by the corners of a box share.

    Raises:
        EmptyPolytopeError: if they share nothing.
    """
    polygon = SupportPolygon(points[ConvexHull(points).vertices])
    return Polytope(S=polygon.M, a=polygon.v - np.abs(polygon.M) @ corner).vertices()


def _sum(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Vertices of the Minkowski sum of two convex polygons."""
    points = (one[:, None] + two[None]).reshape(-1, 2)
    return np.asarray(points[ConvexHull(points).vertices])
