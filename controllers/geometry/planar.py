"""Convex polygons of the plane: by their corners, and by the offsets of their edges along fixed normals.

Along fixed normals Minkowski sums are plain sums.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from operator import itemgetter

import numpy as np

from controllers.geometry.planar_kernel import FAR, SHORT, clipped
from models.errors import OkiagariError

# Points no farther than this [m] from a line are on it: a million times the rounding of a metre, far below a sole.
COLLINEAR = 1e-9
# Normals (unit vectors) that agree to this are one: a nanoradian moves no edge of a sole by more than its rounding.
_SAME = 1e-9

Points = list[tuple[float, float]]


class EmptyPlanarError(OkiagariError):
    """Half-planes that share no area."""


def fan(*normals: np.ndarray) -> np.ndarray:
    """All different unit normals (J, 2) of the arrays (., 2) given, by their angle."""
    every = np.concatenate(normals)
    every = every / np.hypot(every[:, 0], every[:, 1])[:, None]
    every = every[np.argsort(np.arctan2(every[:, 1], every[:, 0]), kind="stable")]
    kept = [every[0]]
    for normal in every[1:]:
        if np.abs(normal - kept[-1]).max() > _SAME and np.abs(normal - kept[0]).max() > _SAME:
            kept.append(normal)
    return np.array(kept)


def supports(vertices: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Support function (J,) of the hull of vertices (n, 2) along normals (J, 2)."""
    return np.asarray((vertices @ normals.T).max(axis=0))


def edge_lengths(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Lengths (..., J) of the edges with offsets (..., J) along a `fan`, negative where an edge is cut off.

    Offsets are a support function exactly if none is negative.
    """
    ahead = np.roll(normals, -1, axis=0)
    cosine = (normals * ahead).sum(axis=1)
    sine = normals[:, 0] * ahead[:, 1] - normals[:, 1] * ahead[:, 0]
    following = (np.roll(offsets, -1, axis=-1) - offsets * cosine) / sine
    before = (np.roll(offsets, 1, axis=-1) - offsets * np.roll(cosine, 1)) / np.roll(sine, 1)
    return np.asarray(following + before)


def tightened(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Support function (J,) of {x : normals x <= offsets}, which offsets may overstate.

    Raises:
        EmptyPlanarError: the half-planes share no area.
    """
    if edge_lengths(normals, offsets).min() >= 0.0 and (offsets + offsets[_opposite(normals)]).min() > 0.0:
        return offsets
    return supports(corners(normals, offsets), normals)


def _opposite(normals: np.ndarray) -> np.ndarray:
    return np.argmin(normals @ normals.T, axis=1)


def corners(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Vertices (n, 2), counter-clockwise, of the bounded {x : normals x <= offsets}.

    Raises:
        EmptyPlanarError: the half-planes share no area.
    """
    square = np.array([[-FAR, -FAR], [FAR, -FAR], [FAR, FAR], [-FAR, FAR]])
    points = clipped(square, normals, offsets).tolist()
    # A corner that two clips found twice is one.
    distinct = [p for i, p in enumerate(points) if math.dist(p, points[i - 1]) > SHORT]
    if len(distinct) < 3:
        raise EmptyPlanarError("the half-planes share no area")
    return np.array(distinct)


def hull(points: Iterable[tuple[float, float]]) -> Points:
    """Convex hull of one point or more, counter-clockwise from the lowest of the leftmost; under three if it is flat.

    Every corner is one of the points and farther than `COLLINEAR` from the line through its neighbours; a point that
    was left out may be so far, times the number of points, beyond the edges.
    """
    ordered = sorted(points)
    # Corners that rounding alone sets apart would be kept, were they not dropped afterwards. To leave them out while
    # the chains grow is not sound: points nearly in line, or nearly one, may then hide a corner or be met twice.
    chain = _half_hull(ordered)
    chain.pop()
    ordered.reverse()
    chain += _half_hull(ordered)
    chain.pop()
    while len(chain) > 2:
        least, flattest = math.inf, 0
        (ax, ay), (bx, by) = chain[-2], chain[-1]
        for i, (cx, cy) in enumerate(chain, -1):
            turn = (bx - ax) * (cy - by) - (by - ay) * (cx - bx)
            across = math.sqrt((cx - ax) * (cx - ax) + (cy - ay) * (cy - ay))
            # A flat hull goes there and back.
            height = turn / across if across > 0.0 else 0.0
            if height < least:
                least, flattest = height, i
            ax, ay, bx, by = bx, by, cx, cy
        if least > COLLINEAR:
            break
        del chain[flattest]
    left = min(chain)[0] + COLLINEAR
    start = chain.index(min([point for point in chain if point[0] <= left], key=itemgetter(1)))
    return chain[start:] + chain[:start]


def _half_hull(ordered: Points) -> Points:
    """Corners from the first to the last of points in order, the hull to the left of the way."""
    chain: Points = []
    for x, y in ordered:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            if (bx - ax) * (y - by) - (by - ay) * (x - bx) > 0.0:
                break
            chain.pop()
        chain.append((x, y))
    return chain
