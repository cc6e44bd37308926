from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from controllers.geometry.linear_program import LinearProgram
from controllers.geometry.polytope import (
    EmptyPolytopeError,
    Polytope,
    PolytopeError,
    UnboundedPolytopeError,
    polygon_area,
)


def random_set(seed: int, rows: int = 80, n: int = 4, shift: float = 0.0) -> Polytope:
    rng = np.random.default_rng(seed)
    S = rng.normal(size=(rows, n)) * rng.choice([0.01, 1.0, 30.0], size=(rows, 1))
    a = np.linalg.norm(S, axis=1) * rng.uniform(0.5, 1.0, rows)
    return Polytope(S=S, a=a + S @ np.full(n, shift))


def is_redundant(S: np.ndarray, a: np.ndarray, row: int) -> bool:
    """By an LP of another make, over all other rows."""
    others = np.arange(len(a)) != row
    found = linprog(-S[row], A_ub=S[others], b_ub=a[others], bounds=(None, None))
    # 3 is "unbounded"; 1e-7 is the tolerance of linprog.
    return found.status != 3 and -found.fun <= a[row] + 1e-7 * abs(a[row])


def test_slack_and_contains_agree_with_the_rows_point_by_point() -> None:
    p = random_set(0)
    points = np.random.default_rng(1).normal(size=(3, 7_000, 4)) * 0.4
    slack = p.slack(points)
    assert slack.shape == (3, 7_000)
    for i, j in ((0, 0), (1, 3_333), (2, 6_999)):
        expected = min(p.a[r] - p.S[r] @ points[i, j] for r in range(len(p.a)))
        assert slack[i, j] == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(p.contains(points), slack >= 0.0)
    assert 0 < p.contains(points).mean() < 1
    assert not p.contains([np.nan, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_pruning_removes_exactly_the_redundant_rows(shift: float) -> None:
    p = random_set(2, shift=shift)
    kept = p.irredundant()
    redundant = [is_redundant(p.S, p.a, row) for row in range(len(p.a))]
    np.testing.assert_array_equal(kept, np.flatnonzero(np.logical_not(redundant)))
    assert 5 <= len(kept) < len(p.a)


def test_pruning_keeps_one_of_equal_rows_and_drops_infinite_ones() -> None:
    square = Polytope.box([-1.0, -1.0], [1.0, 1.0])
    p = square.intersect(square).intersect(Polytope(S=np.ones((1, 2)), a=np.array([np.inf])))
    kept = p.irredundant()
    assert len(kept) == 4
    assert Polytope(S=p.S[kept], a=p.a[kept]).area == pytest.approx(4.0, rel=1e-12)


def test_pruning_of_an_unbounded_set_goes_by_linear_programs() -> None:
    # A wedge with a redundant and a doubled row.
    S = np.array([[1.0, 1.0], [1.0, -1.0], [1.0, 0.0], [2.0, 2.0]])
    p = Polytope(S=S, a=np.array([1.0, 1.0, 5.0, 2.0]))
    assert not p.bounded()
    np.testing.assert_array_equal(p.irredundant(), [1, 3])
    strip = Polytope(S=np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0]]), a=np.array([1.0, 1.0, 2.0]))
    np.testing.assert_array_equal(strip.irredundant(), [0, 1])


def test_bounded_tells_a_box_from_a_slab() -> None:
    box = Polytope.box([-1.0, 2.0, 0.0], [1.0, 3.0, 9.0])
    assert box.bounded()
    assert not Polytope(S=box.S[:5], a=box.a[:5]).bounded()


def test_slice_is_the_set_with_the_other_coordinates_held() -> None:
    p = random_set(3)
    at = np.array([0.1, -0.1, 0.05, 0.0])
    cut = p.slice((3, 1), at)
    points = np.random.default_rng(4).normal(size=(2_000, 2)) * 0.5
    full = np.tile(at, (2_000, 1))
    full[:, 3], full[:, 1] = points[:, 0], points[:, 1]
    np.testing.assert_allclose(cut.slack(points), p.slack(full), atol=1e-12)
    assert p.slice((0, 1, 2), at).n == 3


@pytest.mark.parametrize("axes", [(0, 1), (2, 0), (1, 3)])
def test_projection_is_the_hull_of_the_projected_vertices(axes: tuple[int, int]) -> None:
    p = random_set(5, shift=0.5)
    outline = p.project(axes)
    hull = ConvexHull(p.vertices()[:, axes])
    # Two exact algorithms on the same 4-D set: rounding and the 1e-10 of the solver.
    assert polygon_area(outline) == pytest.approx(hull.volume, rel=1e-7)
    assert len(outline) == len(hull.vertices)


def test_projection_is_counter_clockwise_and_convex() -> None:
    outline = random_set(6).project((0, 1))
    ahead = np.roll(outline, -1, axis=0) - outline
    after = np.roll(ahead, -1, axis=0)
    assert (ahead[:, 0] * after[:, 1] - ahead[:, 1] * after[:, 0] > 0.0).all()


def test_vertices_of_a_polygon_are_in_order_and_enclose_its_area() -> None:
    # A triangle away from the origin, area by hand: base 4, height 3.
    p = Polytope(S=np.array([[0.0, -1.0], [3.0, 2.0], [-3.0, 2.0]]), a=np.array([-5.0, 31.0, 1.0]))
    corners = p.vertices()
    assert p.area == pytest.approx(6.0, rel=1e-12)
    assert polygon_area(corners) == pytest.approx(6.0, rel=1e-12)
    assert {tuple(c) for c in np.round(corners, 9)} == {(3.0, 5.0), (7.0, 5.0), (5.0, 8.0)}


def test_vertices_of_a_cube_are_eight() -> None:
    corners = Polytope.box([1.0, 1.0, 1.0], [2.0, 3.0, 4.0]).vertices()
    assert {tuple(c) for c in np.round(corners, 9)} == {
        (x, y, z) for x in (1.0, 2.0) for y in (1.0, 3.0) for z in (1.0, 4.0)
    }


def test_what_has_no_answer_is_refused_in_words() -> None:
    slab = Polytope(S=np.array([[1.0, 0.0], [-1.0, 0.0]]), a=np.ones(2))
    with pytest.raises(UnboundedPolytopeError, match=r"Polytope\.box"):
        slab.vertices()
    with pytest.raises(UnboundedPolytopeError, match="box"):
        slab.project((0, 1))
    nothing = Polytope.box([1.0, 1.0], [0.0, 0.0])
    assert nothing.bounded()
    for ask in (nothing.irredundant, nothing.vertices, lambda: nothing.project((0, 1))):
        with pytest.raises(EmptyPolytopeError):
            ask()
    with pytest.raises(EmptyPolytopeError, match="flat"):
        Polytope.box([0.0, 0.0], [0.0, 1.0]).vertices()
    with pytest.raises(PolytopeError, match="slice or project"):
        _ = random_set(7).area
    with pytest.raises(PolytopeError, match="NaN"):
        Polytope(S=np.eye(2), a=np.array([1.0, np.nan]))
    with pytest.raises(PolytopeError, match=r"\(r, n\)"):
        Polytope(S=np.eye(2), a=np.ones(3))


def test_linear_program_answers_warm_as_cold() -> None:
    p = random_set(8)
    program = LinearProgram(p.S, p.a)
    for direction in np.random.default_rng(9).normal(size=(30, 4)):
        cold = linprog(-direction, A_ub=p.S, b_ub=p.a, bounds=(None, None))
        assert direction @ program.maximise(direction) == pytest.approx(-cold.fun, rel=1e-7)
    program.drop(0)
    without = linprog(-p.S[0], A_ub=p.S[1:], b_ub=p.a[1:], bounds=(None, None))
    assert p.S[0] @ program.maximise(p.S[0]) == pytest.approx(-without.fun, rel=1e-7)
    program.restore(0)
    assert p.S[0] @ program.maximise(p.S[0]) <= p.a[0] * (1.0 + 1e-9)


def test_area_of_no_vertices_is_zero() -> None:
    assert polygon_area(np.empty((0, 2))) == 0.0
