"""Who is in charge: the regulator while its MOA set holds the state, else the tracker whose set does (Section V)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.pendulum import Pendulum
from controllers.regulator import Regulator
from controllers.signals import BalanceCommand, Controller, Decision, FootReference, FootState, Observation
from controllers.stepper import Choice, Stepper, SteppingOptions
from controllers.support import Foot, SupportPolygon, support_polygon
from controllers.swing import SwingFoot
from controllers.tracker import Tracker
from models.arena import SIDES
from models.robot import Robot, Side

Array = NDArray[np.float64]

# The commanded ZMP stays this far inside the support, so that a foot does not tip over its edge [m].
EDGE = 0.003
# A foot that has moved this far is somewhere else, and the stance's sets are computed anew [m].
MOVED = 0.002
# A swing foot has landed when it carries this [N], but not in the first half of its step, when it may still scrape.
TOUCHDOWN_FORCE = 4.0
EARLIEST_TOUCHDOWN = 0.5
# Outside all sets a new plan is sought every so many ticks, not at each: it is the least violated one anyway.
PATIENCE = 5
# A foot that has landed less than this ago [s] is the one the weight falls on: the other one steps next.
JUST_LANDED = 0.3

_STILL = np.zeros(3)
_STILL.setflags(write=False)


class Supervisor:
    """Falling avoidance by switching controllers on membership of their MOA sets.

    With `may_step=False` it is the null controller `regulator`: the same law, limited to the support polygon,
    and nothing else.

    Attributes:
        robot: whom it balances.
        options: what steps may be planned.
        decisions: every choice since `reset`, with its grounds.
        regulator: the regulator of the latest double support.
        tracker: the tracker in charge, or None.
        steps: steps begun since `reset`.
    """

    def __init__(
        self, robot: Robot, pendulum: Pendulum, gain: Gain, options: SteppingOptions, *, may_step: bool = True
    ) -> None:
        self.robot = robot
        self._pendulum = pendulum
        self._gain = gain
        self.options = options
        self._may_step = may_step
        self._stepper = Stepper(pendulum, options)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self.regulator: Regulator | None = None
        self.tracker: Tracker | None = None
        self.steps = 0
        self._plan_name = ""
        self._swing_foot: SwingFoot | None = None
        self._feet: dict[Side, Foot] = {}
        self._places: dict[Side, tuple[float, float]] = {}
        self._heading: float | None = None
        self._landed: Side | None = None
        self._landed_at = -math.inf
        self._wait = 0
        self._slacks = (math.nan, math.nan)
        self._inner: SupportPolygon | None = None

    @property
    def controller(self) -> Controller:
        """Who is in charge."""
        return Controller.REGULATOR if self.tracker is None else Controller.TRACKER

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state, after its decision [m of ZMP]: in the set of the latest double
        support's regulator, and in the present tracking set (NaN while the regulator is in charge)."""
        return self._slacks

    def command(self, observation: Observation) -> BalanceCommand:
        """Decide, then command: one control tick."""
        x = observation.balance_state()
        self._wait = max(self._wait - 1, 0)
        self._anchor(observation)
        assert self.regulator is not None
        regulator_slack = self.regulator.admissible.slack(x)
        tracking_slack = math.nan if self.tracker is None else self.tracker.slack(x)
        if self._decide(observation, x, regulator_slack, tracking_slack):
            assert self.regulator is not None
            regulator_slack = self.regulator.admissible.slack(x)
            tracking_slack = math.nan if self.tracker is None else self.tracker.slack(x)
        self._slacks = (regulator_slack, tracking_slack)
        if self.tracker is None:
            return self._limited(self.regulator.zmp(x), observation, None)
        swing = None
        if self.tracker.swing is not None and self._swing_foot is not None:
            foothold = self.tracker.plan.footholds[0].position
            swing = self._swing_foot.advance(foothold, self.tracker.time_left)
        command = self._limited(self.tracker.zmp(x), observation, swing)
        self.tracker.advance()
        return command

    def best_step(self, x: Array) -> Choice | None:
        """What a tracker could promise from this state and the latest stance; changes nothing."""
        if self.regulator is None:
            return None
        return self._stepper.from_stance(x, self.regulator.feet, settle=False, avoid=None)

    def _anchor(self, observation: Observation) -> None:
        """Take the feet on the floor for where they are, once they have moved."""
        if self._heading is None:
            self._heading = 0.5 * (observation.feet["left"].yaw + observation.feet["right"].yaw)
        for side in SIDES:
            if self.tracker is not None and self.tracker.swing == side:
                continue
            state, known = observation.feet[side], self._places.get(side)
            x, y, _ = state.position.tolist()
            if known is None or abs(x - known[0]) > MOVED or abs(y - known[1]) > MOVED:
                self._feet[side] = self._foot(state)
                self._places[side] = (x, y)
                self._inner = None
        if self.tracker is None and (
            self.regulator is None or any(self.regulator.feet[side] is not self._feet[side] for side in SIDES)
        ):
            self.regulator = Regulator.at(self._pendulum, self._gain, dict(self._feet))
            self._inner = None
        if self._inner is None:
            self._inner = self._support().shrunk(EDGE)

    def _foot(self, state: FootState, *, yaw: float | None = None) -> Foot:
        heading = state.yaw if yaw is None else yaw
        return Foot(position=state.position[:2], yaw=heading, sole=self.robot.sole_vertices["left"])

    def _support(self) -> SupportPolygon:
        swing = None if self.tracker is None else self.tracker.swing
        return support_polygon([foot for side, foot in self._feet.items() if side != swing])

    def _decide(self, observation: Observation, x: Array, regulator_slack: float, tracking_slack: float) -> bool:
        """Keep who is in charge, or change it; True if something was decided."""
        before = len(self.decisions)
        if self.tracker is None:
            if regulator_slack < 0.0 and self._may_step and self._wait == 0:
                self._seek(observation, x, "the state left the regulator's set", settle=self._landed is not None)
            elif not self.decisions:
                self._note(observation, x, "start")
        elif self._touched_down(observation):
            self._land(observation, x)
        elif self.tracker.finished:
            self._hand_back(observation, x, "the reference has ended")
        elif tracking_slack < 0.0 and self._wait == 0:
            self._seek(observation, x, "the state left the tracking set", settle=True)
        return len(self.decisions) > before

    def _touched_down(self, observation: Observation) -> bool:
        assert self.tracker is not None
        swing = self.tracker.swing
        if swing is None or observation.feet[swing].force < TOUCHDOWN_FORCE:
            return False
        return self.tracker.time_left <= (1.0 - EARLIEST_TOUCHDOWN) * self.tracker.plan.step_time

    def _land(self, observation: Observation, x: Array) -> None:
        assert self.tracker is not None
        self._landed, self._landed_at = self.tracker.swing, observation.time
        self.tracker, self._swing_foot = None, None
        self._feet, self._places = {}, {}
        self._anchor(observation)
        assert self.regulator is not None
        if self.regulator.admissible.slack(x) >= 0.0:
            self._hand_back(observation, x, f"the {self._landed} foot landed")
        else:
            self._seek(observation, x, f"the {self._landed} foot landed", settle=True)

    def _hand_back(self, observation: Observation, x: Array, why: str) -> None:
        self.tracker, self._swing_foot, self._plan_name = None, None, ""
        self._anchor(observation)
        self._note(observation, x, why)

    def _seek(self, observation: Observation, x: Array, why: str, *, settle: bool) -> None:
        assert self.regulator is not None
        swing = None if self.tracker is None else self.tracker.swing
        if swing is None and self.regulator.admissible.slack(x) >= 0.0:
            self._hand_back(observation, x, why)
            return
        if swing is None:
            avoid = self._landed if observation.time - self._landed_at < JUST_LANDED else None
            choice = self._stepper.from_stance(x, dict(self._feet), settle=settle, avoid=avoid)
        else:
            assert self.tracker is not None
            assert self._swing_foot is not None
            feet = {**self._feet, swing: self._foot(observation.feet[swing], yaw=self._heading)}
            choice = self._stepper.from_swing(
                x, feet, swing, self.tracker.time_left, self._swing_foot.position[:2]
            )
        if choice is None:
            self._wait = PATIENCE
            self._note(observation, x, f"{why}; no step is within reach")
            return
        self._take(observation, x, choice, why, swing)

    def _take(self, observation: Observation, x: Array, choice: Choice, why: str, swing: Side | None) -> None:
        self.tracker = Tracker(choice.plan, self._gain)
        self._plan_name = choice.name
        self._wait = 0 if choice.plan.slack >= 0.0 else PATIENCE
        lifted = self.tracker.swing
        if lifted is not None and swing is None:
            state = observation.feet[lifted]
            self.steps += 1
            duration, height = choice.plan.step_time, self.options.swing_height
            self._swing_foot = SwingFoot(
                state.position, self._heading or 0.0, duration, height, self._pendulum.dt
            )
        self._inner = self._support().shrunk(EDGE)
        self._note(observation, x, why, choice)

    def _note(self, observation: Observation, x: Array, why: str, choice: Choice | None = None) -> None:
        assert self.regulator is not None
        regulator = self.regulator.admissible.slack(x)
        tracking = math.nan if choice is None else choice.plan.slack
        explain = self.tracker.explain if self.tracker is not None else self.regulator.admissible.explain
        self.decisions.append(
            Decision(
                time=observation.time,
                controller=self.controller,
                reason=why,
                regulator_slack=regulator,
                tracking_slack=tracking,
                in_regulator_set=regulator >= 0.0,
                in_tracking_set=tracking >= 0.0,
                outside_all=regulator < 0.0 and not tracking >= 0.0,
                candidates=() if choice is None else choice.candidates,
                plan=self._plan_name,
                tight=explain(x),
            )
        )

    def _limited(self, zmp: Array, observation: Observation, swing: FootReference | None) -> BalanceCommand:
        assert self._inner is not None
        lifted = None if self.tracker is None else self.tracker.swing
        feet = {
            side: swing
            if swing is not None and side == lifted
            else FootReference(
                stance=True,
                position=observation.feet[side].position,
                velocity=_STILL,
                acceleration=_STILL,
                yaw=self._heading or 0.0,
            )
            for side in SIDES
        }
        return BalanceCommand(zmp=self._inner.nearest(zmp), feet=feet)


