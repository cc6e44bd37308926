"""How the floor's wrench on a body is shared by the soles that stand."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.multibody.elimination import factored, substitute, substitute_back

Array = NDArray[np.float64]

# By how much less a sole gives to a force [N] than to a moment [N m], as springs would: 1/m^2. The smaller, the more of
# the moment is left to moments of the soles; the larger, the more of it is borne by unlike forces of the two.
_GIVE = 2000.0
_PARALLEL = 1e-9


@compiled
def share_of_left(
    left: Array,
    right: Array,
    left_rotation: Array,
    right_rotation: Array,
    zmp: tuple[float, float],
    half_length: float,
    half_width: float,
) -> float:
    """What the left sole bears of the body when both stand, 0 to 1.

    The ZMP is a point on the line between the soles' middles, and an offset by which the centre of pressure of either
    sole is off its middle. Of all such points that is taken whose offset is smallest, measured in the soles' sizes, and
    inside the soles if there is one. Between parallel soles there is, for any ZMP in their convex hull. Sizes are along
    the mean heading of the soles, or the left one's if theirs are opposite; soles at one place bear half each.

    Args:
        left, right: (3,) middles of the soles [m].
        left_rotation, right_rotation: (3, 3) of the soles.
        zmp: [m].
        half_length, half_width: of a sole [m].
    """
    cos, sin = left_rotation[0, 0] + right_rotation[0, 0], left_rotation[1, 0] + right_rotation[1, 0]
    norm = math.sqrt(cos * cos + sin * sin)
    if norm < _PARALLEL:
        cos, sin = left_rotation[0, 0], left_rotation[1, 0]
        norm = math.sqrt(cos * cos + sin * sin)
    if norm > 0.0:
        cos, sin = cos / norm, sin / norm
    dx, dy, ex, ey = left[0] - right[0], left[1] - right[1], zmp[0] - right[0], zmp[1] - right[1]
    along, across = (cos * dx + sin * dy) / half_length, (cos * dy - sin * dx) / half_width
    u, v = (cos * ex + sin * ey) / half_length, (cos * ey - sin * ex) / half_width
    apart = along * along + across * across
    share = (u * along + v * across) / apart if apart != 0.0 else 0.5
    low, high = 0.0, 1.0
    for offset, step in ((u, along), (v, across)):
        if abs(step) > _PARALLEL:
            one, other = (offset - 1.0) / step, (offset + 1.0) / step
            low, high = max(low, min(one, other)), min(high, max(one, other))
    if low <= high:
        share = min(max(share, low), high)
    return min(max(share, 0.0), 1.0)


@compiled
def shared(local: Array, shares: Array) -> Array:
    """Factor U (6, 6) of the stiffness of the soles that stand, as springs between the base and the floor.

    With it the base's wrench w (6,) is held by the soles' wrenches of the least weighted squares: `wrench`.

    Args:
        local: (2, 6, 6 + n) Jacobians of the soles in their frames; the base's six columns count.
        shares: (2,) of the soles.
    """
    stiffness = np.zeros((6, 6))
    for side in range(2):
        if shares[side] > 0.0:
            for k in range(6):
                weight = shares[side] * (_GIVE if k < 3 else 1.0)
                for i in range(6):
                    factor = weight * local[side, k, i]
                    for j in range(i, 6):
                        stiffness[i, j] += factor * local[side, k, j]
    return factored(stiffness)


@compiled
def wrench(local: Array, shares: Array, U: Array, base: Array, wrenches: Array) -> None:
    """Write the soles' forces and moments (2, 6) in their frames [N, N m] that give the base its wrench (6,)."""
    give = base.copy()
    substitute(U, give)
    substitute_back(U, give)
    for side in range(2):
        for k in range(6):
            total = 0.0
            for i in range(6):
                total += local[side, k, i] * give[i]
            wrenches[side, k] = shares[side] * (_GIVE if k < 3 else 1.0) * total


@compiled
def by_base(local: Array, shares: Array, U: Array, parts: Array) -> Array:
    """Coefficients (6,) by which the base's wrench gives the sum of parts (2, 6) times the soles' wrenches."""
    u = np.zeros(6)
    for side in range(2):
        if shares[side] > 0.0:
            for k in range(6):
                factor = shares[side] * (_GIVE if k < 3 else 1.0) * parts[side, k]
                for i in range(6):
                    u[i] += factor * local[side, k, i]
    substitute(U, u)
    substitute_back(U, u)
    return u
