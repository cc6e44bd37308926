from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.geometry.planar import (
    EmptyPlanarError,
    corners,
    edge_lengths,
    fan,
    supports,
    tightened,
)
from controllers.geometry.polytope import Polytope

AXES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def test_a_fan_has_each_normal_once_by_its_angle() -> None:
    around = math.pi * (1.0 - 1e-12)
    twice = np.array([[2.0, 0.0], [1.0, 1e-12], [math.cos(around), math.sin(around)]])
    normals = fan(AXES, twice, -AXES)
    assert len(normals) == 4
    np.testing.assert_allclose(np.hypot(*normals.T), 1.0, rtol=1e-12)
    assert (np.diff(np.unwrap(np.arctan2(normals[:, 1], normals[:, 0]))) > 0.0).all()


def test_offsets_are_tight_exactly_if_no_edge_is_negative() -> None:
    rng = np.random.default_rng(1)
    for _ in range(30):
        normals = fan(AXES, rng.normal(size=(5, 2)))
        offsets = rng.uniform(0.5, 1.0, len(normals))
        tight = tightened(normals, offsets)
        assert (tight <= offsets + 1e-12).all()
        assert edge_lengths(normals, tight).min() > -1e-12
        assert (edge_lengths(normals, offsets).min() >= 0.0) == np.allclose(tight, offsets, rtol=0, atol=1e-12)
        expected = supports(Polytope(S=normals, a=offsets).vertices(), normals)
        np.testing.assert_allclose(tight, expected, rtol=0, atol=1e-9)
        points = corners(normals, tight)
        length = np.hypot(*(np.roll(points, -1, axis=0) - points).T).sum()
        assert edge_lengths(normals, tight).sum() == pytest.approx(length, abs=1e-9)


def test_half_planes_without_area_are_told() -> None:
    for offsets in ([1.0, 1.0, -2.0, 1.0], [1.0, 1.0, -1.0, 1.0], [-1.0, -1.0, -1.0, -1.0]):
        with pytest.raises(EmptyPlanarError):
            tightened(AXES, np.array(offsets))
