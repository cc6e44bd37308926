"""Who is in charge: the regulator while its MOA sets hold the state, else the stepper of the N-step set that does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.pendulum import Pendulum
from controllers.regulator import Regulator
from controllers.restoration import ATTEMPTS, GIVE_UP, QUIET, QUIET_FOR, Restoration, closing_step
from controllers.signals import BalanceCommand, Candidate, Controller, Decision, FootReference, FootState, Observation
from controllers.step_rule_sets import SetRule
from controllers.step_rules import Aim, Heading, Lift, SteppingOptions, StepRule
from controllers.support import Foot, SupportPolygon, support_polygon
from controllers.swing import SwingFoot
from models.arena import SIDES
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# The commanded ZMP stays this far inside the support, so that a foot does not tip over its edge [m].
EDGE = 0.003
# A foot that has moved this far is somewhere else, and the stance's sets are computed anew [m].
MOVED = 0.002
# A swing foot has landed when it carries this [N], but not in the first half of its step, when it may still scrape.
TOUCHDOWN_FORCE = 4.0
EARLIEST_TOUCHDOWN = 0.5
# A foot that has landed less than this ago [s] is the one the weight falls on: the other one steps next.
JUST_LANDED = 0.3
# So long after a landing [s] the rate of the DCM is that of the impact and tells nothing of where it is going.
SETTLING = 1.0
# The ZMP of a standing body stays off its command by what friction and strain between the legs hold back. That error is
# seen while the DCM is slower than this [m/s], smoothed over this time [s], and made up for as far as this [m].
CALM, ZMP_ERROR_TIME, ZMP_ERROR_MOST = 0.1, 0.1, 0.02
# A state that is only extrapolated to leave the regulator's set must be this far outside [m of ZMP]: a weaker push is
# over before it gets there.
SURE = 0.04
# Share by which the rate of the DCM follows its differences at each tick.
RATE_FILTER = 0.3

_STILL = np.zeros(3)
_STILL.setflags(write=False)


@dataclass
class _Step:
    """The step under way."""

    lift: Lift
    foot: SwingFoot
    ticks: int
    left: int
    aim: Aim
    closing: bool = False


class Supervisor:
    """Falling avoidance: decides anew, at every tick and from the measured state, how to stay on the feet.

    With `rule=None` it is the null controller `regulator`: the same law, limited to the support polygon, and
    nothing else.

    Attributes:
        robot: whom it balances.
        options: how it steps.
        rule: decides the steps.
        decisions: every choice since `reset`, with its grounds.
        regulator: the regulator of the latest double support.
        steps: steps begun since `reset`.
    """

    def __init__(
        self,
        robot: Robot,
        pendulum: Pendulum,
        gains: Sequence[Gain],
        options: SteppingOptions,
        rule: StepRule | None,
        promise: SetRule | None = None,
    ) -> None:
        """Prepare.

        Args:
            robot: whom it balances.
            pendulum: its model and the control period.
            gains: the regulator's gain, then those to fall back on before a step.
            options: how it steps.
            rule: decides the steps; None never to step.
            promise: the sets that foretell whether the steps will do; None for a controller that promises nothing. They
                are smaller than the rule's, which asks of the feet all that they might reach.
        """
        self.robot = robot
        self.options = options
        self.rule = rule
        self._promise = promise
        self.pendulum = pendulum
        self._gains = tuple(gains)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self.regulator: Regulator | None = None
        self.steps = 0
        self._step: _Step | None = None
        self._gain: Gain = self._gains[0]
        self._heading: Heading | None = None
        self._feet: dict[Side, Foot] = {}
        self._places: dict[Side, tuple[float, float]] = {}
        self._landed: Side | None = None
        self._landed_at = -math.inf
        self._may_step = True
        self._dcm: Array | None = None
        self._rate = np.zeros(2)
        self._x = np.zeros(4)
        self._commanded: Array | None = None
        self._zmp_error = np.zeros(2)
        self._quiet_since: float | None = None
        self._restoration: Restoration | None = None
        self._restored = 0
        self._slacks = (math.nan, math.nan)
        self._inner: SupportPolygon | None = None

    @property
    def controller(self) -> Controller:
        """Who is in charge."""
        return Controller.REGULATOR if self._step is None else Controller.TRACKER

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state, after its decision: in the regulator's sets of the latest double
        support [m of ZMP], and in the set of the steps to do [m of DCM] (NaN while the regulator is in charge)."""
        return self._slacks

    def command(self, observation: Observation) -> BalanceCommand:
        """Decide, then command: one control tick."""
        x = self._x = self.state(observation)
        dcm = self.pendulum.dcm(x)
        if self._dcm is not None:
            self._rate += RATE_FILTER * ((dcm - self._dcm) / self.pendulum.dt - self._rate)
        self._dcm = dcm
        if self._heading is None:
            self._heading = Heading(0.5 * (observation.feet["left"].yaw + observation.feet["right"].yaw))
        self._anchor(observation)
        assert self.regulator is not None
        if self._step is not None and self._touched_down(observation, self._step):
            self._land(observation, x, dcm)
        if self._step is None:
            self._stand(observation, x, dcm)
        else:
            self._fly(observation, dcm, self._step)
        slack = self.regulator.slack(x)
        if self._step is None:
            self._slacks = (slack, math.nan)
            self._watch_zmp(observation.zmp)
            zmp = self._standing_zmp(observation.time, x)
            assert self._inner is not None
            self._commanded = self._inner.nearest(zmp)
            return self._limited(zmp - self._zmp_error, observation, None)
        self._commanded, self._zmp_error = None, np.zeros(2)
        self._slacks = (slack, self._step.aim.slack)
        swing = self._step.foot.advance(self._step.aim.foothold, self._step.left * self.pendulum.dt)
        command = self._limited(self._step.aim.zmp, observation, swing)
        self._step.left = max(self._step.left - 1, 0)
        return command

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

    def foretell(self) -> tuple[float, float]:
        """What the sets say of the last tick's state: slack in the regulator's [m of ZMP], in the steppers' [m of DCM].

        The regulator's is NaN while a foot is in the air. The steppers' is that of the steps that are promised to do,
        from the step under way or from the stance; NaN without a promise.
        """
        if self._promise is None or self._dcm is None or self._heading is None:
            return self._slacks[0], math.nan
        if self._step is None:
            return self._slacks[0], self._promise.lift(self._dcm, self._positions(), self._heading, SIDES).slack
        step = self._step
        stance = self._feet[other(step.lift.side)].position
        if step.closing:
            return math.nan, math.nan
        left = min(step.left, step.ticks)
        return math.nan, self._promise.slack(self._dcm, stance, step.foot.position[:2], self._heading, step.lift, left)

    def best_step(self, x: Array) -> Lift:
        """The step that would be taken from the latest stance in a state (4,); changes nothing."""
        assert self.rule is not None
        assert self._heading is not None
        return self.rule.lift(self.pendulum.dcm(x), self._positions(), self._heading, SIDES)

    def _positions(self) -> dict[Side, Array]:
        return {side: foot.position for side, foot in self._feet.items()}

    def _anchor(self, observation: Observation) -> None:
        """Take the feet on the floor for where they are, once they have moved."""
        swing = None if self._step is None else self._step.lift.side
        for side in SIDES:
            if side == swing:
                continue
            state, known = observation.feet[side], self._places.get(side)
            x, y, _ = state.position.tolist()
            if known is None or abs(x - known[0]) > MOVED or abs(y - known[1]) > MOVED:
                self._feet[side] = self._foot(state)
                self._places[side] = (x, y)
                self._inner = None
        if swing is None and (
            self.regulator is None or any(self.regulator.feet[side] is not self._feet[side] for side in SIDES)
        ):
            self.regulator = Regulator.at(self.pendulum, self._gains, dict(self._feet))
        if self._inner is None:
            down = [foot for side, foot in self._feet.items() if side != swing]
            self._inner = support_polygon(down).shrunk(EDGE)

    def _foot(self, state: FootState) -> Foot:
        return Foot(position=state.position[:2], yaw=state.yaw, sole=self.robot.sole_vertices["left"])

    def _stand(self, observation: Observation, x: Array, dcm: Array) -> None:
        """Stay with the regulator, or begin a step."""
        assert self.regulator is not None
        if not self.decisions:
            self._note(observation, x, "start")
        slack = self.regulator.slack(x)
        self._may_step |= slack >= 0.0
        ahead = dcm
        if self.rule is not None and self._may_step:
            lead = self.options.early_trigger
            if lead and observation.time - self._landed_at > SETTLING:
                ahead = dcm + lead * self._rate
            if slack < 0.0 or self.regulator.slack(self._moved(x, ahead - dcm)) < -SURE:
                why = "the state left the regulator's set" if slack < 0.0 else "the state is about to leave it"
                self._restored = 0
                self._lift_off(observation, x, dcm, ahead, why)
                return
            if self._restore(observation, x, dcm):
                return
        gain = self.regulator.choose(x, self._gain)
        if gain is not self._gain:
            self._gain = gain
            self._note(observation, x, f"the stiffest gain whose set holds the state is {gain.name}")

    def _standing_zmp(self, time: float, x: Array) -> Array:
        """ZMP of the regulator, about the middle of the feet or on the way over the foot that stays."""
        assert self.regulator is not None
        zmp = self.regulator.zmp(x, self._gain)
        if self._restoration is None:
            return zmp
        # The same law about another centre: u_C moves, and -F x_C with it.
        middle = self.regulator.centre
        shift = self._restoration.centre(time) - middle
        return zmp + shift + self._gain.F @ np.array([shift[0], 0.0, shift[1], 0.0])

    def _watch_zmp(self, measured: Array) -> None:
        """See how far the ZMP of the last tick was off what was wanted of it."""
        if self._commanded is None or not math.isfinite(measured[0]) or math.hypot(*self._rate) > CALM:
            return
        error = measured - self._commanded
        share = self.pendulum.dt / ZMP_ERROR_TIME
        self._zmp_error = np.clip(self._zmp_error + share * error, -ZMP_ERROR_MOST, ZMP_ERROR_MOST)

    def _restore(self, observation: Observation, x: Array, dcm: Array) -> bool:
        """Bring the feet together once it is quiet; True when the closing step begins."""
        assert self.regulator is not None
        assert self._heading is not None
        time = observation.time
        if self._restoration is not None:
            sole = SupportPolygon(self.robot.sole_vertices["left"])
            if not self._restoration.may_lift(dcm, sole, self._heading):
                if time - self._restoration.since > GIVE_UP:
                    self._restoration, self._restored = None, ATTEMPTS
                    self._note(observation, x, "the legs do not reach so far: the stance stays")
                return False
            self._close(observation, x, self._restoration)
            return True
        if self._landed is None or math.hypot(*(dcm - self.regulator.centre)) > QUIET:
            self._quiet_since = None
        elif self._quiet_since is None:
            self._quiet_since = time
        elif time - self._quiet_since >= QUIET_FOR and self._restored < ATTEMPTS:
            self._quiet_since = None
            self._restoration = closing_step(
                self._positions(), self._landed, self._heading, self.robot, time, self.pendulum.dt
            )
            if self._restoration is not None:
                self._restored += 1
                self._note(observation, x, f"it is quiet: the COG goes over the {self._landed} foot")
        return False

    def _close(self, observation: Observation, x: Array, plan: Restoration) -> None:
        assert self._heading is not None
        lift = Lift(side=plan.side, step_time=plan.step_time, steps=1, slack=math.nan, candidates=())
        aim = Aim(foothold=plan.foothold, zmp=plan.over, steps=1, slack=math.nan)
        self._begin(observation, lift, aim, closing=True)
        self._note(observation, x, f"the {plan.side} foot closes up")

    def _moved(self, x: Array, by: Array) -> Array:
        """State whose DCM is further on."""
        return x + np.array([by[0], 0.0, by[1], 0.0])

    def _lift_off(self, observation: Observation, x: Array, dcm: Array, ahead: Array, why: str) -> None:
        assert self.rule is not None
        assert self._heading is not None
        sides: Sequence[Side] = SIDES
        if self._landed is not None and observation.time - self._landed_at < JUST_LANDED:
            sides = (other(self._landed),)
        positions = self._positions()
        lift = self.rule.lift(ahead, positions, self._heading, sides)
        ticks = round(lift.step_time / self.pendulum.dt)
        stance, swing = positions[other(lift.side)], observation.feet[lift.side].position[:2]
        aim = self.rule.aim(dcm, stance, swing, self._heading, lift, ticks, lift.steps)
        self._begin(observation, lift, aim)
        self._note(observation, x, why, candidates=lift.candidates)

    def _begin(self, observation: Observation, lift: Lift, aim: Aim, *, closing: bool = False) -> None:
        assert self._heading is not None
        dt, position = self.pendulum.dt, observation.feet[lift.side].position
        foot = SwingFoot(position, self._heading.yaw, lift.step_time, self.options.swing_height, dt)
        ticks = round(lift.step_time / dt)
        self._step = _Step(lift=lift, foot=foot, ticks=ticks, left=ticks, aim=aim, closing=closing)
        self.steps += 1
        self._restoration, self._quiet_since = None, None
        self._inner = support_polygon([self._feet[other(lift.side)]]).shrunk(EDGE)

    def _hold(self, x: Array, dcm: Array, step: _Step) -> None:
        """Balance over one foot while the other closes up; in trouble let it land where the rule says."""
        foot = self._feet[other(step.lift.side)]
        if support_polygon([foot]).slack(dcm) < 0.0:
            step.closing, time = False, max(self.options.step_times)
            step.lift = replace(step.lift, step_time=time)
            step.ticks = step.left = min(step.left, round(time / self.pendulum.dt))
            return
        zmp = foot.position - self._gain.F @ (x - self.pendulum.rest(foot.position))
        step.aim = replace(step.aim, zmp=zmp)

    def _fly(self, observation: Observation, dcm: Array, step: _Step) -> None:
        """Aim anew."""
        assert self.rule is not None
        assert self._heading is not None
        if step.closing:
            self._hold(self._x, dcm, step)
        if step.closing or step.left == 0 or step.left == step.ticks:
            return
        before = step.aim
        stance = self._feet[other(step.lift.side)].position
        aim = self.rule.aim(dcm, stance, step.foot.position[:2], self._heading, step.lift, step.left, before.steps)
        if not self.options.replan:
            aim = Aim(foothold=before.foothold, zmp=aim.zmp, steps=aim.steps, slack=aim.slack)
        step.aim = aim
        if aim.steps != before.steps or (aim.slack < 0.0) != (before.slack < 0.0):
            held = "no set holds the state" if aim.slack < 0.0 else f"the set of {aim.steps} steps holds the state"
            self._note(observation, self._x, f"in the air: {held}")

    def _touched_down(self, observation: Observation, step: _Step) -> bool:
        if observation.feet[step.lift.side].force < TOUCHDOWN_FORCE:
            return False
        return step.left <= (1.0 - EARLIEST_TOUCHDOWN) * step.ticks

    def _land(self, observation: Observation, x: Array, dcm: Array) -> None:
        assert self._step is not None
        self._landed, self._landed_at = self._step.lift.side, observation.time
        self._step = None
        self._feet, self._places, self._inner = {}, {}, None
        self._anchor(observation)
        assert self.regulator is not None
        why = f"the {self._landed} foot landed"
        if self.rule is not None and self.regulator.slack(x) < 0.0 and self.options.max_steps > 1:
            self._lift_off(observation, x, dcm, dcm, why)
        else:
            self._may_step = self.options.max_steps > 1
            self._gain = self.regulator.choose(x, None)
            self._note(observation, x, why)

    def _note(self, observation: Observation, x: Array, why: str, *, candidates: tuple[Candidate, ...] = ()) -> None:
        assert self.regulator is not None
        slack = self.regulator.slack(x)
        step = self._step
        stepping = math.nan if step is None else step.aim.slack
        self.decisions.append(
            Decision(
                time=observation.time,
                controller=self.controller,
                reason=why,
                regulator_slack=slack,
                tracking_slack=stepping,
                in_regulator_set=slack >= 0.0,
                in_tracking_set=stepping >= 0.0,
                outside_all=slack < 0.0 and not stepping >= 0.0,
                candidates=candidates,
                plan="" if step is None else f"{step.lift.side} {step.lift.step_time:g} s, {step.aim.steps} to do",
                tight=self.regulator.explain(x),
            )
        )

    def _limited(self, zmp: Array, observation: Observation, swing: FootReference | None) -> BalanceCommand:
        assert self._inner is not None
        assert self._heading is not None
        lifted = None if self._step is None else self._step.lift.side
        feet = {
            side: swing
            if swing is not None and side == lifted
            else FootReference(
                stance=True,
                position=observation.feet[side].position,
                velocity=_STILL,
                acceleration=_STILL,
                # Two feet that are turned against each other only strain the legs; one alone can be turned back.
                yaw=observation.feet[side].yaw if lifted is None else self._heading.yaw,
            )
            for side in SIDES
        }
        return BalanceCommand(zmp=self._inner.nearest(zmp), feet=feet)
