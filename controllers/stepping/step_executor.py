"""Steps: begun, aimed anew at every tick, and landed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.interface import Observation
from controllers.pendulum import Pendulum
from controllers.stepping.contact_state import Footing
from controllers.stepping.stance_recovery import Restoration
from controllers.stepping.step_policy import Aim, Lift, SteppingOptions, StepRule
from controllers.stepping.swing import SwingFoot
from controllers.stepping.swing_step import Flight, touched_down
from models.arena import SIDES
from models.robot import Side, other

Array = NDArray[np.float64]

# A foot that has landed less than this ago [s] is the one the weight falls on: the other one steps next.
JUST_LANDED = 0.3


class Stepper:
    """Carries out what a rule for stepping says.

    Attributes:
        flight: the step under way.
        landed: the foot that landed last, None before the first.
    """

    def __init__(
        self, pendulum: Pendulum, options: SteppingOptions, rule: StepRule, swing: type[SwingFoot] = SwingFoot
    ) -> None:
        """Stand on both feet.

        Args:
            pendulum: model and period.
            options: how to step.
            rule: decides which foot goes where.
            swing: how a foot goes through the air.
        """
        self.flight: Flight | None = None
        self.landed: Side | None = None
        self._landed_at = -math.inf
        self._pendulum = pendulum
        self._options = options
        self._rule = rule
        self._swing = swing

    def since_landing(self, time: float) -> float:
        """How long ago a foot landed [s]; infinite before the first."""
        return time - self._landed_at

    def sides(self, time: float) -> Sequence[Side]:
        """The feet that may step next."""
        if self.landed is not None and self.since_landing(time) < JUST_LANDED:
            return (other(self.landed),)
        return SIDES

    def lift_off(self, observation: Observation, dcm: Array, ahead: Array, footing: Footing) -> Lift:
        """Begin the best step.

        Args:
            observation: of this tick.
            dcm: (2,) now [m].
            ahead: (2,) the DCM that the step is chosen for [m].
            footing: where the feet stand.
        """
        feet, sides = footing.positions, self.sides(observation.time)
        lift = self._rule.lift(ahead, feet, footing.heading, sides)
        if lift.slack < 0.0 and ahead is not dcm:
            # The push may be over before it takes the state that far: what holds it now is worth more.
            lift = self._rule.lift(dcm, feet, footing.heading, sides)
        swing = observation.feet[lift.side].position[:2]
        ticks = round(lift.step_time / self._pendulum.dt)
        aim = self._rule.aim(dcm, feet[other(lift.side)], swing, footing.heading, lift, ticks, lift.steps)
        self._begin(observation, footing, lift, aim)
        return lift

    def close(self, observation: Observation, plan: Restoration, footing: Footing) -> None:
        """Begin a closing step."""
        lift = Lift(side=plan.side, step_time=plan.step_time, steps=1, slack=math.nan, candidates=())
        aim = Aim(foothold=plan.foothold, zmp=plan.over, steps=1, slack=math.nan)
        self._begin(observation, footing, lift, aim, closing=True)

    def fly(self, x: Array, dcm: Array, footing: Footing, gain: Gain) -> str:
        """Aim anew; what changed of the plan in words, empty if nothing did.

        Args:
            x, dcm: state (4,) and its DCM (2,) [m].
            footing: where the feet stand.
            gain: of the balance over one foot while the other closes up.
        """
        flight = self.flight
        assert flight is not None
        stance = footing.feet[flight.stance].position
        if flight.closing and footing.hull.slack(dcm) < 0.0:
            flight.hasten(max(self._options.step_times), self._pendulum.dt)
        elif flight.closing:
            flight.aim = replace(flight.aim, zmp=stance - gain.F @ (x - self._pendulum.rest(stance)))
            return ""
        # The first aim of a step is of this tick already, and a foot that is late only comes down.
        if flight.left in (0, flight.ticks):
            return ""
        before, swing = flight.aim, flight.foot.position[:2]
        aim = self._rule.aim(dcm, stance, swing, footing.heading, flight.lift, flight.left, before.steps)
        flight.aim = aim if self._options.replan else replace(aim, foothold=before.foothold)
        if aim.steps == before.steps and (aim.slack < 0.0) == (before.slack < 0.0):
            return ""
        return "no set holds the state" if aim.slack < 0.0 else f"the set of {aim.steps} steps holds the state"

    def see(self, observation: Observation) -> None:
        """Take notice of where the foot in the air is."""
        if self.flight is not None:
            self.flight.foot.see(observation.feet[self.flight.lift.side].position)

    def land(self, observation: Observation) -> bool:
        """Whether the foot in the air has landed, which ends the step."""
        flight = self.flight
        if flight is None or not touched_down(observation.feet[flight.lift.side].force, flight.left, flight.ticks):
            return False
        self.flight, self.landed, self._landed_at = None, flight.lift.side, observation.time
        return True

    def _begin(
        self, observation: Observation, footing: Footing, lift: Lift, aim: Aim, *, closing: bool = False
    ) -> None:
        dt, start = self._pendulum.dt, observation.feet[lift.side].position
        foot = self._swing(start, footing.heading.yaw, lift.step_time, self._options.swing_height, dt)
        ticks = round(lift.step_time / dt)
        self.flight = Flight(lift=lift, aim=aim, foot=foot, ticks=ticks, left=ticks, closing=closing)
        footing.lift(lift.side)
