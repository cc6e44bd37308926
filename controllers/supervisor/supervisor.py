"""Who is in charge: the regulator while its MOA sets hold the state, else the stepper of the N-step set that does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.interface import BalanceCommand, Candidate, Decision, FootReference, Observation, Phase
from controllers.pendulum import Pendulum
from controllers.stepping.contact_state import EDGE, ContactState
from controllers.stepping.recoverability import Recoverability
from controllers.stepping.stance_recovery import StanceRecovery
from controllers.stepping.step_executor import Stepper
from controllers.stepping.step_policy import Heading, Lift, SteppingOptions, StepPolicy
from controllers.stepping.swing import SwingFoot
from controllers.stepping.swing_step import SwingStep
from controllers.supervisor.regulator import Regulator
from controllers.supervisor.step_trigger import StepTrigger
from controllers.supervisor.zmp_bias_observer import ZmpBiasObserver
from models.arena import SIDES
from models.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """A tick's observation, its state (4,) and the DCM (2,) of that."""

    observation: Observation
    x: Array
    dcm: Array


class Supervisor:
    """Falling avoidance: decides anew, at every tick and from the measured state, how to stay on the feet.

    With `rule=None` it is the null controller `regulator`: the same law, limited to the support polygon, and
    nothing else.

    Attributes:
        robot: whom it balances.
        pendulum: its model and the control period.
        options: how it steps.
        rule: decides the steps.
        recoverability: predicts whether they will do.
        decisions: every choice since `reset`, with its grounds.
        regulator: the regulator of the latest double support; None before the first tick.
        steps: steps begun since `reset`.
    """

    def __init__(
        self,
        robot: Robot,
        pendulum: Pendulum,
        gains: Sequence[Gain],
        options: SteppingOptions,
        rule: StepPolicy | None,
        recoverability: Recoverability | None = None,
        swing: type[SwingFoot] = SwingFoot,
    ) -> None:
        """Prepare.

        Args:
            robot: whom it balances.
            pendulum: its model and the control period.
            gains: the regulator's gain, then those to fall back on before a step.
            options: how it steps.
            rule: decides the steps; None never to step.
            recoverability: predicts whether the steps will do; None for a controller that predicts nothing.
            swing: how a foot goes through the air.
        """
        self.robot = robot
        self.options = options
        self.rule = rule
        self.recoverability = recoverability
        self._swing = swing
        self.pendulum = pendulum
        self._gains = tuple(gains)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self.regulator: Regulator | None = None
        self.steps = 0
        self._seen: _Seen | None = None
        self._gain = self._gains[0]
        self._contacts = ContactState(self.robot.sole_vertices["left"], EDGE)
        self._zmp_bias = ZmpBiasObserver(self.pendulum.dt)
        self._trigger = StepTrigger(self.pendulum.dt, self.options.early_trigger)
        self._stance_recovery = StanceRecovery(self.robot, self.pendulum.dt)
        rule = self.rule
        self._stepper = None if rule is None else Stepper(self.pendulum, self.options, rule, self._swing)
        self._may_step = True
        self._slacks = (math.nan, math.nan)

    @property
    def phase(self) -> Phase:
        """Who is in charge."""
        return Phase.STANDING if self._swing_step is None else Phase.STEPPING

    @property
    def heading(self) -> Heading:
        """Where the robot faced at the first tick, by its feet: the frame of all steps."""
        return self._contacts.heading

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state, after its decision: in the regulator's sets of the latest double
        support [m of ZMP], and in the set of the steps to do [m of DCM] (NaN while the regulator is in charge)."""
        return self._slacks

    def command(self, observation: Observation) -> BalanceCommand:
        """Decide, then command: one control tick."""
        seen = self._see(observation)
        if self._stepper is not None:
            self._stepper.see(observation)
            if self._stepper.land(observation):
                self._land(seen, self._stepper)
        slack = self._law.slack(seen.x)
        if self._swing_step is None:
            self._stand(seen, slack)
        else:
            self._fly(seen)
        swing_step = self._swing_step
        self._slacks = (slack, math.nan if swing_step is None else swing_step.aim.slack)
        return self._standing(seen) if swing_step is None else self._stepping(seen, swing_step)

    def state(self, observation: Observation) -> Array:
        """State (4,) that the sets are asked for.

        A push above the COG makes the body spin, and stopping the spin pushes the COG on: what counts is the momentum
        about the feet, m h v plus that about the COG. With `angular_momentum` the velocity is that momentum / (m h).
        """
        x = observation.balance_state()
        if self.options.angular_momentum:
            about_x, about_y, _ = observation.angular_momentum.tolist()
            lever = self.robot.mass * self.robot.cog_height
            x[1] += about_y / lever
            x[3] -= about_x / lever
        return x

    def predict(self) -> tuple[float, float]:
        """What the sets say of the last tick's state: slack in the regulator's [m of ZMP], in the steppers' [m of DCM].

        The regulator's is NaN while a foot is in the air. The steppers' is that of the steps that are promised to do,
        from the step under way or from the stance; NaN without a recoverability, or while no step may follow.
        """
        if self.recoverability is None or self._seen is None or self._stepper is None:
            return self._slacks[0], math.nan
        swing_step, dcm, feet = self._swing_step, self._seen.dcm, self._contacts.positions
        if swing_step is None:
            sides = self._stepper.sides(self._seen.observation.time)
            promised = self.recoverability.standing(dcm, feet, self.heading, sides) if self._may_step else math.nan
            return self._slacks[0], promised
        if swing_step.closing:
            return math.nan, math.nan
        swing, left = swing_step.before
        return math.nan, self.recoverability.stepping(
            dcm, feet[swing_step.stance], swing, self.heading, swing_step.lift, left
        )

    def best_step(self, x: Array) -> Lift:
        """The step that would be taken from the latest stance in a state (4,); changes nothing."""
        assert self.rule is not None
        return self.rule.lift(self.pendulum.dcm(x), self._contacts.positions, self.heading, SIDES)

    @property
    def _law(self) -> Regulator:
        assert self.regulator is not None, "there is one from the first tick on"
        return self.regulator

    @property
    def _swing_step(self) -> SwingStep | None:
        return None if self._stepper is None else self._stepper.swing_step

    def _see(self, observation: Observation) -> _Seen:
        """Take in the state, and where the feet are."""
        x = self.state(observation)
        seen = self._seen = _Seen(observation=observation, x=x, dcm=self.pendulum.dcm(x))
        self._trigger.see(seen.dcm)
        if self._contacts.see(observation) and self._swing_step is None:
            self._settle()
        return seen

    def _settle(self) -> None:
        """The double support is another one, and so are its sets."""
        self.regulator = Regulator.at(self.pendulum, self._gains, dict(self._contacts.feet))

    def _stand(self, seen: _Seen, slack: float) -> None:
        """Stay with the regulator, in whose sets the state has this slack, or begin a step."""
        if not self.decisions:
            self._note(seen, "start")
        self._may_step |= slack >= 0.0
        if self._stepper is not None and self._may_step:
            ahead = self._trigger.ahead(seen.dcm, self._stepper.since_landing(seen.observation.time))
            if why := self._trigger.reason(self._law, seen.x, slack, ahead - seen.dcm):
                self._stance_recovery.renew()
                self._lift_off(seen, self._stepper, ahead, why)
                return
            if self._restore(seen, self._stepper):
                return
        gain = self._law.choose(seen.x, self._gain)
        if gain is not self._gain:
            self._gain = gain
            self._note(seen, f"the stiffest gain whose set holds the state is {gain.name}")

    def _restore(self, seen: _Seen, stepper: Stepper) -> bool:
        """Bring the feet together once it is quiet; True when the closing step begins."""
        if stepper.landed is None:
            return False
        plan = self._stance_recovery.plan
        if plan is not None and self._stance_recovery.ready(seen.dcm, self.heading):
            stepper.close(seen.observation, plan, self._contacts)
            self._begun()
            self._note(seen, f"the {plan.side} foot closes up")
            return True
        if why := self._stance_recovery.watch(seen.observation.time, seen.dcm, self._contacts, stepper.landed):
            self._note(seen, why)
        return False

    def _lift_off(self, seen: _Seen, stepper: Stepper, ahead: Array, why: str) -> None:
        """Begin the step that is best for a DCM (2,)."""
        lift = stepper.lift_off(seen.observation, seen.dcm, ahead, self._contacts)
        self._begun()
        self._note(seen, why, candidates=lift.candidates)

    def _begun(self) -> None:
        """What was learned of the stance is of no use once a foot has left it."""
        self.steps += 1
        self._stance_recovery.interrupt()
        self._zmp_bias.forget()

    def _fly(self, seen: _Seen) -> None:
        assert self._stepper is not None
        if news := self._stepper.fly(seen.x, seen.dcm, self._contacts, self._gain):
            self._note(seen, f"in the air: {news}")

    def _land(self, seen: _Seen, stepper: Stepper) -> None:
        """Stand on both feet where they are now, or go on stepping."""
        self._contacts.land()
        self._contacts.forget()
        self._contacts.see(seen.observation)
        self._settle()
        why, many = f"the {stepper.landed} foot landed", self.options.max_steps > 1
        if many and self._law.slack(seen.x) < 0.0:
            self._lift_off(seen, stepper, seen.dcm, why)
        else:
            self._may_step = many
            self._gain = self._law.choose(seen.x, None)
            self._note(seen, why)

    def _standing(self, seen: _Seen) -> BalanceCommand:
        """Command of the regulator, about the middle of the feet or on the way over the foot that stays."""
        observation, plan = seen.observation, self._stance_recovery.plan
        self._zmp_bias.see(observation.zmp, self._trigger.rate)
        centre = None if plan is None else plan.centre(observation.time)
        zmp = self._zmp_bias.made_up(self._law.zmp(seen.x, self._gain, centre), self._contacts.support)
        # Feet that are turned against each other only strain the legs when they are both pressed to the heading.
        feet = {side: FootReference.standing(observation.feet[side], observation.feet[side].yaw) for side in SIDES}
        return BalanceCommand(zmp=zmp, feet=feet)

    def _stepping(self, seen: _Seen, swing_step: SwingStep) -> BalanceCommand:
        """Command of the step under way; the foot on the floor alone can be turned back to the heading."""
        zmp = self._contacts.support.nearest(swing_step.aim.zmp)
        stance = FootReference.standing(seen.observation.feet[swing_step.stance], self.heading.yaw)
        swing = swing_step.advance(self.pendulum.dt)
        return BalanceCommand(zmp=zmp, feet={swing_step.stance: stance, swing_step.lift.side: swing})

    def _note(self, seen: _Seen, why: str, *, candidates: tuple[Candidate, ...] = ()) -> None:
        swing_step = self._swing_step
        self.decisions.append(
            Decision(
                time=seen.observation.time,
                phase=self.phase,
                reason=why,
                regulator_slack=self._law.slack(seen.x),
                tracking_slack=math.nan if swing_step is None else swing_step.aim.slack,
                candidates=candidates,
                plan="" if swing_step is None else swing_step.plan,
                tight=self._law.explain(seen.x),
            )
        )
