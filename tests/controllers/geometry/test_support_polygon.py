from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize

from controllers.geometry.support_polygon import EmptyPolygonError, Foot, SupportError, SupportPolygon, support_polygon

SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
place = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
yaw = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([0.0, 0.3, math.pi / 4, math.pi / 2]))
# Half soles to the side of another foot, and offsets [m] or turns [rad] around what a hull may drop.
along = st.sampled_from([-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0])
nearly = st.one_of(
    st.just(0.0), st.builds(lambda size, way: way * 10.0**size, st.floats(-12.0, -6.0), st.sampled_from([-1.0, 1.0]))
)


def foot(x: float, y: float, turn: float = 0.0) -> Foot:
    return Foot(position=np.array([x, y]), yaw=turn, sole=SOLE)


def test_aligned_feet_span_a_box() -> None:
    polygon = support_polygon([foot(0.0, 0.042), foot(0.0, -0.042)])
    assert len(polygon.vertices) == 4
    corners = {(0.0495, 0.078), (-0.0495, 0.078), (-0.0495, -0.078), (0.0495, -0.078)}
    assert {(round(x, 12), round(y, 12)) for x, y in polygon.vertices} == corners
    np.testing.assert_allclose(polygon.centre, 0.0, atol=1e-15)  # rounding
    assert {polygon.edge_name(i) for i in range(4)} == {"front", "left", "rear", "right"}


def test_staggered_feet_span_a_hexagon() -> None:
    polygon = support_polygon([foot(0.1, 0.042), foot(0.0, -0.042)])
    names = [polygon.edge_name(i) for i in range(len(polygon.v))]
    assert sorted(names) == sorted(["front", "left", "rear left", "rear", "right", "front right"])
    np.testing.assert_allclose(polygon.centre, [0.05, 0.0], atol=1e-15)  # point-symmetric; rounding


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4, -1.2, math.pi / 2, math.pi])
@pytest.mark.parametrize("gap", [0.0, 1e-12, 0.01, 0.072])
def test_soles_in_line_keep_their_corners(turn: float, gap: float) -> None:
    # Four points on each long edge: a chain that sorts by rounding loses a corner here.
    across = np.array([-math.sin(turn), math.cos(turn)]) * 0.5 * (0.072 + gap)
    polygon = support_polygon([foot(across[0], across[1], turn), foot(-across[0], -across[1], turn)])
    assert len(polygon.vertices) == 4
    half = np.array([0.0495, 0.072 + 0.5 * gap])
    turned = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    reach = np.abs(polygon.vertices @ turned.T)
    np.testing.assert_allclose(reach, np.tile(half, (4, 1)), rtol=0, atol=1e-9)  # points in line may go


def exact_area(points: np.ndarray) -> float:
    """Area of the convex hull, in rational numbers: no tolerance, no rounding."""
    exact = sorted({(Fraction(x), Fraction(y)) for x, y in points.tolist()})
    chains: list[list[tuple[Fraction, Fraction]]] = []
    for ordered in (exact, exact[::-1]):
        chain: list[tuple[Fraction, Fraction]] = []
        for p in ordered:
            while len(chain) > 1 and (chain[-1][0] - chain[-2][0]) * (p[1] - chain[-2][1]) <= (
                chain[-1][1] - chain[-2][1]
            ) * (p[0] - chain[-2][0]):
                chain.pop()
            chain.append(p)
        chains.append(chain[:-1])
    corners = chains[0] + chains[1]
    return float(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)) / 2)


def check_hull(feet: list[Foot]) -> None:
    polygon = support_polygon(feet)
    points = np.vstack([f.vertices for f in feet])
    # Points this close to an edge may be dropped.
    assert polygon.slacks(points).min() >= -1e-8
    assert all(np.abs(points - vertex).sum(axis=1).min() == 0.0 for vertex in polygon.vertices)
    x, y = polygon.vertices.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    # 1e-8 m around a perimeter below 1.5 m.
    assert area == pytest.approx(exact_area(points), abs=2e-8)


@settings(max_examples=300, deadline=None)
@given(place, yaw, place, yaw)
# The wrapping of the first hull missed its start here and went round twice, or stopped at a crossing.
@example((0.0, 0.1875), 0.0, (1e-9, 0.125), 1e-9)
@example((0.0, 0.125), 0.0, (1e-9, 0.0), 1e-9)
def test_hull_agrees_with_rationals(a: tuple[float, float], ya: float, b: tuple[float, float], yb: float) -> None:
    check_hull([foot(*a, ya), foot(*b, yb)])


@settings(max_examples=300, deadline=None)
@given(place, yaw, st.lists(st.tuples(along, along, nearly, nearly, nearly), min_size=1, max_size=2))
def test_hull_of_feet_nearly_in_line_or_on_one_another(
    a: tuple[float, float], ya: float, others: list[tuple[float, float, float, float, float]]
) -> None:
    feet = [foot(*a, ya)]
    for i, j, dx, dy, turn in others:
        c, s, x, y = math.cos(ya), math.sin(ya), i * 0.0495, j * 0.036
        feet.append(foot(a[0] + c * x - s * y + dx, a[1] + s * x + c * y + dy, ya + turn))
    check_hull(feet)


@settings(max_examples=100, deadline=None)
@given(place, yaw, place, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_slack_and_nearest(a: tuple[float, float], ya: float, b: tuple[float, float], x: float, y: float) -> None:
    polygon = support_polygon([foot(*a, ya), foot(*b)])
    u = np.array([x, y])
    assert polygon.slack(u) == pytest.approx(float(np.min(polygon.v - polygon.M @ u)), abs=1e-15)
    assert polygon.slack(u) == pytest.approx(float(polygon.slacks(u[None])[0]), abs=1e-15)
    assert polygon.contains(u) == (polygon.slack(u) >= 0.0)
    np.testing.assert_allclose(np.linalg.norm(polygon.M, axis=1), 1.0, rtol=1e-14)
    nearest = polygon.nearest(u)
    assert polygon.slack(nearest) >= -1e-15
    if polygon.contains(u):
        np.testing.assert_array_equal(nearest, u)
    else:
        # Optimality of a projection: no point of the polygon lies on u's side of the plane through `nearest`.
        assert float(np.max((polygon.vertices - nearest) @ (u - nearest))) <= 1e-15


def test_nearest_of_a_corner_and_an_edge() -> None:
    polygon = support_polygon([foot(0.0, 0.0)])
    np.testing.assert_array_equal(polygon.nearest((1.0, 1.0)), [0.0495, 0.036])
    np.testing.assert_allclose(polygon.nearest((0.01, -3.0)), [0.01, -0.036], atol=1e-15)
    projected = minimize(
        lambda p: float((p[0] - 0.2) ** 2 + (p[1] - 0.01) ** 2),
        [0.0, 0.0],
        bounds=[(-0.0495, 0.0495), (-0.036, 0.036)],
    ).x
    np.testing.assert_allclose(polygon.nearest((0.2, 0.01)), projected, atol=1e-6)  # the minimiser's tolerance


@settings(max_examples=100, deadline=None)
@given(place, yaw, place, st.floats(0.0, 0.03))
def test_shrunk_keeps_the_points_that_deep(a: tuple[float, float], ya: float, b: tuple[float, float], d: float) -> None:
    polygon = support_polygon([foot(*a, ya), foot(*b)])
    inner = polygon.shrunk(d)
    assert polygon.slacks(inner.vertices).min() == pytest.approx(d, abs=1e-9)  # points in line may go
    for direction in np.array([[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8], [0.8, -0.6]]):
        deep = linprog(-direction, A_ub=polygon.M, b_ub=polygon.v - d, bounds=(None, None))
        assert float(np.max(inner.vertices @ direction)) == pytest.approx(-deep.fun, abs=1e-7)  # HiGHS's tolerance


def test_shrunk_to_nothing_is_an_error() -> None:
    polygon = support_polygon([foot(0.0, 0.0)])
    assert polygon.shrunk(0.0) is polygon
    np.testing.assert_allclose(np.ptp(polygon.shrunk(0.0359).vertices, axis=0), [0.0272, 0.0002], atol=1e-12)
    for margin in (0.036, 0.05, 1.0):
        with pytest.raises(EmptyPolygonError, match="nothing is left"):
            polygon.shrunk(margin)
    for margin in (-0.001, math.nan):
        with pytest.raises(SupportError, match="margin"):
            polygon.shrunk(margin)


def test_moved_equals_built_there() -> None:
    shifted = support_polygon([foot(0.1, 0.042, 0.2), foot(0.0, -0.042)]).moved((0.3, -0.7))
    built = support_polygon([foot(0.4, -0.658, 0.2), foot(0.3, -0.742)])
    for name in ("vertices", "M", "v", "centre"):
        np.testing.assert_allclose(getattr(shifted, name), getattr(built, name), rtol=0, atol=1e-15)
    u = np.array([0.5, -0.6])
    assert shifted.slack(u) == pytest.approx(built.slack(u), abs=1e-15)
    np.testing.assert_allclose(shifted.nearest(u), built.nearest(u), rtol=0, atol=1e-15)
    with pytest.raises(SupportError, match="shifted"):
        shifted.moved((math.nan, 0.0))


@pytest.mark.parametrize("point", [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (0.0, -math.inf)])
def test_a_point_that_is_nowhere_is_outside(point: tuple[float, float]) -> None:
    polygon = support_polygon([foot(0.0, 0.0)])
    assert polygon.slack(point) == -math.inf
    assert not polygon.contains(point)
    with pytest.raises(SupportError, match="nearest"):
        polygon.nearest(point)


def test_impossible_shapes_are_refused() -> None:
    clockwise, flat = SOLE[::-1], np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    dent = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]])
    angles = np.arange(5) * 0.8 * math.pi
    twice_round = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    for vertices in (clockwise, flat, dent, twice_round, SOLE[:2], SOLE * math.nan):
        with pytest.raises(SupportError):
            SupportPolygon(vertices)
    with pytest.raises(SupportError, match="no foot"):
        support_polygon([])
    with pytest.raises(SupportError, match="finite position"):
        foot(math.nan, 0.0)
    with pytest.raises(SupportError, match="finite position"):
        foot(0.0, 0.0, math.inf)


def test_foot_turns_left_with_positive_yaw() -> None:
    turned = foot(1.0, 2.0, math.pi / 2)
    np.testing.assert_allclose(turned.vertices[0], [1.0 - 0.036, 2.0 + 0.0495], atol=1e-15)
    moved = turned.moved((0.0, 0.0))
    np.testing.assert_allclose(moved.vertices, turned.vertices - [1.0, 2.0], atol=1e-15)
