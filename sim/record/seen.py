"""What the controllers saw in place of the true state, beside it in a trace, and how far off it was."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

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


class LoadedSoles(NamedTuple):
    """Middle of the soles, by the weight that each carries, as it is and as it is seen; all NaN in the air.

    Attributes:
        there_x, there_y: where it is [m].
        here_x, here_y: where it is seen [m].
        turn: of the soles from what is seen to what is [rad].
    """

    there_x: float
    there_y: float
    here_x: float
    here_y: float
    turn: float


def seen_row(truth: Observation, seen: Observation, soles: LoadedSoles, omega: float) -> tuple[float, ...]:
    """The values of `SEEN_CHANNELS`, then those of `SEEN_STANCE_CHANNELS`.

    Where the robot is in the world nobody can feel and no controller needs: errors are of positions relative to the
    soles that carry weight.
    """
    away_x, away_y = soles.here_x - soles.there_x, soles.here_y - soles.there_y
    x, y, z = seen.cog.tolist()
    vx, vy, vz = seen.cog_velocity.tolist()
    true_x, true_y, _ = truth.cog.tolist()
    true_vx, true_vy, _ = truth.cog_velocity.tolist()
    error_x = x - true_x - away_x + (vx - true_vx) / omega
    error_y = y - true_y - away_y + (vy - true_vy) / omega
    forces = (seen.feet[side].force for side in SIDES)
    return x, y, z, vx, vy, vz, error_x, error_y, _tilt(seen), *seen.zmp.tolist(), *forces


def _tilt(seen: Observation) -> float:
    """Angle between the trunk's z axis and the vertical [rad]; NaN if there is no trunk."""
    if not len(seen.configuration):
        return math.nan
    _, x, y, _ = seen.configuration[3:7].tolist()
    return 2.0 * math.asin(min(math.hypot(x, y), 1.0))


def in_the_world(point: Array, soles: LoadedSoles) -> tuple[float, float]:
    """A point on the floor (2,) that a controller means about the soles as it sees them, about them as they are [m].

    NaN in the air, where it means no place.
    """
    there_x, there_y, here_x, here_y, turn = soles
    x, y = point.tolist()
    dx, dy, cos, sin = x - here_x, y - here_y, math.cos(turn), math.sin(turn)
    return there_x + cos * dx - sin * dy, there_y + sin * dx + cos * dy


def away(truth: Observation, seen: Observation) -> Array:
    """How far (2,) the soles that carry weight are from where they are seen [m]; 0 in the air."""
    there_x, there_y, here_x, here_y, _ = loaded_soles(truth, seen)
    return np.nan_to_num(np.array([there_x - here_x, there_y - here_y]))


def loaded_soles(truth: Observation, seen: Observation) -> LoadedSoles:
    """Where the soles that carry weight are, and where they are seen."""
    total = there_x = there_y = here_x = here_y = turn = 0.0
    for side in SIDES:
        there, here = truth.feet[side], seen.feet[side]
        force = there.force
        total += force
        there_x += force * float(there.position[0])
        there_y += force * float(there.position[1])
        here_x += force * float(here.position[0])
        here_y += force * float(here.position[1])
        turn += force * math.remainder(there.yaw - here.yaw, math.tau)
    if total <= 0.0:
        return LoadedSoles(math.nan, math.nan, math.nan, math.nan, math.nan)
    return LoadedSoles(there_x / total, there_y / total, here_x / total, here_y / total, turn / total)


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
