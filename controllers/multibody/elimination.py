"""Small dense linear algebra of the inverse dynamics, in loops that a compiler can turn into vector instructions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]


@compiled
def normal_equations(rows: Array, constant: Array, weight: Array, torques: int, limits: int) -> tuple[Array, Array]:
    """Upper triangle of A'WA, and A'Wc, of the rows of torques and of those behind the limits."""
    count, size = rows.shape
    hessian, linear = np.zeros((size, size)), np.zeros(size)
    for i in range(size):
        h = hessian[i]
        for r in range(0, count, 4):
            if torques <= r and r + 4 <= limits:
                continue
            a, b, c, d = rows[r, i], rows[r + 1, i], rows[r + 2, i], rows[r + 3, i]
            a, b, c, d = weight[r] * a, weight[r + 1] * b, weight[r + 2] * c, weight[r + 3] * d
            linear[i] += a * constant[r] + b * constant[r + 1] + c * constant[r + 2] + d * constant[r + 3]
            for j in range(i, size):
                h[j] += a * rows[r, j] + b * rows[r + 1, j] + c * rows[r + 2, j] + d * rows[r + 3, j]
    return hessian, linear


@compiled
def divide_by_base(mass: Array, base: Array, base0: Array) -> None:
    """Multiply `base` (6, m) and `base0` (6,) in place by the inverse of the base's part of the mass matrix."""
    L = np.zeros((6, 6))
    for i in range(6):
        for j in range(i + 1):
            total = mass[j, i]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(total) if i == j else total / L[j, j]
    size = base.shape[1]
    for i in range(6):
        for k in range(i):
            base0[i] -= L[i, k] * base0[k]
            for j in range(size):
                base[i, j] -= L[i, k] * base[k, j]
        base0[i] /= L[i, i]
        for j in range(size):
            base[i, j] /= L[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            base0[i] -= L[k, i] * base0[k]
            for j in range(size):
                base[i, j] -= L[k, i] * base[k, j]
        base0[i] /= L[i, i]
        for j in range(size):
            base[i, j] /= L[i, i]


@compiled
def solved(hessian: Array, linear: Array) -> Array:
    """-H^-1 f by Cholesky's decomposition U'U; `hessian` is left as it is."""
    size = len(linear)
    U, x = hessian.copy(), -linear
    for k in range(size):
        pivot = 1.0 / math.sqrt(U[k, k])
        for j in range(k, size):
            U[k, j] *= pivot
        x[k] *= pivot
        for i in range(k + 1, size):
            factor = U[k, i]
            x[i] -= factor * x[k]
            for j in range(i, size):
                U[i, j] -= factor * U[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            x[k] -= U[k, j] * x[j]
        x[k] /= U[k, k]
    return x


@compiled
def factored(hessian: Array) -> Array:
    """U (m, m) of U'U = H from the upper triangle of H (m, m), which is left; NaN if H is not positive definite."""
    size = len(hessian)
    U = hessian.copy()
    for k in range(0, size - 1, 2):
        # two rows at a time: what is below is fetched half as often
        one, other = U[k], U[k + 1]
        pivot = 1.0 / math.sqrt(one[k])
        for j in range(k, size):
            one[j] *= pivot
        factor = one[k + 1]
        for j in range(k + 1, size):
            other[j] -= factor * one[j]
        pivot = 1.0 / math.sqrt(other[k + 1])
        for j in range(k + 1, size):
            other[j] *= pivot
        for i in range(k + 2, size):
            a, b, below = one[i], other[i], U[i]
            for j in range(i, size):
                below[j] -= a * one[j] + b * other[j]
    if size % 2 == 1:
        pivot = U[size - 1, size - 1]
        U[size - 1, size - 1] = math.sqrt(pivot) if pivot > 0.0 else math.nan
    return U


@compiled
def substitute(U: Array, x: Array) -> None:
    """Put U'^-1 x in the place of x (m,), with U of `factored`."""
    size = len(x)
    for k in range(size):
        row = U[k]
        x[k] /= row[k]
        known = x[k]
        for j in range(k + 1, size):
            x[j] -= row[j] * known


@compiled
def substitute_back(U: Array, x: Array) -> None:
    """Put U^-1 x in the place of x (m,), with U of `factored`."""
    size = len(x)
    for k in range(size - 1, -1, -1):
        row = U[k]
        total = x[k]
        for j in range(k + 1, size):
            total -= row[j] * x[j]
        x[k] = total / row[k]
