"""The step under way: its foot, its aim, and the time until it lands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from controllers.interface import FootReference
from controllers.stepping.step_policy import Aim, Lift
from controllers.stepping.swing import SwingFoot
from models.robot import Side, other

Array = NDArray[np.float64]

# A swing foot has landed when it carries this [N], of a robot of scale 1, but not in the first half of its step, when
# it may still scrape.
TOUCHDOWN_FORCE = 4.0
EARLIEST_TOUCHDOWN = 0.5


def touched_down(force: float, ticks_left: int, ticks: int) -> bool:
    """Whether a foot in the air has landed.

    Args:
        force: normal force from the floor, by the `force` of the robot's scale [N].
        ticks_left: control periods until it was to land; negative once it is late.
        ticks: control periods of its whole step.
    """
    return force >= TOUCHDOWN_FORCE and ticks_left <= (1.0 - EARLIEST_TOUCHDOWN) * ticks


@dataclass(slots=True, kw_only=True)
class SwingStep:
    """A step under way.

    Attributes:
        lift: which foot goes, for how long, and as the first of how many.
        aim: where it shall land, and where the ZMP stays until then.
        foot: its way through the air.
        ticks: control periods of the whole step.
        left: control periods until landing; 0 once it is late.
        closing: whether it only brings the feet together, with the body at rest over the other one.
        before: (2,) where the foot was when the present tick began [m], and the control periods left then.
    """

    lift: Lift
    aim: Aim
    foot: SwingFoot
    ticks: int
    left: int
    closing: bool
    before: tuple[Array, int] = field(init=False)

    def __post_init__(self) -> None:
        self.before = self.foot.position[:2], self.left

    @property
    def stance(self) -> Side:
        """The foot on the floor."""
        return other(self.lift.side)

    @property
    def plan(self) -> str:
        """What is being done, in words."""
        return f"{self.lift.side} {self.lift.step_time:g} s, {self.aim.steps} to do"

    def hasten(self, step_time: float, dt: float) -> None:
        """Balance is lost while the feet close up: from now on it is a step like any other, of at most `step_time`."""
        self.closing = False
        self.lift = replace(self.lift, step_time=step_time)
        self.ticks = self.left = min(self.left, round(step_time / dt))

    def advance(self, dt: float) -> FootReference:
        """Reference of the foot for the end of this tick, of `dt` [s]."""
        self.before = self.foot.position[:2], self.left
        reference = self.foot.advance(self.aim.foothold, self.left * dt)
        self.left = max(self.left - 1, 0)
        return reference
