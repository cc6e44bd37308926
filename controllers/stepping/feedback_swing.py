"""The way of a foot through the air, steered from where the foot is seen.

At every tick the foot takes the way of least acceleration (in the mean square) to its goal: from position p and
velocity v, in the time T, to position g and velocity w,

    a = 6 (g - p) / T^2 - (4 v + 2 w) / T.

It pulls hardest when the foot is slow, where a motor has most to give, and asks for nothing to make up for what the
legs could not do. A reference that runs ahead of the foot (`SwingFoot`) asks for ever more; what it takes the leg that
stands must pay, and the COG is thrown up or falls.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.interface import FootReference
from controllers.stepping.swing import APEX, SwingFoot

Array = NDArray[np.float64]

# The time to a goal counts for no less than this [s]: the last bit of a late foot's way would ask for anything.
SHORTEST = 0.03
# No more than this is asked for in any direction [m/s^2], some 6 g.
MOST_ACCELERATION = 60.0


class FeedbackSwing(SwingFoot):
    """Motion of a sole from where it is seen to a foothold that may move while it flies."""

    def __init__(
        self, position: Array, yaw: float, duration: float, height: float, dt: float, speed: float = 1.0
    ) -> None:
        """See `SwingFoot`."""
        super().__init__(position, yaw, duration, height, dt, speed)
        self._last = position.copy()

    def see(self, position: Array) -> None:
        """See `SwingFoot.see`; this motion goes on from there."""
        self._velocity = (position - self._last) / self._dt
        self._last = position.copy()
        self._position = position.copy()

    def advance(self, foothold: Array, time_left: float) -> FootReference:
        """See `SwingFoot.advance`. The acceleration is all that is asked for; the rest is where it leads to."""
        x, y = foothold.tolist()
        landing = max(time_left, SHORTEST)
        to_apex = time_left - (1.0 - APEX) * self._duration
        if to_apex > 0.5 * SHORTEST:
            rise = self._toward(2, self._height, 0.0, max(to_apex, SHORTEST))
        elif time_left > 0.5 * self._dt:
            rise = self._toward(2, 0.0, self._landing_speed, landing)
        else:
            rise = (self._search_speed - self._velocity.item(2)) / SHORTEST
        asked = np.array([self._toward(0, x, 0.0, landing), self._toward(1, y, 0.0, landing), rise])
        self._acceleration = asked.clip(-MOST_ACCELERATION, MOST_ACCELERATION)
        self._position = self._position + (self._velocity + 0.5 * self._dt * self._acceleration) * self._dt
        self._velocity = self._velocity + self._acceleration * self._dt
        return self._reference(feedback=True)

    def _toward(self, axis: int, goal: float, speed: float, duration: float) -> float:
        """Acceleration with which the way of least acceleration to a goal begins [m/s^2]."""
        p, v = self._position.item(axis), self._velocity.item(axis)
        return 6.0 * (goal - p) / duration**2 - (4.0 * v + 2.0 * speed) / duration
