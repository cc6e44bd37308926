"""Outline of a planar convex set that is only known by its support function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Sides that are shorter than this share of the set are no sides.
_SAME = 1e-9


def outline(farthest: Callable[[np.ndarray], np.ndarray], accuracy: float = 0.0) -> np.ndarray:
    """Vertices (n, 2), counter-clockwise, of a set from its farthest points.

    Each edge found is pushed outward until nothing lies beyond it by more than the accuracy; so every vertex
    belongs to the set, and the outline is inside it.

    Args:
        farthest: a point (2,) of the bounded set farthest along a direction (2,), exact.
        accuracy: in the set's own unit; 0 for every vertex.
    """
    corners = [farthest(np.array(way)) for way in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
    same = _SAME * float(np.ptp(corners, axis=0).max())
    near = max(accuracy, same)
    found: list[np.ndarray] = []
    edges = [(corners[i], corners[(i + 1) % 4]) for i in (3, 2, 1, 0)]
    while edges:
        start, end = edges.pop()
        dx, dy = (end - start).tolist()
        length = float(np.hypot(dx, dy))
        if length <= near:
            # What is this short hides no more than its length; its start stands for both.
            if length > same:
                found.append(start)
            continue
        normal = np.array([dy, -dx]) / length
        corner = farthest(normal)
        if normal @ (corner - start) <= near:
            found.append(start)
        else:
            edges += [(corner, end), (start, corner)]
    return np.array(found).reshape(-1, 2)
