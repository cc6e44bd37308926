"""Who is in charge: the regulator while its MOA sets hold the state, else the stepper of the N-step set that does."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.fields import Strict
from controllers.gains import Gain
from controllers.interface import (
    BalanceCommand,
    Candidate,
    Decision,
    FootReference,
    Observation,
    Phase,
    Prediction,
    Region,
    Setting,
)
from controllers.options import DcmGain, GainOptions, Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.contact_state import EDGE, ContactState
from controllers.stepping.feedback_swing import FeedbackSwing
from controllers.stepping.recoverability import Recoverability
from controllers.stepping.regions import lift_polytope
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.stance_recovery import StanceRecovery
from controllers.stepping.step_executor import Stepper
from controllers.stepping.step_policy import Heading, Lift, StepPolicy
from controllers.stepping.swing import SwingFoot
from controllers.stepping.swing_step import SwingStep
from controllers.supervisor.momentum_state import momentum_state
from controllers.supervisor.policies import recoverability, step_policy, with_softer
from controllers.supervisor.regulator import Regulator
from controllers.supervisor.step_trigger import StepTrigger
from controllers.supervisor.zmp_bias_observer import ZmpBiasObserver
from models.arena import SIDES

Array = NDArray[np.float64]


class _Seen(NamedTuple):
    """A tick's observation, its state (4,) and the DCM (2,) of that."""

    observation: Observation
    x: Array
    dcm: Array


class Supervisor:
    """Falling avoidance: decides anew, at every tick and from the measured state, how to stay on the feet.

    Attributes:
        robot: whom it balances.
        pendulum: its model and the control period.
        options: how it steps.
        rule: decides the steps; None for a controller that never steps.
        recoverability: predicts how far inside the steps' sets the state is; None for who predicts nothing of steps.
        decisions: every choice since `reset`, with its grounds.
        regulator: the regulator of the latest double support; None before the first tick.
    """

    label, colour, marker = "supervisor", "#239023", "o"

    class Options(Strict):
        """Options of the supervisor.

        Attributes:
            gain: of the regulator.
            stepping: how it steps.
        """

        gain: GainOptions = DcmGain()
        stepping: Stepping = Stepping()

    def __init__(self, setting: Setting, options: Options) -> None:
        """Compute the sets that do not depend on where the feet stand, or find those of a former episode."""
        self.robot = setting.robot
        self.pendulum = Pendulum(setting.robot.omega, setting.dt)
        self.options = options.stepping
        self.rule: StepPolicy | None = None
        self.recoverability: Recoverability | None = None
        self._gains: tuple[Gain, ...] = (options.gain.of(self.pendulum),)
        self._swing = FeedbackSwing if getattr(setting.layer, "follows_acceleration", False) else SwingFoot
        self._learn_to_step(on_body=setting.layer is not None)
        self.reset()

    def _learn_to_step(self, *, on_body: bool) -> None:
        """Make the policy of the steps, the softer gains before a step, and the prediction."""
        self._gains = with_softer(self.robot, self.pendulum, self._gains[0], self.options)
        asked = self.robot, self.pendulum, self.options
        self.rule, self.recoverability = step_policy(*asked), recoverability(*asked, on_body=on_body)

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self.regulator: Regulator | None = None
        self._seen: _Seen | None = None
        self._gain = self._gains[0]
        self._contacts = ContactState(self.robot.sole_vertices["left"], EDGE)
        self._zmp_bias = ZmpBiasObserver(self.pendulum.dt, self.robot.scale)
        self._trigger = StepTrigger(self.pendulum.dt, self.options.early_trigger, steady=self.options.steady_trigger)
        self._stance_recovery = StanceRecovery(self.robot, self.pendulum.dt)
        rule = self.rule
        self._stepper = None if rule is None else Stepper(self.robot, self.pendulum, self.options, rule, self._swing)
        self._may_step = True
        self._slacks = (math.nan, math.nan)

    @property
    def phase(self) -> Phase:
        """Standing or stepping."""
        return Phase.STANDING if self._swing_step is None else Phase.STEPPING

    @property
    def heading(self) -> Heading:
        """Where the robot faced at the first tick, by its feet: the frame of all steps."""
        return self._contacts.heading

    @property
    def slacks(self) -> tuple[float, float]:
        """Slack of the last tick's state in the regulator's sets [m of ZMP], in the steps' [m of DCM] or NaN."""
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

    def predict(self) -> Prediction:
        """What the sets say of the last tick's state: slack in the regulator's [m of ZMP], in the steppers' [m of DCM].

        The regulator's is NaN while a foot is in the air. The steppers' is that of the steps that hold it best,
        from the step under way or from the stance; NaN while no step may follow, None if it never steps.
        """
        standing = self._slacks[0]
        if self.recoverability is None or self._stepper is None:
            return Prediction(standing=standing, stepping=None)
        assert self._seen is not None
        swing_step, dcm, feet = self._swing_step, self._seen.dcm, self._contacts.positions
        if swing_step is None:
            sides = self._stepper.sides(self._seen.observation.time)
            held = self.recoverability.standing(dcm, feet, self.heading, sides) if self._may_step else math.nan
            return Prediction(standing=standing, stepping=held)
        if swing_step.closing:
            return Prediction(standing=math.nan, stepping=math.nan)
        swing, left = swing_step.before
        held = self.recoverability.stepping(dcm, feet[swing_step.stance], swing, self.heading, swing_step.lift, left)
        return Prediction(standing=math.nan, stepping=held)

    def regions(self, x: Array) -> tuple[Region, ...]:
        """The set of the regulator's softest gain in the latest double support, and that of the best step from there.

        The latter is of its number of steps, its foot and its duration, for sets of different ones make no convex
        shape together.
        """
        if self.regulator is None:
            return ()
        centre = self.regulator.centre
        standing = Region(name="regulator", centre=centre, states=self.regulator.region(self.robot))
        if not isinstance(self.rule, SetPolicy):
            return (standing,)
        steps = lift_polytope(self.rule.lift_sets, self.best_step(x), self.regulator.feet, self.heading)
        return standing, Region(name="tracking", centre=centre, states=steps)

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
        x = momentum_state(observation, self.robot) if self.options.angular_momentum else observation.balance_state()
        seen = self._seen = _Seen(observation=observation, x=x, dcm=self.pendulum.dcm(x))
        self._trigger.see(seen.dcm)
        if self._contacts.see(observation) and self._swing_step is None:
            self._settle()
        return seen

    def _settle(self) -> None:
        """The double support is another one, and so are its sets."""
        feet, error = dict(self._contacts.feet), self.options.zmp_error
        self.regulator = Regulator.at(self.pendulum, self._gains, feet, zmp_error=error)

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
        if (plan := self._stance_recovery.plan) is not None and self._stance_recovery.ready(seen.dcm, self.heading):
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
        """Command of a step; the stance foot turns to the heading, but not in closing up: arms would swing for it."""
        zmp = self._contacts.support.nearest(swing_step.aim.zmp)
        foot = seen.observation.feet[swing_step.stance]
        stance = FootReference.standing(foot, foot.yaw if swing_step.closing else self.heading.yaw)
        feet = {swing_step.stance: stance, swing_step.lift.side: swing_step.advance(self.pendulum.dt)}
        return BalanceCommand(zmp=zmp, feet=feet)

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
