"""Boxes of footholds: where the foot in the air can land, seen from the stance foot."""

from __future__ import annotations

import numpy as np

from controllers.geometry.planar import supports
from controllers.nstep.step_kernel import corners_of
from models.robot import Side

AXES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])

# Lower and upper corner [m].
Box = tuple[tuple[float, float], tuple[float, float]]


def box_of(stance: Side, stride: float, narrow: float, wide: float) -> Box:
    """Footholds of the foot opposite to `stance`, as (lower, upper) corner [m]."""
    lateral = (narrow, wide) if stance == "right" else (-wide, -narrow)
    return (-stride, lateral[0]), (stride, lateral[1])


def within(box: Box, x: float, y: float, radius: float) -> Box:
    """The footholds of a box no farther than `radius` along each axis from (x, y), or those nearest to it."""
    (x1, y1), (x2, y2) = box
    left, right, below, above = x - radius, x + radius, y - radius, y + radius
    # Comparisons instead of min and max, which take four times as long.
    x1 = left if x1 < left else right if x1 > right else x1
    x2 = left if x2 < left else right if x2 > right else x2
    y1 = below if y1 < below else above if y1 > above else y1
    y2 = below if y2 < below else above if y2 > above else y2
    return (x1, y1), (x2, y2)


def union_offsets(box: Box, weights: tuple[float, float], normals: np.ndarray) -> np.ndarray:
    """Support function (J,) of the union of lam P over lam between the weights, P a box."""
    reach = box_supports(box, normals)
    return np.asarray(np.maximum(weights[0] * reach, weights[1] * reach))


def flat(box: Box) -> np.ndarray:
    """The box as (4,): lower, then upper corner."""
    return np.array(box[0] + box[1])


def box_supports(box: Box, normals: np.ndarray) -> np.ndarray:
    """Support function (J,) of a box."""
    return supports(corners_of(flat(box)), normals)
