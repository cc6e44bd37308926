"""Limits of a motion: what would pass one is held at it, by the least change of the motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.multibody.elimination import factored, substitute, substitute_back

Array = NDArray[np.float64]

KEPT = 1e-6
"""A limit is kept if it is not passed by more [N m, N]."""
# A limit that is held may be missed by this much of what holding it does to it: without, limits that contradict each
# other would have no answer.
_GIVES_WAY = 1e-6
EXCHANGES = 200
"""How often rows that are held are exchanged before it is given up."""
# How often they are for naught before it is done one by one.
_PATIENCE = 3


@compiled
def hold(rows: Array, lack: Array, count: int, free: int, active: NDArray[np.bool_], z: Array, exchanges: int) -> bool:
    """Change z (m,) by as little as takes away what it lacks to keep the rows: row . z is to be `lack` more, or above.

    The multipliers of the rows are found by exchanging those of the wrong sign with rows that are not kept, all at a
    time as long as they become fewer, else one (Judice and Pires 1994).

    Args:
        rows, lack: of the limits, the first `count` of them.
        count: how many there are.
        free: how many of them are kept from either side.
        active: which of them were held last time, and are now.
        z: what is changed.
        exchanges: how often rows may be exchanged; `EXCHANGES`, but for a test.

    Returns:
        Whether the rows to hold were found; if not, z is left as it was.
    """
    gram = np.empty((count, count))
    for i in range(count):
        for j in range(i, count):
            gram[i, j] = gram[j, i] = (rows[i] * rows[j]).sum()
        gram[i, i] *= 1.0 + _GIVES_WAY
    force, fewest, patience = np.zeros(count), count + 1, _PATIENCE
    at = np.empty(count, dtype=np.int64)
    found = False
    for _ in range(exchanges):
        size = 0
        for i in range(count):
            if active[i]:
                at[size] = i
                size += 1
        part, need = np.empty((size, size)), np.empty(size)
        for a in range(size):
            need[a] = lack[at[a]]
            for b in range(a, size):
                part[a, b] = gram[at[a], at[b]]
        U = factored(part)
        substitute(U, need)
        substitute_back(U, need)
        force[:] = 0.0
        for a in range(size):
            force[at[a]] = need[a]
        wrong, last = 0, -1
        for i in range(free, count):
            if is_wrong(gram, lack, force, active, i):
                wrong += 1
                last = i
        if wrong == 0:
            found = True
            break
        if wrong < fewest:
            fewest, patience = wrong, _PATIENCE
        else:
            patience -= 1
        if patience > 0:
            exchanged = np.array([i >= free and is_wrong(gram, lack, force, active, i) for i in range(count)])
            for i in range(count):
                active[i] = active[i] != exchanged[i]
        else:
            active[last] = not active[last]
    if not found:
        # `force` is that of other rows than `active` says now
        return False
    for i in range(count):
        if active[i]:
            row = rows[i]
            for j in range(len(z)):
                z[j] += force[i] * row[j]
    return True


@compiled
def is_wrong(gram: Array, lack: Array, force: Array, active: NDArray[np.bool_], i: int) -> bool:
    """Whether a row that is held pulls the wrong way, or one that is not held is not kept."""
    if active[i]:
        return force[i] < 0.0
    missing = lack[i]
    for j in range(len(force)):
        missing -= gram[i, j] * force[j]
    return missing > KEPT
