"""What the references of a library differ by."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.arena import SIDES, Side
from models.errors import OkiagariError


class LibraryError(OkiagariError):
    """A library cannot be planned as asked, or was asked for something that is no state."""


@dataclass(frozen=True, kw_only=True)
class LibraryGrid:
    """What the references differ by; every combination that can be planned is one.

    Attributes:
        directions: where the foot lands from where it stood, 0 forward, 90 left [deg].
        lengths: how far [m].
        step_times: durations of the step [s].
        speeds: initial speeds of the COG along the direction [m/s].
        swings: feet that step.
    """

    directions: tuple[float, ...] = (0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0)
    lengths: tuple[float, ...] = (0.0, 0.05, 0.1, 0.15)
    step_times: tuple[float, ...] = (0.25, 0.3)
    speeds: tuple[float, ...] = (0.0, 0.1, 0.2, 0.3, 0.4)
    swings: tuple[Side, ...] = SIDES

    def __post_init__(self) -> None:
        for name in ("directions", "lengths", "step_times", "speeds", "swings"):
            values = getattr(self, name)
            if not values:
                raise LibraryError(f"a library needs at least one of its {name}")
            if name == "swings":
                if not set(values) <= set(SIDES):
                    raise LibraryError(f"swings must be of {SIDES}, got {values!r}")
            elif not all(map(math.isfinite, values)):
                raise LibraryError(f"{name} must be finite, got {values!r}")
        if min(self.lengths) < 0.0 or min(self.step_times) <= 0.0:
            raise LibraryError("lengths must not be negative and step times must be positive")

    def combinations(self) -> list[tuple[Side, float, np.ndarray, np.ndarray]]:
        """Swing foot, step time, way of the foot (2,) [m], initial velocity (2,) [m/s], none twice."""
        found: dict[tuple[Side, float, bytes], tuple[Side, float, np.ndarray, np.ndarray]] = {}
        for swing in self.swings:
            for time in self.step_times:
                for direction in self.directions:
                    angle = math.radians(direction)
                    ahead = np.round([math.cos(angle), math.sin(angle)], 15)
                    for length in self.lengths:
                        for speed in self.speeds:
                            way, velocity = length * ahead + 0.0, speed * ahead + 0.0
                            key = (swing, time, way.tobytes() + velocity.tobytes())
                            found.setdefault(key, (swing, time, way, velocity))
        return list(found.values())
