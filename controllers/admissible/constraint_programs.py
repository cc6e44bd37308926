"""The recursion of Gilbert and Tan by linear programs, for loops of too many coordinates to take a hull of."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from controllers.admissible.gilbert_tan import NotDeterminedError
from controllers.geometry.linear_program import LinearProgram, UnboundedProgramError

# A row that would cut off less than this of its right side cuts nothing: above the tolerance of the solver.
_CUTS = 1e-9


def determined(
    C: np.ndarray,
    d: np.ndarray,
    loop: np.ndarray,
    name: str,
    max_samples: int,
    taken: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[int, np.ndarray]:
    """How many samples of C loop^t x <= d describe the set of all of them.

    Args:
        C: (q, n) outputs.
        d: (q,) limits.
        loop: (n, n), its powers converging.
        name: of the gain, for messages.
        max_samples: where to give up.
        taken: what a disturbance takes from d, (T, q) from the rows (T, q, n).

    Returns:
        the number T of samples, and the rows (T, q, n).

    Raises:
        NotDeterminedError: rows at max_samples still cut.
    """
    stack, power = C[None], loop
    program = LinearProgram(C, d if taken is None else d - taken(stack)[0])
    known, count = len(stack), 1
    while count < max_samples:
        if count == known:
            stack, power = np.concatenate((stack, stack @ power)), power @ power
            known = len(stack)
            limits = np.tile(d, (known, 1)) if taken is None else d - taken(stack)
        rows, right = stack[count], limits[count]
        if not any(_cuts(program, row, limit) for row, limit in zip(rows, right, strict=True)):
            return count, stack[:count]
        program.add(rows, right)
        count += 1
    raise NotDeterminedError(
        f"gain {name!r}: the set is not determined within {max_samples} samples; use faster poles or a shorter delay"
    )


def _cuts(program: LinearProgram, row: np.ndarray, limit: float) -> bool:
    try:
        return bool(row @ program.maximise(row) > limit * (1.0 + _CUTS))
    except UnboundedProgramError:
        return True
