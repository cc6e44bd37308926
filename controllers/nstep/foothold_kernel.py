"""The sums over edges behind a choice of a foothold, compiled; see `foothold` for what they are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.planar_kernel import FAR, clipped, nearest, tangents
from controllers.nstep.step_kernel import corners_of, tangents_of

Array = NDArray[np.float64]

SAME = 1e-8
"""Slacks this near [m] are one: above the accuracy of the solver."""


@compiled
def last_reach(box: Array, low: float, high: float, rows: Array, own: int) -> Array:
    """Right sides (6,) of y = lam p, p in a box (4,) and lam between the weights; its tangents go into the program.

    Args:
        box: of p.
        low, high: weights.
        rows: (., 5) of the program; the two across the box are written, or left zero if it holds the origin.
        own: rows before those of the feet.
    """
    reach = np.zeros(6)
    reach[0], reach[1], reach[2], reach[3] = box[2], box[3], -box[0], -box[1]
    for i in range(4):
        reach[i] *= high if reach[i] > 0.0 else low
    across = tangents_of(box)
    for i in range(len(across)):
        rows[own + 4 + i, 2], rows[own + 4 + i, 3] = across[i, 0], across[i, 1]
    return reach


@compiled
def landed(
    normals: Array,
    offsets: Array,
    dcm_x: float,
    dcm_y: float,
    more: bool,
    low: float,
    high: float,
    x: float,
    y: float,
    most: float,
    ample: bool,
    box: Array,
    wanted: Array,
) -> tuple[float, float, float]:
    """The foothold within a box, and the slack of the DCM at landing in the set that counts then.

    Args:
        normals, offsets: (J, 2), (J,) of that set, seen from lam times the foothold.
        dcm_x, dcm_y: DCM at landing, seen from the stance foot [m].
        more: whether steps follow; lam is 1 then.
        low, high: limits of lam if not.
        x, y: y = lam p of the program's optimum [m].
        most: its slack [m].
        ample: whether there are other y with that slack.
        box: (4,).
        wanted: (2,).
    """
    room = offsets - np.dot(normals, np.array([dcm_x, dcm_y]))
    if not more:
        x, y = last_foothold(normals, room - most, low, high, x, y, box, wanted, ample)
    x, y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    along = np.dot(normals, np.array([x, y]))
    return x, y, np.min(room + along) if more else best_between(room, along, low, high)


@compiled
def program_limits(
    growth: float,
    edges: Array,
    reach: Array,
    offsets: Array,
    normals: Array,
    free_x: float,
    free_y: float,
    margin: float,
) -> Array:
    """Right sides of the program of a foothold: those of the sole, of the feet, of the set and of the slack."""
    own, feet, rows = len(edges), len(reach), len(offsets)
    limits = np.empty(own + feet + rows + 1)
    limits[:own] = (growth - 1.0) * edges
    limits[own : own + feet] = reach
    limits[own + feet : -1] = offsets - np.dot(normals, np.array([free_x, free_y]))
    limits[-1] = margin
    return limits


@compiled
def last_foothold(
    normals: Array,
    room: Array,
    low: float,
    high: float,
    middle_x: float,
    middle_y: float,
    box: Array,
    wanted: Array,
    ample: bool,
) -> tuple[float, float]:
    """The foothold p of the box nearest to `wanted` with -normals lam p <= room for a lam between the weights.

    Args:
        normals, room: (J, 2), (J,) [m].
        low, high: weights, the limits of lam.
        middle_x, middle_y: one y = lam p.
        box: (4,) of p.
        wanted: (2,).
        ample: whether there are other y, the room not being that of the best.
    """
    x1, y1, x2, y2 = box
    x, y = wanted
    if ample and x1 <= x <= x2 and y1 <= y <= y2 and _suffices(room, np.dot(normals, wanted), low, high):
        return x, y
    if ample:
        feet = _cone(normals, room, low, high, box)
        if len(feet) > 0:
            return nearest(feet, x, y)
    # All 1 / lam that bring y into the box, and the best of them. Of y nothing is known below the accuracy of the
    # solver: a side of no width at 0 would otherwise exclude every lam by a y of 1e-20 across it.
    lower, upper = 1.0 / high, 1.0 / low
    for value, least, most in ((middle_x, x1, x2), (middle_y, y1, y2)):
        for part, bound in ((value + SAME, least), (SAME - value, -most)):
            # part / lam >= bound
            if part > 0.0:
                lower = max(lower, bound / part)
            elif part < 0.0:
                upper = min(upper, bound / part)
    middle = np.array([middle_x, middle_y])
    square = np.dot(middle, middle)
    factor = np.dot(middle, wanted) / square if square > 0.0 else lower
    factor = min(max(factor, lower), upper)
    return middle_x * factor, middle_y * factor


@compiled
def _suffices(room: Array, along: Array, low: float, high: float) -> bool:
    """Whether room + lam along >= 0 for a lam between the weights."""
    for i in range(len(room)):
        b, d = room[i], along[i]
        if d > 0.0:
            low = max(low, -b / d)
        elif d < 0.0:
            high = min(high, -b / d)
        elif b < 0.0:
            return False
    return low <= high


@compiled
def _cone(normals: Array, room: Array, low: float, high: float, box: Array) -> Array:
    """All p of a box with -normals lam p <= room for a lam between the weights; none if rounding leaves none."""
    inner = -normals
    points = clipped(corners_of(np.array([-FAR, -FAR, FAR, FAR])), inner, room + SAME)
    if len(points) == 0:
        return points
    across = tangents(points)
    first = len(across)
    cone, offsets = np.empty((first + len(inner), 2)), np.zeros(first + len(inner))
    cone[:first], cone[first:] = across, inner
    for j in range(len(inner)):
        most = -math.inf
        for i in range(len(points)):
            most = max(most, inner[j, 0] * points[i, 0] + inner[j, 1] * points[i, 1])
        offsets[first + j] = most / low if most > 0.0 else most / high
    return clipped(corners_of(box), cone, offsets)


@compiled
def best_between(room: Array, along: Array, low: float, high: float) -> float:
    """Largest of min(room + lam along) over lam between the weights."""
    best = max(np.min(room + low * along), np.min(room + high * along))
    for i in range(len(room)):
        for j in range(len(room)):
            # Where a falling line crosses a rising one.
            if along[i] > 0.0 > along[j]:
                lam = (room[j] - room[i]) / (along[i] - along[j])
                if low < lam < high:
                    best = max(best, np.min(room + lam * along))
    return best
