"""Steps by the N-step MOA sets: the fewest steps whose set holds the state, and among those the largest slack.

Which foot goes, and for how long, is asked of sets whose feet start at rest, as the foot does that is to be lifted: a
short step gains time, but how far it goes grows with the square of its time. If none of these holds the state, the
least violated is taken of those steps that would do if the foot needed no time to speed up. Where it lands is asked,
from its lift-off on, of the sets without that limit: a foot that flies is fast, and a foothold too far is aimed anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Candidate
from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import StepSets, step_sets
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.step_policy import Aim, Heading, Lift, natural_foothold, step_limits
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# Fewer steps than were meant are taken only if they suffice with this slack, more as soon as they do not [m of DCM].
HYSTERESIS = 0.005
# A foothold is chosen for this much slack at landing, if there is one; beyond it the natural foothold counts [m].
LANDING_SLACK = 0.015


class SetPolicy:
    """Decides by membership.

    Attributes:
        sets: the N-step sets of the robot's feet, with one of them under way.
        lift_sets: those with both on the floor.
    """

    def __init__(
        self, robot: Robot, pendulum: Pendulum, options: Stepping, gain_k: float, limits: StepLimits | None = None
    ) -> None:
        """Compute the sets, or find those of a former episode.

        Args:
            robot: whose soles.
            pendulum: model and period.
            options: how it steps.
            gain_k: DCM gain of the regulator that takes over after the last step.
            limits: where a foot may land; None for what the robot's legs reach.
        """
        limits = limits or step_limits(robot, options.max_stride)
        self.sets, self.lift_sets = (
            _sets(
                pendulum.omega,
                pendulum.dt,
                gain_k,
                tuple(map(tuple, robot.sole_vertices["left"].tolist())),
                reach,
                options.times(robot, pendulum.dt),
                options.max_steps,
                options.zmp_margin,
                options.zmp_error,
            )
            for reach in (replace(limits, swing_acceleration=math.inf), limits)
        )

    def lift(self, dcm: Array, feet: Mapping[Side, Array], heading: Heading, sides: Sequence[Side]) -> Lift:
        """See `StepPolicy.lift`."""
        found, asked = [], {}
        for side in sides:
            stance = feet[other(side)]
            point, foot = heading.local(dcm, stance), heading.local(feet[side], stance)
            for time in self.lift_sets.step_times:
                asked[side, time] = point, other(side), time, foot, time
                slacks = self.lift_sets.slacks(*asked[side, time])
                steps = _fewest(slacks, 0.0)
                found.append((steps, float(slacks[steps - 1]), side, time))
        holding = [option for option in found if option[1] >= 0.0]
        if holding:
            fewest = min(option[0] for option in holding)
            choice = [option for option in holding if option[0] == fewest]
        else:
            # A faster foot might still do: of these steps if there are any, else of all, the least violated.
            choice = [option for option in found if self.sets.slacks(*asked[option[2:]]).max() >= 0.0] or found
        steps, slack, side, time = max(choice, key=lambda option: option[1])
        candidates = tuple(Candidate(name=plan_name(s, t, n), slack=gap) for n, gap, s, t in found)
        return Lift(side=side, step_time=time, steps=steps, slack=slack, candidates=candidates)

    def aim(
        self, dcm: Array, stance: Array, swing: Array, heading: Heading, lift: Lift, ticks_left: int, steps: int
    ) -> Aim:
        """See `StepPolicy.aim`."""
        sets, side = self.sets, other(lift.side)
        point, foot = heading.local(dcm, stance), heading.local(swing, stance)
        left = ticks_left * sets.pendulum.dt
        slacks = sets.slacks(point, side, left, foot, lift.step_time)
        steps = _kept(slacks, steps)
        calm = sets.tables.usable.nearest(point)
        toward = natural_foothold(point, calm, 1.0 / float(sets.tables.decay[ticks_left]), lift.side)
        chosen = choose_foothold(
            sets, point, side, left, foot, lift.step_time, steps, toward=toward, margin=LANDING_SLACK
        )
        return Aim(
            foothold=heading.world(chosen.position, stance),
            zmp=heading.world(chosen.zmp, stance),
            steps=steps,
            slack=slacks.item(steps - 1),
        )


def plan_name(side: Side, step_time: float, steps: int) -> str:
    """A plan in words."""
    return f"{side} {step_time:g} s, {steps} step{'s' if steps > 1 else ''}"


def _fewest(slacks: Array, margin: float) -> int:
    """The least number of steps with a slack of `margin`; without any that with the largest slack."""
    for steps, slack in enumerate(slacks.tolist(), 1):
        if slack >= margin:
            return steps
    return int(slacks.argmax()) + 1


def _kept(slacks: Array, steps: int) -> int:
    """The number of steps to go on with, when `steps` were meant so far."""
    steps = min(steps, len(slacks))
    if slacks.item(steps - 1) < 0.0:
        return _fewest(slacks, 0.0)
    fewer = _fewest(slacks, HYSTERESIS)
    return fewer if fewer < steps else steps


@lru_cache(maxsize=16)
def _sets(
    omega: float,
    dt: float,
    gain_k: float,
    sole: tuple[tuple[float, float], ...],
    limits: StepLimits,
    step_times: tuple[float, ...],
    max_steps: int,
    edge: float,
    zmp_error: float,
) -> StepSets:
    return step_sets(
        Pendulum(omega, dt), gain_k, np.array(sole), limits, step_times, max_steps, edge=edge, zmp_error=zmp_error
    )
