"""What is predicted of the steps to come: how far inside the N-step sets the state is, or how far outside.

On the pendulum the rule's own sets say whether they will do: nothing is left out of them. A body's feet are slower than
what the rule asks of them, so its sets are those of slower feet. They are no promise. A body does less and more than
they hold, for it can stumble, but also spin, roll over the rim of a sole, and land a little later: how likely it is
recovered from by the slack is fitted to pushes (`sim.analysis.calibration`).
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
# which is counted on in full). The slack tells recovered from lost alike at any share from 0.3 to 0.6, and worse at the
# full speed: `python -m tests.benchmarks recoverability`.
BODY_SPEED = 0.5


class Recoverability:
    """Predicts by the sets of a policy."""

    def __init__(self, rule: SetPolicy) -> None:
        """Take the sets of a policy."""
        self._sets, self._lift_sets = rule.sets, rule.lift_sets

    @classmethod
    def of_body(cls, robot: Robot, pendulum: Pendulum, options: Stepping, gain_k: float) -> Recoverability:
        """Those of a humanoid's slower feet; arguments as of `SetPolicy`."""
        limits = step_limits(robot, options.max_stride)
        slower = replace(limits, swing_speed=BODY_SPEED * limits.swing_speed)
        return cls(SetPolicy(robot, pendulum, options, gain_k, slower))

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
        return float(largest)

    def stepping(self, dcm: Array, stance: Array, swing: Array, heading: Heading, lift: Lift, ticks_left: int) -> float:
        """The largest slack in any set of the step under way [m of DCM]; arguments as of `StepPolicy.aim`."""
        point, foot = heading.local(dcm, stance), heading.local(swing, stance)
        left = ticks_left * self._sets.pendulum.dt
        return float(self._sets.slacks(point, other(lift.side), left, foot, lift.step_time).max())
