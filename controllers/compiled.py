"""The compiler of what every tick does: plain floats and small arrays, in functions without objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function at its first call, and keep the code on disk for the runs to come.

    Nothing is reordered (no `fastmath`) and nothing runs in parallel, so the same input gives the same bits; a division
    by zero gives what numpy gives. Read-only arrays are another type than writable ones: a kernel that is called with
    both is compiled twice.
    """
    made: Any = numba.njit(cache=True, error_model="numpy")(function)
    return made
