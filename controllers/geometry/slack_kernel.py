"""Slacks of half-space sets {x : S x <= a}, compiled.

One state in one set is multiplied by BLAS, as numpy does it, and the slack is that of numpy's `min(a - S x)` up to the
rounding of the sums. Of many states, or many sets, the products are summed in the order of the coordinates, whatever
the processor.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]

# States that one pass over the rows takes: what they need then stays in the first cache.
_BLOCK = 256


def table_of(S: Array, a: Array) -> Array:
    """(n + 1, r) columns of S (r, n), then a (r,): how the kernels take the rows of one set."""
    return np.ascontiguousarray(np.vstack((S.T, a)))


@compiled
def smallest(values: Array) -> float:
    """The least of values (r,), NaN if one of them is; infinity of none."""
    least = math.inf
    for value in values:
        if not value >= least:
            least = value
            if value != value:
                break
    return least


@compiled
def least_slack(table: Array, x: Array) -> float:
    """min(a - S x) of a state x (n,) by the `table_of` the set; NaN if a slack is."""
    slacks = np.empty(table.shape[1])
    np.dot(x, table[:-1], slacks)
    limits = table[-1]
    for i in range(len(slacks)):
        slacks[i] = limits[i] - slacks[i]
    return smallest(slacks)


@compiled
def least_slacks(S: Array, a: Array, points: Array, out: Array) -> None:
    """Write min(a - S x) of each row x of points (p, n) to out (p,); NaN if a slack is, as for a NaN in x.

    A slack that is NaN because products of finite numbers overflow may be left out instead.

    Args:
        S, a: (r, n), (r,), without NaN.
        points: (p, n).
        out: (p,) written.
    """
    count, n = points.shape
    block, least = np.zeros((n, _BLOCK)), np.empty(_BLOCK)
    for begin in range(0, count, _BLOCK):
        size = min(_BLOCK, count - begin)
        finite = True
        for axis in range(n):
            for i in range(size):
                block[axis, i] = points[begin + i, axis]
                finite &= math.isfinite(block[axis, i])
        least[:] = math.inf
        if finite and n == 4:
            for row in range(len(a)):
                s0, s1, s2, s3, limit = S[row, 0], S[row, 1], S[row, 2], S[row, 3], a[row]
                for i in range(_BLOCK):
                    slack = limit - s0 * block[0, i] - s1 * block[1, i] - s2 * block[2, i] - s3 * block[3, i]
                    least[i] = slack if slack < least[i] else least[i]
        else:
            _any_slacks(S, a, block, least, size)
        out[begin : begin + size] = least[:size]


@compiled
def _any_slacks(S: Array, a: Array, block: Array, least: Array, size: int) -> None:
    """The same for a block (n, .) of any dimension and of points that need not be finite."""
    for row in range(len(a)):
        for i in range(size):
            slack = a[row]
            for axis in range(S.shape[1]):
                slack -= S[row, axis] * block[axis, i]
            # Once it is a NaN it stays one.
            if slack < least[i] or slack != slack:
                least[i] = slack


@compiled
def least_of_each(table: Array, start: NDArray[np.int64], x: Array, out: Array) -> None:
    """Write min(a - S x) of a state x (4,) in each of many sets to out (m,); NaN if a slack is, as for a NaN in x.

    A slack that is NaN because products of finite numbers overflow may be left out instead.

    Args:
        table: `table_of` the rows of all sets, without NaN, one set after another.
        start: (m + 1,) first row of each set, and the number of all rows.
        x: state.
        out: (m,) written.
    """
    x0, x1, x2, x3 = x
    finite = math.isfinite(x0) and math.isfinite(x1) and math.isfinite(x2) and math.isfinite(x3)
    room = np.empty(np.diff(start).max())
    for k in range(len(out)):
        i, j = start[k], start[k + 1]
        s0, s1, s2, s3, limits = table[0, i:j], table[1, i:j], table[2, i:j], table[3, i:j], table[4, i:j]
        slacks = room[: j - i]
        for row in range(len(slacks)):
            slacks[row] = limits[row] - (s0[row] * x0 + s1[row] * x1 + s2[row] * x2 + s3[row] * x3)
        out[k] = _smallest_of_four(slacks) if finite else smallest(slacks)


@compiled
def _smallest_of_four(values: Array) -> float:
    """`smallest` of values without a NaN, by four comparisons that do not wait for each other."""
    one = two = three = four = math.inf
    quarters = len(values) // 4
    for i in range(quarters):
        first, second, third, fourth = values[4 * i], values[4 * i + 1], values[4 * i + 2], values[4 * i + 3]
        one = first if first < one else one
        two = second if second < two else two
        three = third if third < three else three
        four = fourth if fourth < four else four
    for i in range(4 * quarters, len(values)):
        one = values[i] if values[i] < one else one
    one = two if two < one else one
    three = four if four < three else three
    return three if three < one else one


@compiled
def slack_in_any(tables: Array, rows: NDArray[np.int64], x: Array) -> float:
    """Largest `least_slack` of a state x (4,) in several sets, NaN if it is that in the first one.

    Args:
        tables: (., ) the `table_of` each set, one after another.
        rows: (m,) of each set.
        x: state.
    """
    largest, begin = -math.inf, 0
    for k in range(len(rows)):
        end = begin + 5 * rows[k]
        slack = least_slack(tables[begin:end].reshape((5, rows[k])), x)
        if k == 0 or slack > largest:
            largest = slack
        begin = end
    return largest


@compiled
def first_with(tables: Array, rows: NDArray[np.int64], x: Array, present: int, more: float) -> int:
    """Which set is the first that holds a state x (4,) with a slack of `more`, or at all if it is the present one.

    Args:
        tables, rows, x: as of `slack_in_any`.
        present: number of the present set, -1 for none.
        more: slack.

    Returns:
        number of the set, -1 if there is none.
    """
    begin = 0
    for k in range(len(rows)):
        end = begin + 5 * rows[k]
        if least_slack(tables[begin:end].reshape((5, rows[k])), x) >= (0.0 if k == present else more):
            return k
        begin = end
    return -1
