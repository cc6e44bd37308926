"""Steps: begun, aimed anew at every tick, and landed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.interface import Observation
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.contact_state import ContactState
from controllers.stepping.stance_recovery import Restoration
from controllers.stepping.step_policy import Aim, Lift, StepPolicy
from controllers.stepping.swing import SwingFoot
from controllers.stepping.swing_step import SwingStep, touched_down
from models.arena import SIDES
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# A foot that has landed less than this ago [s] is the one the weight falls on: the other one steps next.
JUST_LANDED = 0.3


class Stepper:
    """Carries out what a rule for stepping says.

    Attributes:
        swing_step: the step under way.
        landed: the foot that landed last, None before the first.
    """

    def __init__(
        self, robot: Robot, pendulum: Pendulum, options: Stepping, rule: StepPolicy, swing: type[SwingFoot] = SwingFoot
    ) -> None:
        """Stand on both feet.

        Args:
            robot: whose feet.
            pendulum: model and period.
            options: how to step.
            rule: decides which foot goes where.
            swing: how a foot goes through the air.
        """
        self.swing_step: SwingStep | None = None
        self.landed: Side | None = None
        self._landed_at = -math.inf
        self._pendulum = pendulum
        self._scale = robot.scale
        self._slowest = max(options.times(robot, pendulum.dt))
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

    def lift_off(self, observation: Observation, dcm: Array, ahead: Array, contacts: ContactState) -> Lift:
        """Begin the best step.

        Args:
            observation: of this tick.
            dcm: (2,) now [m].
            ahead: (2,) the DCM that the step is chosen for [m].
            contacts: where the feet stand.
        """
        feet, sides = contacts.positions, self.sides(observation.time)
        lift = self._rule.lift(ahead, feet, contacts.heading, sides)
        if lift.slack < 0.0 and ahead is not dcm:
            # The push may be over before it takes the state that far: what holds it now is worth more.
            lift = self._rule.lift(dcm, feet, contacts.heading, sides)
        swing = observation.feet[lift.side].position[:2]
        ticks = round(lift.step_time / self._pendulum.dt)
        aim = self._rule.aim(dcm, feet[other(lift.side)], swing, contacts.heading, lift, ticks, lift.steps)
        self._begin(observation, contacts, lift, aim)
        return lift

    def close(self, observation: Observation, plan: Restoration, contacts: ContactState) -> None:
        """Begin a closing step."""
        lift = Lift(side=plan.side, step_time=plan.step_time, steps=1, slack=math.nan, candidates=())
        aim = Aim(foothold=plan.foothold, zmp=plan.over, steps=1, slack=math.nan)
        self._begin(observation, contacts, lift, aim, closing=True)

    def fly(self, x: Array, dcm: Array, contacts: ContactState, gain: Gain) -> str:
        """Aim anew; what changed of the plan in words, empty if nothing did.

        Args:
            x, dcm: state (4,) and its DCM (2,) [m].
            contacts: where the feet stand.
            gain: of the balance over one foot while the other closes up.
        """
        swing_step = self.swing_step
        assert swing_step is not None
        stance = contacts.feet[swing_step.stance].position
        if swing_step.closing and contacts.hull.slack(dcm) < 0.0:
            swing_step.hasten(self._slowest, self._pendulum.dt)
        elif swing_step.closing:
            aim = swing_step.aim
            over_x, over_y = stance.tolist()
            zmp = stance - gain.F @ (x - np.array([over_x, 0.0, over_y, 0.0]))
            swing_step.aim = Aim(foothold=aim.foothold, zmp=zmp, steps=aim.steps, slack=aim.slack)
            return ""
        # The first aim of a step is of this tick already, and a foot that is late only comes down.
        if swing_step.left in (0, swing_step.ticks):
            return ""
        before, swing = swing_step.aim, swing_step.foot.position[:2]
        aim = self._rule.aim(dcm, stance, swing, contacts.heading, swing_step.lift, swing_step.left, before.steps)
        swing_step.aim = aim if self._options.replan else replace(aim, foothold=before.foothold)
        if aim.steps == before.steps and (aim.slack < 0.0) == (before.slack < 0.0):
            return ""
        return "no set holds the state" if aim.slack < 0.0 else f"the set of {aim.steps} steps holds the state"

    def see(self, observation: Observation) -> None:
        """Take notice of where the foot in the air is."""
        if self.swing_step is not None:
            self.swing_step.foot.see(observation.feet[self.swing_step.lift.side].position)

    def land(self, observation: Observation) -> bool:
        """Whether the foot in the air has landed, which ends the step."""
        swing_step = self.swing_step
        if swing_step is None or not touched_down(
            observation.feet[swing_step.lift.side].force / self._scale.force, swing_step.left, swing_step.ticks
        ):
            return False
        self.swing_step, self.landed, self._landed_at = None, swing_step.lift.side, observation.time
        return True

    def _begin(
        self, observation: Observation, contacts: ContactState, lift: Lift, aim: Aim, *, closing: bool = False
    ) -> None:
        dt, start = self._pendulum.dt, observation.feet[lift.side].position
        height, speed = self._options.swing_height, self._scale.speed
        foot = self._swing(start, contacts.heading.yaw, lift.step_time, height, dt, speed)
        ticks = round(lift.step_time / dt)
        self.swing_step = SwingStep(lift=lift, aim=aim, foot=foot, ticks=ticks, left=ticks, closing=closing)
        contacts.lift(lift.side)
