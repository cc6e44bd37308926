"""What is predicted of the steps to come: whether they will do, by membership in N-step sets.

On the pendulum the rule's own sets say it: nothing is left out of them. A body does less and more than they hold. Its
feet are slower than what the rule asks of them; but it also gets along with states that they call lost, for it can
spin, roll over the rim of a sole, and land a little later. So its sets are those of slower feet, grown all round.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import Heading, Lift, step_limits
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# Share of the swing speed that a body's feet are counted on for (a foot at rest is limited more by its acceleration,
# which is counted on in full), and how far out of those sets the DCM may be [m]. More of either makes fewer false
# alarms, and calls more pushes safe that fell the humanoid: `python -m tests.benchmarks recoverability` prints how
# many, of pushes that no reported suite uses. `truth` scores them.
BODY_SPEED = 0.5
BODY_MARGIN = 0.06


class Recoverability:
    """Predicts by the sets of a policy."""

    def __init__(self, rule: SetPolicy, margin: float = 0.0) -> None:
        """Take the sets.

        Args:
            rule: whose sets they are.
            margin: by which they are grown [m of DCM].
        """
        self._sets, self._lift_sets, self._margin = rule.sets, rule.lift_sets, margin

    @classmethod
    def of_body(cls, robot: Robot, pendulum: Pendulum, options: Stepping, gain_k: float) -> Recoverability:
        """What a humanoid was seen to do; arguments as of `SetPolicy`."""
        limits = step_limits(robot, options.max_stride)
        slower = replace(limits, swing_speed=BODY_SPEED * limits.swing_speed)
        return cls(SetPolicy(robot, pendulum, options, gain_k, slower), BODY_MARGIN)

    def standing(self, dcm: Array, feet: Mapping[Side, Array], heading: Heading, sides: Sequence[Side]) -> float:
        """The largest slack in any set of steps that begin now [m of DCM].

        Args:
            dcm: (2,) in the world [m].
            feet: (2,) where they stand [m].
            heading: of the robot.
            sides: the feet that may go first.
        """
        largest = -np.inf
        for side in sides:
            stance = feet[other(side)]
            point, foot = heading.local(dcm, stance), heading.local(feet[side], stance)
            for time in self._lift_sets.step_times:
                largest = max(largest, self._lift_sets.slacks(point, other(side), time, foot, time).max())
        return float(largest) + self._margin

    def stepping(self, dcm: Array, stance: Array, swing: Array, heading: Heading, lift: Lift, ticks_left: int) -> float:
        """The largest slack in any set of the step under way [m of DCM]; arguments as of `StepPolicy.aim`."""
        point, foot = heading.local(dcm, stance), heading.local(swing, stance)
        left = ticks_left * self._sets.pendulum.dt
        slacks = self._sets.slacks(point, other(lift.side), left, foot, lift.step_time)
        return float(slacks.max()) + self._margin
