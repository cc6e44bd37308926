"""The compiled slacks against numpy's expression, at the edges of what they are asked."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from controllers.geometry.polytope import Polytope
from controllers.geometry.slack_kernel import (
    first_with,
    least_of_each,
    least_slack,
    slack_in_any,
    smallest,
    table_of,
)

# Sums of four products of numbers of size 1 in another order: some units of the last place.
ROUNDING = 1e-14


def plainly(S: np.ndarray, a: np.ndarray, x: np.ndarray) -> np.ndarray:
    """min(a - S x) of each point of x (..., n), with numpy."""
    return np.min(a - x @ S.T, axis=-1, initial=np.inf)


def one_by_numpy(S: np.ndarray, a: np.ndarray, x: np.ndarray) -> float:
    """What a query of one state was before it was compiled."""
    slack = a - np.dot(x, np.ascontiguousarray(S.T))
    return float(slack.item(slack.argmin()))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1016)


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 6, 8, 31, 132, 642])
def test_one_state(rows: int, rng: np.random.Generator) -> None:
    for _ in range(50):
        S, a, x = rng.normal(size=(rows, 4)), rng.uniform(-1.0, 2.0, rows), rng.normal(size=4)
        assert least_slack(table_of(S, a), x) == pytest.approx(one_by_numpy(S, a, x), rel=0.0, abs=ROUNDING)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("points", [1, 255, 256, 257, 1000])
def test_many_states_of_any_dimension(n: int, points: int, rng: np.random.Generator) -> None:
    S, a, x = rng.normal(size=(40, n)), rng.uniform(-1.0, 2.0, 40), rng.normal(size=(points, n))
    a[3] = np.inf
    np.testing.assert_allclose(Polytope(S=S, a=a).slack(x), plainly(S, a, x), rtol=0.0, atol=ROUNDING)


def test_states_in_any_layout_have_the_same_bits(rng: np.random.Generator) -> None:
    polytope = Polytope(S=rng.normal(size=(40, 4)), a=rng.uniform(1.0, 2.0, 40))
    x = rng.normal(size=(600, 4))
    expected = polytope.slack(x)
    for other in (np.asfortranarray(x), x[::-1][::-1], x.reshape(20, 30, 4)):
        assert (polytope.slack(other).ravel() == expected).all()
    assert (polytope.slack(x.tolist()) == expected).all()
    one_by_one = [polytope.slack(point) for point in x]
    assert (np.array(one_by_one) == expected).all()


def test_a_point_on_a_face_is_inside_and_the_next_number_is_not() -> None:
    box = Polytope.box([-1.0, -1.0, -1.0, -1.0], [1.0, 1.0, 1.0, 1.0])
    on, beyond = np.array([1.0, 0.0, 0.0, 0.0]), np.array([np.nextafter(1.0, 2.0), 0.0, 0.0, 0.0])
    table = table_of(box.S, box.a)
    assert box.slack(on) == least_slack(table, on) == 0.0
    assert box.contains(on)
    assert not box.contains(beyond)
    assert least_slack(table, beyond) < 0.0


def test_an_empty_set_holds_nothing_and_one_without_rows_everything(rng: np.random.Generator) -> None:
    x = rng.normal(size=(300, 4))
    empty = Polytope(S=np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]]), a=np.array([-1.0, -1.0]))
    assert not empty.contains(x).any()
    everything = Polytope(S=np.zeros((0, 4)), a=np.zeros(0))
    assert (everything.slack(x) == np.inf).all()
    assert everything.contains(x).all()
    never = Polytope(S=np.ones((1, 4)), a=np.array([np.inf]))
    assert (never.slack(x) == np.inf).all()


@pytest.mark.parametrize("n", [2, 4])
def test_a_state_that_is_no_number_is_in_no_set_and_spoils_no_other(n: int, rng: np.random.Generator) -> None:
    S, a, x = rng.normal(size=(9, n)), rng.uniform(1.0, 2.0, 9), 0.1 * rng.normal(size=(300, n))
    x[7, 0], x[280] = np.nan, np.nan
    found = Polytope(S=S, a=a).slack(x)
    assert np.isnan(found[[7, 280]]).all()
    others = np.delete(np.arange(300), [7, 280])
    np.testing.assert_allclose(found[others], plainly(S, a, x[others]), rtol=0.0, atol=ROUNDING)
    assert not Polytope(S=S, a=a).contains(x)[[7, 280]].any()


def test_an_infinite_state_is_as_far_outside_as_numpy_says(rng: np.random.Generator) -> None:
    S, a = np.abs(rng.normal(size=(9, 4))), rng.uniform(1.0, 2.0, 9)
    far = np.array([[np.inf, 0.0, 0.0, 0.0], [-np.inf, 1.0, 1.0, 1.0], [np.inf, -np.inf, 0.0, 0.0]])
    np.testing.assert_array_equal(Polytope(S=S, a=a).slack(far), [-np.inf, np.inf, np.nan])
    start, out = np.array([0, 4, 9]), np.empty(2)
    least_of_each(table_of(S, a), start, far[2], out)
    assert np.isnan(out).all()


@pytest.mark.parametrize("counts", [(1,), (3, 1, 4), (48,) * 20, (7, 130, 2, 55)])
def test_each_of_many_sets(counts: tuple[int, ...], rng: np.random.Generator) -> None:
    start = np.concatenate(([0], np.cumsum(counts)))
    S, a = rng.normal(size=(start[-1], 4)), rng.uniform(-1.0, 2.0, start[-1])
    for _ in range(20):
        x, out = rng.normal(size=4), np.empty(len(counts))
        least_of_each(table_of(S, a), start, x, out)
        expected = [plainly(S[i:j], a[i:j], x) for i, j in pairwise(start.tolist())]
        np.testing.assert_allclose(out, expected, rtol=0.0, atol=ROUNDING)
    x[2] = np.nan
    least_of_each(table_of(S, a), start, x, out)
    assert np.isnan(out).all()


def test_several_sets_answer_as_each_of_them(rng: np.random.Generator) -> None:
    sizes = ((6, 0.3), (8, 0.6), (132, 1.2))
    sets = [(rng.normal(size=(rows, 4)), rng.uniform(size, 2.0 * size, rows)) for rows, size in sizes]
    tables, rows = np.concatenate([table_of(*one).ravel() for one in sets]), np.array([6, 8, 132])
    chosen = set()
    for _ in range(300):
        x = 0.3 * rng.normal(size=4)
        slacks = [least_slack(table_of(*one), x) for one in sets]
        assert slack_in_any(tables, rows, x) == max(slacks)
        for present in (-1, 0, 1, 2):
            holding = [k for k, slack in enumerate(slacks) if slack >= (0.0 if k == present else 0.1)]
            first = first_with(tables, rows, x, present, 0.1)
            assert first == (holding[0] if holding else -1)
            chosen.add(first)
    assert chosen == {-1, 0, 1, 2}
    assert np.isnan(slack_in_any(tables, rows, np.full(4, np.nan)))
    assert first_with(tables, rows, np.full(4, np.nan), -1, 0.1) == -1


def test_the_smallest_number() -> None:
    assert smallest(np.array([2.0, -1.0, 3.0])) == -1.0
    assert smallest(np.array([np.inf, -np.inf])) == -np.inf
    assert np.isnan(smallest(np.array([1.0, np.nan, -1.0])))
    assert smallest(np.zeros(0)) == np.inf
