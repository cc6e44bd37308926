"""Where a foot may land."""

from __future__ import annotations

import math
from dataclasses import dataclass

from controllers.reference.reference_program import PlanningError


@dataclass(frozen=True, kw_only=True, slots=True)
class StepLimits:
    """Where a foot may land, in the yaw frame of the stance foot.

    Attributes:
        max_stride: largest |dx| from the stance foot [m].
        min_width, max_width: lateral distance of the feet [m], to the foot's own side: never crossed.
        stance_width: natural lateral distance [m], kept where the state leaves the choice.
        swing_speed: largest mean horizontal speed of a foot in the air [m/s].
        swing_acceleration: largest horizontal acceleration of a foot that swings from rest to rest [m/s^2]; without
            one it is at full speed at once, as a foot is that swings already.
    """

    max_stride: float
    min_width: float
    max_width: float
    stance_width: float
    swing_speed: float
    swing_acceleration: float = math.inf

    def __post_init__(self) -> None:
        values = (self.max_stride, self.min_width, self.max_width, self.stance_width, self.swing_speed)
        ordered = 0.0 < self.min_width <= self.stance_width <= self.max_width
        quick = self.swing_speed > 0.0 and self.swing_acceleration > 0.0
        if not (all(map(math.isfinite, values)) and ordered and self.max_stride >= 0.0 and quick):
            raise PlanningError(f"step limits must be positive with min <= stance <= max width, got {self}")

    def swing_reach(self, time: float) -> float:
        """How far a foot swings from rest to rest in a time [s] at most [m].

        By its mean speed, or by half of the time speeding up and half of it braking.
        """
        reach = self.swing_speed * time
        # Infinity times a time of 0 is no number.
        if math.isinf(self.swing_acceleration):
            return reach
        return min(reach, 0.25 * self.swing_acceleration * time**2)
