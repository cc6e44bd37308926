"""The compiled sums over edges against the expressions with numpy that they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.geometry.planar import supports
from controllers.geometry.planar_kernel import clipped, nearest, tangents
from controllers.nstep.box import Box, flat, union_offsets, within
from controllers.nstep.foothold_kernel import SAME, best_between, last_foothold, program_limits
from controllers.nstep.step_kernel import corners_of, last_slack, slacks_ahead, tangents_of
from controllers.nstep.step_sets import step_sets
from tests.controllers.nstep.stepping_plane import LIMITS, PENDULUM, SOLE

SETS = step_sets(PENDULUM, 1.5, SOLE, LIMITS, (0.2,), 4, edge=0.003)
WEIGHTS = SETS.tables.weights
# Sums of a few products of numbers below 1 [m], some units of the last place apart.
ROUNDING = 1e-14


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1019)


def some_box(rng: np.random.Generator) -> Box:
    """Of any kind: beside the x axis, on it, around it, or a single point."""
    x, y = rng.uniform(-0.3, 0.3, 2).tolist()
    return within(((-0.2, -0.05), (0.2, 0.1)), x, y, float(rng.choice([0.0, 0.02, 0.3])))


def test_a_box_has_the_tangents_of_its_corners(rng: np.random.Generator) -> None:
    counts = set()
    for _ in range(500):
        x, y = rng.uniform(-0.3, 0.3, 2).tolist()
        for box in (some_box(rng), ((x, y), (x + 0.1, y + 0.05)), ((0.0, y), (0.1, y + 0.1)), ((x, 0.0), (x, 0.0))):
            found, (x1, y1, x2, y2) = tangents_of(flat(box)), flat(box)
            corners = np.array([(x1, y1), (x2, y1), (x2, y2), (x1, y2)])
            assert (corners_of(flat(box)) == corners).all()
            np.testing.assert_allclose(found, tangents(corners), rtol=0.0, atol=ROUNDING)
            counts.add(len(found))
    assert counts == {0, 2}


@pytest.mark.parametrize("k", [0, 1, 17, 40])
def test_slacks_are_those_of_the_sums_written_out(k: int, rng: np.random.Generator) -> None:
    tables, table = SETS.tables, SETS.table("right", 0.2)
    decay = float(tables.decay[k])
    near, far = (weight * decay for weight in WEIGHTS)
    for _ in range(50):
        box, (x, y) = some_box(rng), rng.normal(0.0, 0.2, 2).tolist()
        offsets = decay * union_offsets(box, WEIGHTS, tables.normals) + tables.last[:, k]
        across = tangents_of(flat(box))
        lateral = supports(tables.outlines[:, :, k].T, across) - across @ (x, y)
        expected = np.concatenate((offsets - tables.normals @ (x, y), lateral)).min()
        found = last_slack(tables.normals, tables.last, tables.outlines, k, near, far, flat(box), x, y)
        assert found == pytest.approx(expected, abs=ROUNDING)
        ahead = np.empty(3)
        slacks_ahead(table.row, table.ahead, k, decay, flat(box), x, y, ahead)
        along = decay * supports(corners_of(flat(box)), table.normals) - table.normals @ (x, y)
        assert ahead == pytest.approx((table.ahead[:, :, k] + along[:, None]).min(axis=0), abs=ROUNDING)
    slacks_ahead(table.row, table.ahead, k, decay, flat(box), math.nan, y, ahead)
    assert np.isnan(ahead).all()
    assert math.isnan(last_slack(tables.normals, tables.last, tables.outlines, k, near, far, flat(box), math.nan, y))


def test_limits_of_the_program(rng: np.random.Generator) -> None:
    normals, free = rng.normal(size=(7, 2)), rng.normal(size=2)
    edges, reach, offsets = rng.normal(size=4), rng.normal(size=6), rng.normal(size=7)
    expected = np.concatenate((1.5 * edges, reach, offsets - normals @ free, (0.01,)))
    assert program_limits(2.5, edges, reach, offsets, normals, free[0], free[1], 0.01) == pytest.approx(
        expected, abs=ROUNDING
    )


def test_the_foothold_is_the_nearest_of_the_cone(rng: np.random.Generator) -> None:
    """The cone is the outline of lam p, divided by all lam, within the box."""
    (low, high), normals = WEIGHTS, SETS.tables.normals
    kept = projected = lost = 0
    for _ in range(1500):
        box, middle = some_box(rng), rng.uniform(-0.1, 0.1, 2)
        room = rng.uniform(-0.01, 0.08, len(normals)) - normals @ middle
        wanted = rng.uniform(-0.3, 0.3, 2)
        if rng.random() < 0.3:
            box, wanted = ((-0.3, -0.3), (0.3, 0.3)), middle / rng.uniform(low, high)
        found = last_foothold(normals, room, low, high, middle[0], middle[1], flat(box), wanted, True)
        (x1, y1), (x2, y2) = box
        within_box = x1 <= wanted[0] <= x2 and y1 <= wanted[1] <= y2
        shares = np.linspace(low, high, 2001)
        if within_box and (room[:, None] + np.outer(normals @ wanted, shares)).min(axis=0).max() >= 0.0:
            assert found == tuple(wanted)
            kept += 1
            continue
        points, inner = clipped(corners_of(np.array([-1e3, -1e3, 1e3, 1e3])), -normals, room + SAME), -normals
        if len(points):
            most = supports(points, inner)
            cone, across = np.maximum(most / low, most / high), tangents(points)
            offsets = np.concatenate((np.zeros(len(across)), cone))
            points = clipped(corners_of(flat(box)), np.vstack((across, inner)), offsets)
        if len(points):
            # The wanted foothold itself if 2001 lam were too few to see that one of them will do.
            options = nearest(points, *wanted.tolist()), tuple(wanted.tolist())
            # Sums in another order here: where edges nearly line up, a corner moves by more than their rounding.
            assert min(math.dist(found, option) for option in options) < 1e-9
            projected += 1
        else:
            # On the ray through the one y that is known.
            assert found[0] * middle[1] == pytest.approx(found[1] * middle[0], abs=ROUNDING)
            lost += 1
    assert min(kept, projected, lost) > 50


def test_the_best_share_of_a_line(rng: np.random.Generator) -> None:
    inner = 0
    for _ in range(300):
        room, along = rng.normal(size=6), rng.normal(size=6)
        shares = np.linspace(0.2, 0.9, 7001)
        values = (room[:, None] + np.outer(along, shares)).min(axis=0)
        best = best_between(room, along, 0.2, 0.9)
        # A step of 1e-4 along lines no steeper than some 4.
        assert values.max() - ROUNDING <= best <= values.max() + 4e-4
        inner += best > max(values[0], values[-1])
    assert inner > 20
