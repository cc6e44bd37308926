"""The linear algebra of the whole body against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.multibody.elimination import (
    divide_by_base,
    factored,
    normal_equations,
    solved,
    substitute,
    substitute_back,
)

# Sums of at most some dozen terms of order one, and matrices whose condition is below 1e4.
ROUNDING = 1e-10


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1000)


def positive(rng: np.random.Generator, size: int) -> np.ndarray:
    """A positive definite matrix of a moderate condition."""
    half = rng.normal(size=(size, size))
    return half @ half.T + 0.1 * size * np.eye(size)


def test_normal_equations_leave_out_the_limits(rng: np.random.Generator) -> None:
    rows, constant, weight = rng.normal(size=(32, 9)), rng.normal(size=32), rng.uniform(0.1, 9.0, size=32)
    torques, limits = 8, 16
    counted = [*range(torques), *range(limits, 32)]
    A, W = rows[counted], np.diag(weight[counted])
    hessian, linear = normal_equations(rows, constant, weight, torques, limits)
    np.testing.assert_allclose(hessian, np.triu(A.T @ W @ A), rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(linear, A.T @ W @ constant[counted], rtol=0, atol=ROUNDING)


def test_the_base_is_divided_by_from_the_upper_triangle_alone(rng: np.random.Generator) -> None:
    mass = positive(rng, 8)
    base, base0 = rng.normal(size=(6, 5)), rng.normal(size=6)
    wanted, wanted0 = np.linalg.solve(mass[:6, :6], base), np.linalg.solve(mass[:6, :6], base0)
    divide_by_base(np.triu(mass), base, base0)
    np.testing.assert_allclose(base, wanted, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(base0, wanted0, rtol=0, atol=ROUNDING)


def test_solved_is_the_minimum_and_leaves_its_matrix(rng: np.random.Generator) -> None:
    hessian, linear = positive(rng, 12), rng.normal(size=12)
    kept = hessian.copy()
    np.testing.assert_allclose(solved(hessian, linear), -np.linalg.solve(hessian, linear), rtol=0, atol=ROUNDING)
    assert np.array_equal(hessian, kept)


def test_what_is_not_positive_definite_has_no_number_for_an_answer() -> None:
    assert not np.isfinite(solved(np.diag([1.0, -1.0]), np.ones(2))).any()


@pytest.mark.parametrize("size", [1, 2, 7, 26])
def test_a_factor_is_cholesky_s_and_divides(rng: np.random.Generator, size: int) -> None:
    hessian, right = positive(rng, size), rng.normal(size=size)
    U = np.triu(factored(np.triu(hessian)))
    np.testing.assert_allclose(U, np.linalg.cholesky(hessian).T, rtol=0, atol=ROUNDING)
    x = right.copy()
    substitute(U, x)
    np.testing.assert_allclose(x, np.linalg.solve(U.T, right), rtol=0, atol=ROUNDING)
    substitute_back(U, x)
    np.testing.assert_allclose(x, np.linalg.solve(hessian, right), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("size", range(1, 6))
@pytest.mark.parametrize("pivot", [0.0, -1.0])
def test_a_factor_without_a_positive_pivot_is_not_a_number(size: int, pivot: float) -> None:
    for at in range(size):
        diagonal = np.ones(size)
        diagonal[at] = pivot
        x = np.ones(size)
        U = factored(np.diag(diagonal))
        assert np.isnan(U[at, at])
        substitute(U, x)
        substitute_back(U, x)
        assert np.isnan(x[at])
