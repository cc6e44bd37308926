"""The way of a foot through the air, re-aimed at every tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.interface import FootReference

Array = NDArray[np.float64]

APEX = 0.55  # share of the step at which the foot is highest
LANDING_SPEED = -0.15  # vertical speed with which the floor is expected, by a robot of scale 1 [m/s]
SEARCH_SPEED = -0.30  # and with which it is looked for once the step is late [m/s]
# A quintic over less than this would ask for any acceleration; from here on the foot coasts.
SHORTEST = 0.025


class SwingFoot:
    """Quintic motion of a sole from where it is to a foothold that may move while it flies."""

    def __init__(
        self, position: Array, yaw: float, duration: float, height: float, dt: float, speed: float = 1.0
    ) -> None:
        """Lift off.

        Args:
            position: (3,) where the sole is [m].
            yaw: its heading, kept [rad].
            duration: of the whole step [s].
            height: of the apex [m].
            dt: control period [s].
            speed: of the robot's scale.
        """
        self._landing_speed, self._search_speed = LANDING_SPEED * speed, SEARCH_SPEED * speed
        self._position = position.copy()
        self._velocity = np.zeros(3)
        self._acceleration = np.zeros(3)
        self._yaw = yaw
        self._duration = duration
        self._height = height
        self._dt = dt

    @property
    def position(self) -> Array:
        """(3,) where the reference is now [m]."""
        return self._position.copy()

    def see(self, position: Array) -> None:
        """Take notice of where the sole really is; this motion goes on from where it was to be.

        Args:
            position: (3,) one control period after the last one [m].
        """

    def advance(self, foothold: Array, time_left: float) -> FootReference:
        """Reference for the end of this tick.

        Args:
            foothold: (2,) where to land [m].
            time_left: until then [s]; 0 if the step is late.
        """
        for axis in (0, 1):
            if time_left > 2 * self._dt:
                self._aim(axis, float(foothold[axis]), 0.0, max(time_left, SHORTEST))
            else:
                self._coast(axis, 0.9 * float(self._velocity[axis]))
        to_apex = time_left - (1.0 - APEX) * self._duration
        if to_apex > 5 * self._dt:
            self._aim(2, self._height, 0.0, to_apex)
        elif time_left > 0.5 * self._dt:
            self._aim(2, 0.0, self._landing_speed, time_left)
        else:
            self._coast(2, self._search_speed)
        return self._reference(feedback=False)

    def _reference(self, *, feedback: bool) -> FootReference:
        return FootReference(
            stance=False,
            position=self._position.copy(),
            velocity=self._velocity.copy(),
            acceleration=self._acceleration.copy(),
            yaw=self._yaw,
            feedback=feedback,
        )

    def _aim(self, axis: int, goal: float, speed: float, duration: float) -> None:
        """One tick along the quintic to (goal, speed, 0) in `duration`."""
        # Plain floats: the same arithmetic on numpy's scalars takes several times as long.
        p, v, a = self._position.item(axis), self._velocity.item(axis), self._acceleration.item(axis)
        T, t = duration, min(self._dt, duration)
        gap = goal - (p + v * T + 0.5 * a * T * T)
        gap_v = speed - (v + a * T)
        c3 = (10 * gap - 4 * gap_v * T - 0.5 * a * T * T) / T**3
        c4 = (-15 * gap + 7 * gap_v * T + a * T * T) / T**4
        c5 = (6 * gap - 3 * gap_v * T - 0.5 * a * T * T) / T**5
        self._position[axis] = p + v * t + 0.5 * a * t * t + c3 * t**3 + c4 * t**4 + c5 * t**5
        self._velocity[axis] = v + a * t + 3 * c3 * t**2 + 4 * c4 * t**3 + 5 * c5 * t**4
        self._acceleration[axis] = a + 6 * c3 * t + 12 * c4 * t**2 + 20 * c5 * t**3

    def _coast(self, axis: int, speed: float) -> None:
        self._velocity[axis] = speed
        self._acceleration[axis] = 0.0
        self._position[axis] += speed * self._dt
