"""The compiled polygons against those that are made of lists, also where rounding decides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.geometry import planar
from controllers.geometry.planar_kernel import clipped, length_of, nearest, tangents

SQUARE = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]


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


def test_clipping_is_that_of_lists() -> None:
    rng, empty, left = np.random.default_rng(3), 0, 0
    for _ in range(2000):
        normals, offsets = pieces(rng, int(rng.integers(1, 9)))
        expected = planar.clipped(SQUARE, zip(normals.tolist(), offsets.tolist(), strict=True))
        found = clipped(np.array(SQUARE), normals, offsets)
        assert [tuple(point) for point in found.tolist()] == expected
        empty += not expected
        left += bool(expected)
    assert empty > 100
    assert left > 100
    assert len(clipped(np.empty((0, 2)), normals, offsets)) == 0
    assert (clipped(np.array(SQUARE), np.empty((0, 2)), np.empty(0)) == SQUARE).all()


def test_tangents_are_those_of_lists() -> None:
    rng, none = np.random.default_rng(4), 0
    for _ in range(2000):
        normals, offsets = pieces(rng, 5)
        centre = np.array([rng.normal(), rng.choice([0.0, 1.0, rng.normal()])])
        points = clipped(np.array(SQUARE), normals, offsets) + centre
        if len(points):
            expected = planar.tangents([(x, y) for x, y in points.tolist()])
            assert [tuple(normal) for normal in tangents(points).tolist()] == expected
            none += not expected
    assert none > 100
