"""Outline of a planar convex set that is only known by its support function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Sides of a triangle that are shorter than this share of the set are no sides.
_SAME = 1e-9


def outline(farthest: Callable[[np.ndarray], np.ndarray], scale: np.ndarray, accuracy: float) -> np.ndarray:
    """Vertices (n, 2), counter-clockwise, of a set from its farthest points.

    Each edge found is pushed outward until nothing lies beyond it by more than the accuracy; so every vertex
    belongs to the set, and the outline is inside it.

    Args:
        farthest: a point (2,) of the bounded set farthest along a direction (2,), exact.
        scale: (2,) unit in which each coordinate is looked at.
        accuracy: in those units.
    """

    def scaled(nx: float, ny: float) -> np.ndarray:
        return farthest(np.array([nx, ny]) / scale) / scale

    corners = [scaled(nx, ny) for nx, ny in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
    near = max(accuracy, _SAME * float(np.ptp(corners, axis=0).max()))
    found: list[np.ndarray] = []
    edges = [(corners[i], corners[(i + 1) % 4]) for i in (3, 2, 1, 0)]
    while edges:
        start, end = edges.pop()
        dx, dy = (end - start).tolist()
        length = float(np.hypot(dx, dy))
        if length <= near:
            # What is this short hides no more than its length; its start stands for both.
            if length > _SAME:
                found.append(start)
            continue
        corner = scaled(dy / length, -dx / length)
        if (dy * (corner[0] - start[0]) - dx * (corner[1] - start[1])) / length <= near:
            found.append(start)
        else:
            edges += [(corner, end), (start, corner)]
    return np.array(found).reshape(-1, 2) * scale
