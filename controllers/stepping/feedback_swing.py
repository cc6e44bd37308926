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
        # Plain floats: the same on arrays of three takes three times as long.
        (x, y), (px, py, pz), (vx, vy, vz) = foothold.tolist(), self._position.tolist(), self._velocity.tolist()
        landing = max(time_left, SHORTEST)
        to_apex = time_left - (1.0 - APEX) * self._duration
        if to_apex > 0.5 * SHORTEST:
            rise = _toward(pz, vz, self._height, 0.0, max(to_apex, SHORTEST))
        elif time_left > 0.5 * self._dt:
            rise = _toward(pz, vz, 0.0, self._landing_speed, landing)
        else:
            rise = (self._search_speed - vz) / SHORTEST
        ax, ay = _limited(_toward(px, vx, x, 0.0, landing)), _limited(_toward(py, vy, y, 0.0, landing))
        az, dt = _limited(rise), self._dt
        self._acceleration = np.array([ax, ay, az])
        half = 0.5 * dt
        self._position = np.array([px + (vx + half * ax) * dt, py + (vy + half * ay) * dt, pz + (vz + half * az) * dt])
        self._velocity = np.array([vx + ax * dt, vy + ay * dt, vz + az * dt])
        return self._reference(feedback=True)


def _toward(p: float, v: float, goal: float, speed: float, duration: float) -> float:
    """Acceleration with which the way of least acceleration to a goal begins [m/s^2]."""
    return 6.0 * (goal - p) / duration**2 - (4.0 * v + 2.0 * speed) / duration


def _limited(asked: float) -> float:
    """The acceleration asked for, as far as it may be [m/s^2]; NaN of NaN."""
    return MOST_ACCELERATION if asked > MOST_ACCELERATION else max(asked, -MOST_ACCELERATION)
