"""How large a push can be at all, and how much of that a set recovers from.

The no-step limit follows from the divergent component: without a step it must stay over the support polygon. With
steps it is Koolen's N-step capturability (2012): the DCM may be d_N from the stance foot's centre,

    d_0 = r,    d_N = r + (l + d_{N-1} - r) e^{-omega T}

for a foot that reaches r, steps no longer than l (centre to centre), and no step sooner than T after the last.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.delay import DelayedSet
from controllers.admissible.gain_bank import GainBank
from controllers.admissible.moa import MoaSet
from controllers.admissible.tracking_sets import TrackingSets
from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum
from models.errors import OkiagariError


class LimitError(OkiagariError):
    """A question about limits that has no answer."""


Region = Polytope | MoaSet | TrackingSets | DelayedSet | GainBank


def _unit(direction: ArrayLike) -> np.ndarray:
    """Unit vector (2,) of an angle [rad] from x to y, or of a vector (2,)."""
    given = np.asarray(direction, dtype=float)
    vector = np.array([math.cos(given), math.sin(given)]) if given.ndim == 0 else given
    length = float(np.linalg.norm(vector)) if vector.shape == (2,) else math.nan
    if not (math.isfinite(length) and length > 0.0):
        raise LimitError(f"a direction is an angle [rad] or a vector (2,) that is not zero, got {direction!r}")
    return vector / length


def no_step_limit(
    pendulum: Pendulum, polygon: SupportPolygon, direction: ArrayLike, position: ArrayLike | None = None
) -> float:
    """omega d [m/s]: the largest velocity from rest over `position` that any ZMP in the polygon can stop.

    Args:
        pendulum: gives omega.
        polygon: support polygon.
        direction: angle [rad] from x to y, or vector (2,).
        position: (2,) of the COG [m], inside the polygon; its centroid if None.

    Raises:
        LimitError: the position is not in the polygon, or there is no direction.
    """
    at = np.asarray(polygon.centre if position is None else position, dtype=float)
    if not polygon.contains(at):
        raise LimitError(f"the COG at {at.tolist()} m is not over the support polygon")
    toward = polygon.M @ _unit(direction)
    facing = toward > 0.0
    return pendulum.omega * float(((polygon.v - polygon.M @ at)[facing] / toward[facing]).min())


def capturability_steps(
    pendulum: Pendulum, foot_reach: float, longest_step: float, step_time: float, steps: int
) -> np.ndarray:
    """d_0, ..., d_N (steps + 1,) [m] by Koolen's recursion; arguments as `capturability`."""
    shrink = _shrink(pendulum, foot_reach, longest_step, step_time, steps)
    distances = [foot_reach]
    for _ in range(steps):
        distances.append(foot_reach + (longest_step + distances[-1] - foot_reach) * shrink)
    return np.array(distances)


def _shrink(pendulum: Pendulum, foot_reach: float, longest_step: float, step_time: float, steps: int) -> float:
    lengths = (foot_reach, longest_step, step_time)
    if not all(math.isfinite(v) and v >= 0.0 for v in lengths) or step_time == 0.0 or steps < 0:
        raise LimitError(f"reach, step length, step time (> 0) and steps must not be negative, got {(*lengths, steps)}")
    return math.exp(-pendulum.omega * step_time)


def recoverable_delta_v(region: Region, direction: ArrayLike, x: ArrayLike | None = None, phase: int = 0) -> float:
    """Largest sudden change of the COG velocity [m/s] in a direction that leaves the state in the set.

    Args:
        region: any set of states.
        direction: angle [rad] from x to y, or vector (2,).
        x: (4,) state before the push; if None rest at the centre of a regulator's set, or the referential state
            of the phase.
        phase: of tracking sets.

    Returns:
        The velocity, 0 if x is on the boundary, inf if the set has none in this direction.

    Raises:
        LimitError: x is not in the set, or is needed and not given.
    """
    if isinstance(region, GainBank):
        # A union: each set is star-shaped about the centre they share, so the farthest of them counts.
        state = region.x_C if x is None else np.asarray(x, dtype=float)
        members = [moa for moa in region.sets if moa.contains(state)]
        if not members:
            raise LimitError("the state before the push is in none of the sets of the bank")
        return max(recoverable_delta_v(moa, direction, state) for moa in members)
    ray = np.kron(_unit(direction), [0.0, 1.0])
    half_spaces, state = _half_spaces(region, phase, x)
    room, usage = half_spaces.a - half_spaces.S @ state, half_spaces.S @ ray
    # The boundary itself is in the set; its rounding is not worth an error.
    if not room.min() > -1e-12:
        raise LimitError(f"the state before the push is {-room.min():.3g} m outside the set")
    facing = usage > 0.0
    return float(np.maximum(room[facing] / usage[facing], 0.0).min(initial=np.inf))


def _half_spaces(
    region: Polytope | MoaSet | TrackingSets | DelayedSet, phase: int, x: ArrayLike | None
) -> tuple[Polytope, np.ndarray]:
    state = None
    if isinstance(region, MoaSet):
        known, state = region.in_world(), region.x_C
    elif isinstance(region, DelayedSet):
        known, state = region.after_rest(), region.x_C
    elif isinstance(region, TrackingSets):
        known, state = region.polytope(phase), region.reference.xi[phase]
    else:
        known = region
    if x is not None:
        state = np.asarray(x, dtype=float)
    if state is None:
        raise LimitError("give the state x before the push: this set has no centre of its own")
    return known, state
