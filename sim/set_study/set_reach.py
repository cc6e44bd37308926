"""How hard a sudden push from rest the N-step sets hold in a direction, beside Koolen's limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.limits import recoverable_delta_v
from controllers.geometry.support_polygon import Foot
from controllers.nstep.certificate import StepCertificate, certify_steps
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import StepSets
from controllers.pendulum import Pendulum
from controllers.stepping.contact_state import heading_of
from controllers.supervisor.regulator import Regulator
from models.arena import SIDES, Side
from models.robot import other

Array = NDArray[np.float64]

# A certificate is asked for this share of the speed inside the rim, and as far beyond it: rounding is far below.
_ASIDE = 1e-4


@dataclass(frozen=True, kw_only=True)
class Reach:
    """The hardest push that is held, in up to so many steps.

    Attributes:
        steps: most steps.
        delta_v: every push up to this is held [m/s].
        taken: steps that the hardest one takes; 0 if the regulator holds it.
        side: first foot of those steps.
        step_time: of those steps [s].
    """

    steps: int
    delta_v: float
    taken: int = 0
    side: Side | None = None
    step_time: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class FirstStep:
    """What the sets are asked of a first step from a stance.

    Attributes:
        side: the foot that goes.
        step_time: for how long [s].
        origin: (2,) of the stance foot [m].
        swing: (2,) the foot that goes, seen from it [m].
    """

    side: Side
    step_time: float
    origin: Array
    swing: Array


def first_steps(sets: StepSets, regulator: Regulator) -> tuple[FirstStep, ...]:
    """Every foot and duration from a stance."""
    heading, feet = heading_of(regulator.feet), regulator.feet
    found = []
    for side in SIDES:
        origin = feet[other(side)].position
        swing = heading.local(feet[side].position, origin)
        found += [FirstStep(side=side, step_time=t, origin=origin, swing=swing) for t in sets.step_times]
    return tuple(found)


def reaches(sets: StepSets, regulator: Regulator, direction: float) -> tuple[Reach, ...]:
    """Of no step, one step, ... up to those of the sets, from rest over the middle of the feet.

    Args:
        sets: N-step sets.
        regulator: of the stance.
        direction: of the push in the world [rad].
    """
    best = Reach(steps=0, delta_v=max(recoverable_delta_v(moa, direction) for moa in regulator.bank.sets))
    found, held = [best], []
    for steps in range(1, sets.max_steps + 1):
        for first in first_steps(sets, regulator):
            span = _span(sets, regulator, direction, first, steps)
            if span is not None:
                held.append((*span, steps, first))
        # No set of N steps need hold the pushes of fewer: together they must leave no gap.
        while beyond := [one for one in held if one[0] <= best.delta_v < one[1]]:
            _, most, taken, first = max(beyond, key=lambda one: one[1])
            best = Reach(steps=steps, delta_v=most, taken=taken, side=first.side, step_time=first.step_time)
        found.append(Reach(**vars(best) | {"steps": steps}))
    return tuple(found)


def certificates(
    sets: StepSets, regulator: Regulator, direction: float, reach: Reach
) -> tuple[StepCertificate, StepCertificate] | None:
    """Steps that answer a push just short of the reach, and why those steps do not answer one just beyond it.

    None if no step is taken.
    """
    for first in first_steps(sets, regulator):
        if (first.side, first.step_time) == (reach.side, reach.step_time):
            inside, outside = (
                certify(sets, regulator, _pushed(regulator, direction, share * reach.delta_v), first, reach.taken)
                for share in (1.0 - _ASIDE, 1.0 + _ASIDE)
            )
            return inside, outside
    return None


def certify(sets: StepSets, regulator: Regulator, dcm: Array, first: FirstStep, steps: int) -> StepCertificate:
    """Why a DCM (2,) in the world [m] is in the set of so many steps, or why not."""
    point = heading_of(regulator.feet).local(dcm, first.origin)
    return certify_steps(sets, point, other(first.side), first.step_time, first.swing, first.step_time, steps)


def _pushed(regulator: Regulator, direction: float, speed: float) -> Array:
    """DCM (2,) in the world after a push from rest."""
    unit = np.array([math.cos(direction), math.sin(direction)])
    return np.asarray(regulator.bank.centre + speed / regulator.bank.pendulum.omega * unit)


def _span(
    sets: StepSets, regulator: Regulator, direction: float, first: FirstStep, steps: int
) -> tuple[float, float] | None:
    """Least and largest speed that one set holds [m/s]."""
    polygon = sets.polygon(steps, other(first.side), first.step_time, first.swing, step_time=first.step_time)
    heading = heading_of(regulator.feet)
    rest, ahead = (heading.local(_pushed(regulator, direction, speed), first.origin) for speed in (0.0, 1.0))
    rate, room = polygon.S @ (ahead - rest), polygon.a - polygon.S @ rest
    with np.errstate(divide="ignore", invalid="ignore"):
        where = room / rate
    if (room[rate == 0.0] < 0.0).any():
        return None
    low, high = float(where[rate < 0.0].max(initial=-math.inf)), float(where[rate > 0.0].min(initial=math.inf))
    return (low, high) if low <= high else None


def koolen_limits(
    regulator: Regulator, limits: StepLimits, direction: float, step_times: Sequence[float], most: int
) -> tuple[float, ...]:
    """Largest velocities [m/s] that 0, 1, ... `most` steps could stop, each at least that of fewer."""
    pendulum, centre = regulator.bank.pendulum, regulator.bank.centre
    each = [
        step_limit(pendulum, regulator.feet, limits, centre, direction, min(step_times), n) for n in range(most + 1)
    ]
    return tuple(np.maximum.accumulate(each).tolist())


def step_limit(
    pendulum: Pendulum,
    feet: dict[Side, Foot],
    limits: StepLimits,
    centre: Array,
    direction: float,
    step_time: float,
    steps: int,
) -> float:
    """Largest velocity [m/s] from rest over `centre` (2,) that `steps` steps could stop: Koolen's N-step limit.

    The recursion d_N = r + (l + d_{N-1} - r) e^{-omega T} along the direction, with the longest way l that each foot
    has from the other one; where both have the same, it is Koolen's closed form (`capturability`).
    An upper bound: across the direction everything is allowed.
    """
    n = np.array([math.cos(direction), math.sin(direction)])
    shrink = math.exp(-pendulum.omega * step_time)
    reach = {side: float(((foot.vertices - foot.position) @ n).max()) for side, foot in feet.items()}
    distance = dict(reach)
    for _ in range(steps):
        following = {}
        for stance in SIDES:
            swing = other(stance)
            longest = _longest(limits, swing, feet[stance].yaw, n)
            # After a landing behind the stance foot, the stance foot still bounds the support.
            landed = max(longest + distance[swing], reach[stance])
            following[stance] = reach[stance] + (landed - reach[stance]) * shrink
        distance = following
    return pendulum.omega * max(float((feet[side].position - centre) @ n) + distance[side] for side in SIDES)


def _longest(limits: StepLimits, swing: Side, yaw: float, n: Array) -> float:
    """Longest way [m] along n from the stance foot to where the swing foot may land."""
    sideways = (limits.min_width, limits.max_width) if swing == "left" else (-limits.max_width, -limits.min_width)
    c, s = math.cos(yaw), math.sin(yaw)
    ahead, left = c * n[0] + s * n[1], c * n[1] - s * n[0]
    return limits.max_stride * abs(ahead) + max(left * side for side in sideways)
