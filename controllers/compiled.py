"""The compiler of what every tick does: plain floats and small arrays, in functions without objects."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core import event as events

P = ParamSpec("P")
R = TypeVar("R")

COMPILING = "okiagari: compiling what is used for the first time; some seconds"
"""What the first runs after an installation are told."""


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function at its first call, and keep the code on disk for the runs to come.

    Nothing is reordered (no `fastmath`) and nothing runs in parallel, so the same input gives the same bits; a division
    by zero gives what numpy gives. Read-only arrays are another type than writable ones: a kernel that is called with
    both is compiled twice.
    """
    made: Any = numba.njit(cache=True, error_model="numpy")(function)
    return made


class _Teller(events.Listener):
    """Says once on stderr what a first run after an installation waits for."""

    told = multiprocessing.parent_process() is not None  # a worker's caller has said it, or has nothing to wait for

    def on_start(self, event: events.Event) -> None:
        """A function is not on disk yet."""
        if not self.told:
            self.told = True
            print(COMPILING, file=sys.stderr)

    def on_end(self, event: events.Event) -> None:
        """Nothing is to be said."""


events.register("numba:compile", _Teller())
