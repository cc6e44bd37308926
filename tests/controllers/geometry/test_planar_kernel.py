"""The compiled polygons against the crossings of all lines and the angles of all corners."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

from controllers.geometry.planar_kernel import clipped, length_of, nearest, tangents

SQUARE = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
SIDES = np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
# Some products and sums of numbers of size 1.
ROUNDING = 1e-14
# Nearer than this [m] to a line, rounding may decide on which side a point is.
CLEAR = 1e-9


@pytest.mark.parametrize(
    ("points", "of", "found"),
    [
        (SQUARE, (0.3, -0.2), (0.3, -0.2)),
        (SQUARE, (3.0, 0.5), (1.0, 0.5)),
        (SQUARE, (3.0, 4.0), (1.0, 1.0)),
        # Flat: a segment, there and back, and a point.
        ([(0.0, 0.0), (0.0, 1.0), (0.0, 1.0), (0.0, 0.0)], (0.0, 2.0), (0.0, 1.0)),
        ([(0.0, 0.0), (0.0, 1.0)], (3.0, 0.5), (0.0, 0.5)),
        ([(0.5, 0.5)], (0.0, 0.0), (0.5, 0.5)),
    ],
)
def test_nearest_point_of_a_polygon(
    points: list[tuple[float, float]], of: tuple[float, float], found: tuple[float, float]
) -> None:
    assert nearest(np.array(points), *of) == found


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e-9, 1e3])
def test_a_length_has_the_last_bit_of_python(scale: float) -> None:
    for x, y in (np.random.default_rng(5).normal(size=(20_000, 2)) * [1.0, scale]).tolist():
        assert length_of(x, y) == math.hypot(x, y)
    assert length_of(0.0, 0.0) == 0.0
    assert length_of(-3.0, 4.0) == 5.0
    assert length_of(math.inf, 1.0) == math.inf
    assert math.isnan(length_of(math.nan, 1.0))


def pieces(rng: np.random.Generator, half_planes: int) -> tuple[np.ndarray, np.ndarray]:
    """Random half-planes, some of them through a corner or along an edge of the square."""
    angles = rng.uniform(0.0, 2.0 * math.pi, half_planes)
    normals = np.column_stack((np.cos(angles), np.sin(angles)))
    offsets = rng.uniform(-0.2, 1.5, half_planes)
    corner = rng.integers(0, 4, half_planes)
    touching = rng.random(half_planes) < 0.3
    offsets[touching] = (normals * np.array(SQUARE)[corner]).sum(axis=1)[touching]
    along = rng.random(half_planes) < 0.1
    normals[along], offsets[along] = [0.0, 1.0], rng.choice([1.0, -1.0, 0.0])
    return normals, offsets


def crossings(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Where two of the lines, not nearly parallel, cross clearly inside of all others."""
    found = []
    for i, j in combinations(range(len(offsets)), 2):
        two, others = [i, j], np.delete(np.arange(len(offsets)), [i, j])
        if abs(np.linalg.det(normals[two])) > 1e-4:
            at = np.linalg.solve(normals[two], offsets[two])
            if (offsets[others] - normals[others] @ at > CLEAR).all():
                found.append(at)
    return np.array(found).reshape(-1, 2)


def test_clipping_leaves_the_crossings_within_all_lines() -> None:
    rng, empty, left, cut = np.random.default_rng(3), 0, 0, 0
    for _ in range(1000):
        normals, offsets = pieces(rng, int(rng.integers(1, 9)))
        found = clipped(np.array(SQUARE), normals, offsets)
        every, limits = np.vstack((SIDES, normals)), np.concatenate((np.ones(4), offsets))
        assert (found @ every.T <= limits + ROUNDING).all()
        expected = crossings(every, limits)
        for at in expected:
            # The rounding of two lines, over the least sine of their angle.
            assert np.hypot(*(found - at).T).min() <= ROUNDING / 1e-4
        ahead, behind = np.roll(found, -1, axis=0) - found, found - np.roll(found, 1, axis=0)
        assert (behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0] >= -ROUNDING).all()
        empty += len(found) == 0
        left += len(expected) > 0
        cut += len(expected) > 4
    assert min(empty, left, cut) > 50


def test_clipping_keeps_what_nothing_cuts_and_ends_with_nothing() -> None:
    square, one = np.array(SQUARE), np.array([[1.0, 0.0]])
    assert (clipped(square, np.empty((0, 2)), np.empty(0)) == SQUARE).all()
    assert (clipped(square, one, np.array([2.0])) == SQUARE).all()
    assert (clipped(square, one, np.array([1.0])) == SQUARE).all()
    half = clipped(square, one, np.array([0.5])).tolist()
    assert sorted(half) == [[-1.0, -1.0], [-1.0, 1.0], [0.5, -1.0], [0.5, 1.0]]
    assert len(clipped(square, np.vstack((one, one)), np.array([-2.0, 0.0]))) == 0
    assert len(clipped(np.empty((0, 2)), one, np.array([0.5]))) == 0


def test_tangents_touch_the_corners_of_extreme_angle() -> None:
    rng, around, beside = np.random.default_rng(4), 0, 0
    for _ in range(2000):
        normals, offsets = pieces(rng, 5)
        points = clipped(np.array(SQUARE), normals, offsets)
        if len(points) < 3:
            continue
        points += [rng.normal(), rng.choice([0.0, 1.0, rng.normal()])]
        found = tangents(points)
        ahead, middle = np.roll(points, -1, axis=0) - points, points.mean(axis=0)
        length = np.hypot(*ahead.T)
        if length.min() < 1e-6:
            continue
        depth = ((points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0]) / length).min()
        if depth > CLEAR:
            assert found.shape == (0, 2)
            around += 1
        elif depth < -CLEAR:
            # From the middle of the polygon, which the origin sees under less than half a turn.
            angles = np.arctan2(middle[0] * points[:, 1] - middle[1] * points[:, 0], points @ middle)
            left, right = np.arctan2(middle[1], middle[0]) + np.array((angles.max(), angles.min()))
            expected = [[-math.sin(left), math.cos(left)], [math.sin(right), -math.cos(right)]]
            # The rounding of a corner over its least distance from the origin here.
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11)
            beside += 1
        assert (points @ found.T <= CLEAR).all()
        np.testing.assert_allclose(np.hypot(*found.T), 1.0, rtol=1e-15)
    assert min(around, beside) > 50
    assert tangents(np.array(SQUARE)).shape == (0, 2)
    # The origin a corner: no direction leads there.
    assert tangents(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])).shape == (0, 2)
