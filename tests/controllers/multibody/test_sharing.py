"""How soles share the floor's wrench, against sums by hand."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.geometry.rotation import turn
from controllers.multibody.sharing import by_base, share_of_left, shared, wrench

HALF_LENGTH, HALF_WIDTH = 0.05, 0.03
# Numbers of order ten through two triangular systems of a condition below 1e5.
ROUNDING = 1e-9


def share(left: np.ndarray, right: np.ndarray, zmp: np.ndarray, yaw: float = 0.0) -> float:
    R = turn(np.array([0.0, 0.0, yaw]))
    return share_of_left(left, right, R, R, tuple(zmp.tolist()), HALF_LENGTH, HALF_WIDTH)


@pytest.mark.parametrize("seed", range(20))
def test_a_zmp_in_the_hull_of_parallel_soles_keeps_both_centres_inside(seed: int) -> None:
    rng = np.random.default_rng(1000 + seed)
    yaw = rng.uniform(-3.0, 3.0)
    R = turn(np.array([0.0, 0.0, yaw]))
    left, right = R @ [rng.uniform(-0.2, 0.2), 0.12, 0.0], R @ [0.0, -0.05, 0.0]
    corners = [R @ [x, y, 0.0] for x in (-HALF_LENGTH, HALF_LENGTH) for y in (-HALF_WIDTH, HALF_WIDTH)]
    hull = np.array([middle + corner for middle in (left, right) for corner in corners])
    zmp = (rng.dirichlet(np.full(8, 0.3)) @ hull)[:2]
    by_left = share(left, right, zmp, yaw)
    offset = (R.T @ [*(zmp - by_left * left[:2] - (1.0 - by_left) * right[:2]), 0.0])[:2]
    assert 0.0 <= by_left <= 1.0
    assert (np.abs(offset) <= np.array([HALF_LENGTH, HALF_WIDTH]) + 1e-12).all()


def test_on_a_sole_or_beyond_it_bears_all() -> None:
    left, right = np.array([0.0, 0.06, 0.0]), np.array([0.0, -0.06, 0.0])
    assert share(left, right, np.array([0.01, 0.06])) == 1.0
    assert share(left, right, np.array([0.0, 0.3])) == 1.0
    assert share(left, right, np.array([0.0, -0.3])) == 0.0
    assert share(left, right, np.array([0.02, 0.0])) == pytest.approx(0.5)
    assert share(left, right, np.array([0.0, -0.03])) == pytest.approx(0.25)


def test_soles_at_one_place_bear_half_each() -> None:
    place = np.array([0.1, -0.2, 0.0])
    assert share(place, place, np.array([0.12, -0.2])) == 0.5
    assert share(place, place, np.array([3.0, 0.0])) == 0.5


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_soles_of_opposite_headings_share_by_the_left_one_s(yaw: float) -> None:
    R = turn(np.array([0.0, 0.0, yaw]))
    left, right, zmp = (R @ [x, y, 0.0] for x, y in ((0.03, 0.06), (0.0, -0.06), (0.01, 0.01)))
    # turned by half a turn to the last bit, and to rounding
    for other in (R @ np.diag([-1.0, -1.0, 1.0]), turn(np.array([0.0, 0.0, yaw + np.pi]))):
        found = share_of_left(left, right, R, other, tuple(zmp[:2].tolist()), HALF_LENGTH, HALF_WIDTH)
        assert found == pytest.approx(share(left, right, zmp[:2], yaw), abs=ROUNDING)


def test_soles_on_end_without_a_heading_bear_half_each() -> None:
    upright = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    left, right = np.array([0.0, 0.06, 0.0]), np.array([0.0, -0.06, 0.0])
    assert share_of_left(left, right, upright, upright, (0.0, 0.05), HALF_LENGTH, HALF_WIDTH) == 0.5


@pytest.fixture
def soles() -> np.ndarray:
    """Jacobians (2, 6, 6) of level soles at two places, in the frame of the base."""
    local = np.zeros((2, 6, 6))
    for side, place in enumerate(([0.05, 0.06, -0.3], [0.0, -0.06, -0.3])):
        x, y, z = place
        local[side, :3, :3] = local[side, 3:, 3:] = np.eye(3)
        local[side, :3, 3:] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return local


@pytest.mark.parametrize("shares", [(1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.9, 0.1)])
def test_the_soles_give_the_base_its_wrench(soles: np.ndarray, shares: tuple[float, float]) -> None:
    rng = np.random.default_rng(1001)
    base, found = rng.normal(0.0, 10.0, 6), np.empty((2, 6))
    U = shared(soles, np.array(shares))
    wrench(soles, np.array(shares), U, base, found)
    np.testing.assert_allclose(sum(soles[side].T @ found[side] for side in range(2)), base, rtol=0, atol=ROUNDING)
    for side in range(2):
        assert found[side].any() == (shares[side] > 0.0)
    parts = rng.normal(size=(2, 6))
    u = by_base(soles, np.array(shares), U, parts)
    assert u @ base == pytest.approx((parts * found).sum(), abs=ROUNDING)


def test_a_weight_over_the_line_between_is_shared_as_told(soles: np.ndarray) -> None:
    found, by_left = np.empty((2, 6)), 0.7
    shares = np.array([by_left, 1.0 - by_left])
    x, y = 0.05 * by_left, 0.06 * by_left - 0.06 * (1.0 - by_left)
    base = np.array([0.0, 0.0, 50.0, y * 50.0, -x * 50.0, 0.0])
    wrench(soles, shares, shared(soles, shares), base, found)
    np.testing.assert_allclose(found[:, 2], 50.0 * shares, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(found[:, 3:], 0.0, atol=ROUNDING)
