"""How large, slow, heavy and strong a robot is against `utmu2`, for which the controllers' numbers were found.

A number that belongs to a body follows one of these ratios; for `utmu2` all are 1, so its numbers stay as they are:

- `length`, ∝ leg length: what the legs reach and where the feet are brought back to;
- `time`, ∝ sqrt(z_G / g), the pendulum's time: how long the pendulum takes to do anything; gains of tasks go with
  1 / `time`^2 and 1 / `time`;
- `speed`, `length` / `time`;
- `force`, ∝ m g: what a foot carries;
- `swing`, ∝ sqrt(I / tau), with the leg's inertia I about the hip and the stall torque tau of the weaker hip motor:
  the time in which the motors bring a foot from one place to another. The step times follow it.

What does not follow a ratio, for it did not help (64 to 192 hard pushes of OP3, T1, G1 and Berkeley Humanoid for each):
margins on the sole, thresholds of slack and the stride are what the contact and the whole-body layer make of them, in
metres; with the leg length, or the width of the sole, as many or fewer pushes were recovered from. Costs of torque and
contact in the QP by 1 / (m g z_G)^2 lost a sixth of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LEG, COG_HEIGHT, GRAVITY, MASS, SWING_TIME = 0.3117, 0.26, 9.81, 5.531, 0.07335
"""Of `utmu2`: leg [m], height of the COG [m], gravity [m/s^2], mass [kg], time of its swing [s]."""
_DIGITS = 3


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Ratios to `utmu2` [1]; see the module.

    Attributes:
        length, time, force, swing: as above.
    """

    length: float
    time: float
    force: float
    swing: float

    @property
    def speed(self) -> float:
        """Length by time."""
        return self.length / self.time


def scale_of(*, leg_length: float, cog_height: float, gravity: float, mass: float, swing_time: float) -> Scale:
    """The ratios of a robot.

    Args:
        leg_length: straight [m].
        cog_height: over the soles [m].
        gravity: [m/s^2].
        mass: [kg].
        swing_time: sqrt(I / tau) of the hip [s].
    """
    return Scale(
        length=round(leg_length / LEG, _DIGITS),
        time=round(math.sqrt(cog_height / gravity * GRAVITY / COG_HEIGHT), _DIGITS),
        force=round(mass * gravity / (MASS * GRAVITY), _DIGITS),
        swing=round(swing_time / SWING_TIME, _DIGITS),
    )
