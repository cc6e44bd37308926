"""The paper's falling avoidance (Section V): the regulator in its set, else one fixed stepping reference, tracked.

The reference is planned once, from rest in the first stance: the right foot goes ahead, the left one closes. Nothing
is planned anew: neither foothold nor time heeds the push. The tracker takes over at t = 0 of the reference, for Section
V decides by tO_inf alone, which is the set of k = 0 (Fig. 6); later phases are never entered directly.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.baselines.tracker import Tracker
from controllers.fields import NotNegative, Strict
from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import SupportPolygon
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
from controllers.reference.walking_reference import Stride, walk_plan
from controllers.stepping.contact_state import EDGE, ContactState
from controllers.stepping.swing import SwingFoot
from controllers.stepping.swing_step import touched_down
from controllers.supervisor.regulator import Regulator
from models.arena import SIDES
from models.robot import Side

Array = NDArray[np.float64]

# Section IV-C: stride [m] and duration of a step [s].
STRIDE, STEP_TIME = 0.1, 0.5
FIRST: Side = "right"


class PaperSupervisor:
    """Falling avoidance as published, to compare with.

    All its sets and its reference are of soles that are smaller by `edge` all around, so that what they promise is
    what is commanded. A later push finds the same reference, moved to where the feet then stand.

    Attributes:
        robot: whom it balances.
        decisions: every choice since `reset`, with its grounds.
        regulator: the regulator of the latest double support.
        tracker: of the reference, at phase 0 while the regulator is in charge; None before the first tick.
    """

    label, colour, marker = "paper", "#b8860b", "D"

    class Options(Strict):
        """Options of the paper's controller.

        Attributes:
            gain: of regulator and tracker.
            stepping: of which only `swing_height` and `zmp_error` count.
            edge: distance that the ZMP keeps from the edges of the soles [m].
        """

        gain: GainOptions = DcmGain()
        stepping: Stepping = Stepping()
        edge: NotNegative = EDGE

    def __init__(self, setting: Setting, options: Options) -> None:
        """Prepare; the reference is planned at the first tick."""
        self.robot = robot = setting.robot
        self._pendulum = Pendulum(robot.omega, setting.dt)
        self._gain = options.gain.of(self._pendulum)
        self._height, self._zmp_error = options.stepping.swing_height, options.stepping.zmp_error
        self._sole = SupportPolygon(robot.sole_vertices["left"]).shrunk(options.edge).vertices
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.decisions: list[Decision] = []
        self.regulator: Regulator | None = None
        self.tracker: Tracker | None = None
        self._tracking = False
        self._outside = False
        # The soles are the smaller ones already.
        self._contacts = ContactState(self._sole, edge=0.0)
        self._swing: tuple[Stride, SwingFoot] | None = None
        # Middle of the feet when the reference was planned, and from there to where it is followed now.
        self._middle, self._offset = np.zeros(2), np.zeros(2)
        self._slacks = (math.nan, math.nan)

    @property
    def phase(self) -> Phase:
        """Who is in charge."""
        return Phase.STEPPING if self._tracking else Phase.STANDING

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state, after its decision [m of ZMP]: in the set of the latest double
        support's regulator, and in the present tracking set (NaN while the regulator is in charge)."""
        return self._slacks[0], self._slacks[1] if self._tracking else math.nan

    def predict(self) -> Prediction:
        """What the sets say of the last tick's state [m of ZMP]: the regulator's, and the reference's, which is that
        of the present phase once it is tracked and of phase 0 before."""
        return Prediction(standing=self._slacks[0], stepping=self._slacks[1])

    def regions(self, x: Array) -> tuple[Region, ...]:
        """The regulator's set of the latest double support, and that of the reference's present phase."""
        if self.regulator is None or self.tracker is None:
            return ()
        tracked = self.tracker.sets.polytope(self.tracker.phase)
        # The rows are of states where the reference was planned.
        states = Polytope(S=tracked.S, a=tracked.a + tracked.S @ (x - self.seen(x)))
        standing = Region(name="regulator", centre=self.regulator.centre, states=self.regulator.region(self.robot))
        return (standing, Region(name="tracking", centre=self.regulator.centre, states=states))

    def seen(self, x: Array) -> Array:
        """A state (4,) in the place where the reference was planned."""
        return x - np.array([self._offset[0], 0.0, self._offset[1], 0.0])

    def command(self, observation: Observation) -> BalanceCommand:
        """Decide, then command: one control tick."""
        x = observation.balance_state()
        self._touch(observation)
        if self._contacts.see(observation) and not self._tracking:
            self._stand()
        tracker = self.tracker
        assert tracker is not None
        ended = self._tracking and tracker.finished
        if ended:
            self._tracking = False
            self._stand()
        self._slacks = self._ask(x)
        if not self.decisions:
            self._note(observation, x, "start")
        if ended:
            self._note(observation, x, "the reference has ended")
        else:
            self._choose(observation, x)
        if not self._tracking:
            assert self.regulator is not None
            return self._limited(self.regulator.zmp(x), observation, None)
        zmp = tracker.zmp(self.seen(x)) + self._offset
        swing = self._fly(observation, tracker)
        tracker.advance()
        return self._limited(zmp, observation, swing)

    def _ask(self, x: Array) -> tuple[float, float]:
        assert self.regulator is not None
        assert self.tracker is not None
        return self.regulator.slack(x), self.tracker.slack(self.seen(x))

    def _choose(self, observation: Observation, x: Array) -> None:
        """Give the state to the tracker once it must be: in its set, or out of all sets if that is violated less."""
        standing, stepping = self._slacks
        held = not self._outside
        self._outside = stepping < 0.0 and (self._tracking or standing < 0.0)
        if not self._tracking and standing < 0.0 and stepping > standing:
            self._tracking = True
            self._note(observation, x, "the state left the regulator's set")
        elif self._outside and held:
            self._note(observation, x, f"the state left the {'tracking set' if self._tracking else 'sets'}")

    def _touch(self, observation: Observation) -> None:
        """Has the foot in the air landed?"""
        if self._swing is None or self.tracker is None:
            return
        stride = self._swing[0]
        ticks = stride.landing - stride.lift
        if touched_down(observation.feet[stride.side].force, stride.landing - self.tracker.k, ticks):
            self.tracker.land()
            self._contacts.land()
            self._swing = None

    def _stand(self) -> None:
        """Regulate about the present stance; the reference waits at its first phase."""
        feet, middle = self._contacts.feet, self._contacts.middle
        self.regulator = Regulator.at(self._pendulum, (self._gain,), dict(feet), zmp_error=self._zmp_error)
        if self.tracker is None:
            walk = walk_plan(self._pendulum, feet, STRIDE, 2, STEP_TIME, first=FIRST)
            self.tracker = Tracker(walk, self._gain, self._zmp_error)
            self._middle = middle
        self.tracker.start()
        self._offset = middle - self._middle

    def _fly(self, observation: Observation, tracker: Tracker) -> FootReference | None:
        """The foot in the air on its way to the foothold of the reference."""
        stride, dt = tracker.stride, self._pendulum.dt
        if stride is None:
            return None
        if self._swing is None:
            duration = (stride.landing - stride.lift) * dt
            start = observation.feet[stride.side].position
            self._swing = stride, SwingFoot(start, self._contacts.heading.yaw, duration, self._height, dt)
            self._contacts.lift(stride.side)
        left = max(stride.landing - tracker.k, 0) * dt
        return self._swing[1].advance(stride.foothold.position + self._offset, left)

    def _note(self, observation: Observation, x: Array, why: str) -> None:
        assert self.regulator is not None
        assert self.tracker is not None
        standing, stepping = self._slacks
        name = f"{FIRST} foot {STRIDE:g} m ahead, the other closes, {STEP_TIME:g} s each"
        self.decisions.append(
            Decision(
                time=observation.time,
                phase=self.phase,
                reason=why,
                regulator_slack=standing,
                tracking_slack=stepping,
                candidates=(Candidate(name=name, slack=stepping),),
                plan=name if self._tracking else "",
                tight=self.tracker.explain(self.seen(x)) if self._tracking else self.regulator.explain(x),
            )
        )

    def _limited(self, zmp: Array, observation: Observation, swing: FootReference | None) -> BalanceCommand:
        yaw = self._contacts.heading.yaw
        feet = {side: FootReference.standing(observation.feet[side], yaw) for side in SIDES}
        if swing is not None and self._contacts.lifted is not None:
            feet[self._contacts.lifted] = swing
        return BalanceCommand(zmp=self._contacts.support.nearest(zmp), feet=feet, stepping=self._tracking)
