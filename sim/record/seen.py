"""What the controllers saw in place of the true state, beside it in a trace, and how far off it was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Observation
from models.arena import SIDES
from sim.record.trace import Trace

Array = NDArray[np.float64]

_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class SightError:
    """Error of the DCM that was seen, about the loaded soles, from the first push on and until a fall.

    Attributes:
        rms: root of the mean square of its length [m].
        peak: the greatest length [m].
    """

    rms: float
    peak: float


def seen_row(truth: Observation, seen: Observation, omega: float) -> tuple[float, ...]:
    """The eight values of `SEEN_CHANNELS`.

    Where the robot is in the world nobody can feel and no controller needs: errors are of positions relative to the
    soles that carry weight.
    """
    total, shift_x, shift_y = 0.0, 0.0, 0.0
    for side in SIDES:
        there, here = truth.feet[side], seen.feet[side]
        total += there.force
        shift_x += there.force * float(here.position[0] - there.position[0])
        shift_y += there.force * float(here.position[1] - there.position[1])
    away_x, away_y = (shift_x / total, shift_y / total) if total > 0.0 else (math.nan, math.nan)
    x, y, z = seen.cog.tolist()
    vx, vy, vz = seen.cog_velocity.tolist()
    true_x, true_y, _ = truth.cog.tolist()
    true_vx, true_vy, _ = truth.cog_velocity.tolist()
    error_x = x - true_x - away_x + (vx - true_vx) / omega
    error_y = y - true_y - away_y + (vy - true_vy) / omega
    return x, y, z, vx, vy, vz, error_x, error_y


def seen_cog(cog: Array, velocity: Array, seen: Array, omega: float) -> Array:
    """COG as it was seen, about the loaded soles as they are: what is left of the DCM's error without the velocity's.

    Args:
        cog: (..., 3) true [m].
        velocity: (..., 2) of the COG, true [m/s].
        seen: (..., 8) values of `SEEN_CHANNELS`.
        omega: of the robot [1/s].

    Returns:
        (..., 3) [m].
    """
    place = cog[..., :2] + seen[..., 6:8] - (seen[..., 3:5] - velocity) / omega
    return np.concatenate([place, seen[..., 2:3]], axis=-1)


def sight_error(trace: Trace, until: float | None) -> SightError | None:
    """How far off the controllers were.

    Args:
        trace: of the episode.
        until: when it fell [s]; None if it did not.

    Returns:
        None if they saw the true state, or there was no push.
    """
    pushes = trace.metadata["scenario"].get("pushes", [])
    if "dcm_error_x" not in trace.units or not pushes:
        return None
    during = trace.time >= pushes[0]["start"] - _ROUNDING
    if until is not None:
        during &= trace.time < until
    error = np.hypot(trace["dcm_error_x"][during], trace["dcm_error_y"][during])
    error = error[np.isfinite(error)]
    return SightError(rms=float(np.sqrt(np.mean(error**2))), peak=float(error.max())) if len(error) else None
