"""How a sweep goes: rate, time left, share of recovered episodes."""

from __future__ import annotations

import time
from collections.abc import Iterable
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from sim.sweep.scheduler import Scheduler

# Seconds between two lines where nobody looks at a bar.
QUIET = 15.0


class SweepDisplay:
    """Shows a bar on a terminal, else a line now and then, on stderr; a context manager."""

    def __init__(self, name: str, *, clock: float = QUIET) -> None:
        """Prepare.

        Args:
            name: of the suite.
            clock: time between two lines [s], where there is no terminal.
        """
        self._console = Console(stderr=True, highlight=False)
        self._name, self._clock = name, clock
        self._bar = Progress(
            TextColumn(name),
            BarColumn(),
            TextColumn("{task.fields[told]}"),
            console=self._console,
            transient=True,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task(name, total=1.0, told="starting the workers")
        self._begin = self._said = time.monotonic()
        self._fresh = self._recovered = self._all = 0

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._bar.stop()

    def begin(self, scheduler: Scheduler, outcomes: Iterable[str]) -> None:
        """The work is known; `outcomes` are those of former runs."""
        former = list(outcomes)
        self._all, self._recovered = len(former), former.count("recovered")
        self._begin = self._said = time.monotonic()
        if former and not self._console.is_terminal:
            self._console.print(f"{self._name}: goes on after {len(former)} episodes", soft_wrap=True)

    def tell(self, scheduler: Scheduler, outcome: str) -> None:
        """An episode has ended."""
        self._fresh += 1
        self._all += 1
        self._recovered += outcome == "recovered"
        told = self.words(scheduler)
        self._bar.update(self._task, total=scheduler.planned, completed=scheduler.done + scheduler.skipped, told=told)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._said >= self._clock:
            self._said = now
            self._console.print(f"{self._name}: {told}", soft_wrap=True)

    def words(self, scheduler: Scheduler) -> str:
        """Where it stands, in one line."""
        rate = self._fresh / max(time.monotonic() - self._begin, 1e-9)
        left = (scheduler.planned - scheduler.done - scheduler.skipped) / rate if rate else 0.0
        most = "at most " if scheduler.adaptive else ""
        share = 100 * self._recovered / self._all
        return (
            f"{scheduler.done} of {most}{scheduler.planned - scheduler.skipped} episodes, {rate:.1f}/s, "
            f"{most}{_span(left)} left, {share:.0f} % recovered"
        )


def _span(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"
