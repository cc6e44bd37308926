"""Timing that a busy machine disturbs least, and the table that every benchmark prints."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.table import Table


def best_of(compute: Callable[[], Any], repeats: int = 5, batch: int = 1) -> float:
    """Best wall time of one `compute()` over `repeats` batches [s]: what disturbs can only add."""
    best = float("inf")
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(batch):
            compute()
        best = min(best, (time.perf_counter() - begin) / batch)
    return best


def in_words(seconds: float) -> str:
    """A duration with three digits in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def table(title: str, *headings: str) -> Table:
    """An empty table; the first column is words, the others are numbers."""
    made = Table(title=title, title_justify="left")
    for i, heading in enumerate(headings):
        made.add_column(heading, justify="left" if i == 0 else "right")
    return made


def show(made: Table) -> None:
    """Print a table as wide as it is, also where nobody looks."""
    console = Console(highlight=False)
    Console(highlight=False, width=max(console.width, 132)).print(made, "")
