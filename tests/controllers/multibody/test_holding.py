"""Limits that are held: the nearest point that keeps them, against non-negative least squares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from controllers.multibody.holding import EXCHANGES, hold


def nearest(rows: np.ndarray, lack: np.ndarray) -> np.ndarray:
    """The least change z with rows z >= lack, by its dual: least squares of non-negative multipliers."""
    # min |z|^2 with A z >= b: the residual of [A'; b'] u = (0, 1), u >= 0 (Lawson and Hanson 1974, chapter 23)
    E = np.vstack([rows.T, lack])
    u, _ = nnls(E, np.append(np.zeros(rows.shape[1]), 1.0))
    r = E @ u - np.append(np.zeros(rows.shape[1]), 1.0)
    z: np.ndarray = -r[:-1] / r[-1]
    return z


@pytest.mark.parametrize("seed", range(30))
def test_it_is_the_nearest_point_that_keeps_all_rows(seed: int) -> None:
    rng = np.random.default_rng(1000 + seed)
    count = int(rng.integers(1, 13))
    rows, lack = rng.normal(size=(20, 26)), rng.normal(0.0, 3.0, 20)
    active, z = np.ones(20, dtype=np.bool_), np.zeros(26)
    hold(rows, lack, count, 0, active, z, EXCHANGES)
    # held rows give way by 1e-6 of what holding them does, which is of the order of ten
    np.testing.assert_allclose(z, nearest(rows[:count], lack[:count]), rtol=0, atol=1e-4)
    assert (rows[:count] @ z >= lack[:count] - 1e-4).all()


@pytest.mark.parametrize("seed", [2661, 2734, 4540, 9281])
def test_rows_that_are_exchanged_long_are_found_or_change_nothing(seed: int) -> None:
    """Random rows that take more than sixty exchanges; those of the first contradict each other."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(10, 36))
    rows, lack = rng.normal(size=(42, 26)) * np.exp(rng.normal(0.0, 1.0, (42, 1))), rng.normal(1.0, 3.0, 42)
    start = rng.normal(size=26)
    z = start.copy()
    assert not hold(rows, lack, count, 0, np.ones(42, dtype=np.bool_), z, 60)
    assert np.array_equal(z, start)
    z[:] = 0.0
    assert hold(rows, lack, count, 0, np.ones(42, dtype=np.bool_), z, EXCHANGES)
    # each row gives way along an axis of its own, by 1e-6 of what holding it does: then there is always an answer
    rows, lack = rows[:count], lack[:count]
    yielding = np.hstack([rows, np.diag(1e-3 * np.linalg.norm(rows, axis=1))])
    wanted = nearest(yielding, lack)[:26]
    # 1e-6 on the diagonal makes a condition of some 1e8 of the rows that contradict each other; 6e-11 was found
    np.testing.assert_allclose(z, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())


def test_rows_that_are_kept_anyway_change_nothing() -> None:
    rng = np.random.default_rng(1000)
    rows, z = rng.normal(size=(4, 26)), np.zeros(26)
    hold(rows, np.full(4, -1.0), 4, 0, np.ones(4, dtype=np.bool_), z, EXCHANGES)
    assert not z.any()


def test_rows_from_either_side_are_met() -> None:
    rng = np.random.default_rng(1001)
    rows, lack, z = rng.normal(size=(3, 26)), np.array([-1.0, 2.0, -5.0]), np.zeros(26)
    hold(rows, lack, 3, 2, np.ones(3, dtype=np.bool_), z, EXCHANGES)
    np.testing.assert_allclose(rows[:2] @ z, lack[:2], rtol=0, atol=1e-5)


def test_limits_that_contradict_each_other_have_a_finite_answer() -> None:
    row = np.random.default_rng(1002).normal(size=26)
    z = np.zeros(26)
    hold(np.array([row, -row]), np.ones(2), 2, 0, np.ones(2, dtype=np.bool_), z, EXCHANGES)
    assert np.isfinite(z).all()
