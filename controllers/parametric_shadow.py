"""Projection of a lifted polytope on a few linear functions of the state, as plain rows."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from controllers.polytope import EmptyPolytopeError, Polytope, PolytopeError, projection

# Below this share of the width a facet has been found.
_EXACT = 1e-9
# Facets whose normals agree to these digits are one.
_DIGITS = 9
_MOST_POINTS = 2000


def shadow(lifted: Polytope, output: np.ndarray) -> Polytope:
    """Rows S x <= a - s of {(x, s) : some z has (x, z, s) in the lifted set}.

    Every facet of the hull of the points found so far is pushed outward until nothing lies beyond it.

    Args:
        lifted: set in (x (4,), z, s) with s >= 0; x enters its rows through `output` x only.
        output: (d, 4) of full rank.

    Returns:
        set of x; its slack is the largest s as far as that is not negative.

    Raises:
        EmptyPolytopeError: the projection has no inside.
        UnboundedPolytopeError: it is unbounded.
        PolytopeError: it has too many corners.
    """
    dim = len(output)
    back = np.linalg.pinv(output)
    S = np.column_stack((lifted.S[:, :4] @ back, lifted.S[:, 4:]))
    farthest = projection(S, lifted.a, [*range(dim), S.shape[1] - 1])
    eye = np.eye(dim + 1)
    corners = np.array([[1.0 if i >> j & 1 else -1.0 for j in range(dim + 1)] for i in range(2 ** (dim + 1))])
    points = np.array([farthest(direction) for direction in (*eye, *-eye, *corners)])
    # Coordinates in shares of the set's width, so that rounding means the same along each.
    width = np.ptp(points, axis=0)
    if not width.min() > _EXACT:
        raise EmptyPolytopeError("the projection is flat")
    points /= width
    settled: set[tuple[float, ...]] = set()
    while True:
        # Corners that are found twice, up to rounding, are what Qhull stumbles over.
        points = points[np.unique(np.round(points / _EXACT), axis=0, return_index=True)[1]]
        try:
            hull = ConvexHull(points)
        except QhullError as error:
            raise EmptyPolytopeError("the projection is flat") from error
        facets = {tuple(np.round(row[:-1], _DIGITS).tolist()): row for row in hull.equations}
        beyond = []
        for key, row in facets.items():
            if key in settled:
                continue
            point = farthest(row[:-1] / width) / width
            if row[:-1] @ point + row[-1] > _EXACT:
                beyond.append(point)
            else:
                settled.add(key)
        if not beyond:
            break
        points = np.vstack((points, beyond))
        if len(points) > _MOST_POINTS:
            raise PolytopeError(f"the projection has more than {_MOST_POINTS} corners")
    rows = np.array(list(facets.values()))
    rows[:, :-1] /= width
    # Without s there is only the floor s >= 0: each row with the state comes from one with slack.
    rows = rows[rows[:, dim] > _EXACT]
    return Polytope(S=rows[:, :dim] @ output / rows[:, dim : dim + 1], a=-rows[:, -1] / rows[:, dim])
