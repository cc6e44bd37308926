"""Keeps the workers of a sweep busy, and replaces those that die."""

from __future__ import annotations

import traceback
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from models.errors import InputError
from sim.sweep.executors import Workers
from sim.sweep.interrupts import HeldInterrupt
from sim.sweep.worker import Job, crashed_row, run_job

HEED = 0.2
"""Longest time until a Ctrl-C is heeded [s]."""


class Runner:
    """Runs jobs; one that fails is tried once more, and then written down as crashed."""

    def __init__(
        self,
        workers: Workers,
        finished: Callable[[Job, dict[str, Any]], None],
        run: Callable[[Job], dict[str, Any]] = run_job,
    ) -> None:
        """Start.

        Args:
            workers: who runs the jobs.
            finished: is given each job with its row, in the order in which they end.
            run: makes the row of a job; is sent to the workers by its name.
        """
        self._workers, self._finished, self._run = workers, finished, run
        self._executor: Executor = workers.make()
        self._flying: dict[Future[dict[str, Any]], Job] = {}
        self._again: deque[Job] = deque()
        self._alone: deque[Job] = deque()
        self._failed: set[str] = set()

    def work(self, jobs: Callable[[], Iterator[Job]]) -> None:
        """Run all jobs; `jobs` is asked again after each that finished, for that may allow others.

        Raises:
            KeyboardInterrupt: after a Ctrl-C, with every job that had finished handed on.
        """
        with HeldInterrupt() as interrupt:
            try:
                while True:
                    self._hand_out(jobs)
                    if not self._flying:
                        break
                    done, _ = wait(self._flying, timeout=HEED, return_when=FIRST_COMPLETED)
                    for future in done:
                        self._take_in(future)
                    interrupt.check()
            except BaseException:
                self._stop()
                raise
            self._executor.shutdown()

    def _hand_out(self, jobs: Callable[[], Iterator[Job]]) -> None:
        # One in the queue for each at work, so that nobody waits; a suspect of killing its worker runs alone.
        room = 2 * self._workers.count - len(self._flying)
        if self._alone:
            if not self._flying:
                self._submit(self._alone.popleft())
            return
        while room > 0 and self._again:
            self._submit(self._again.popleft())
            room -= 1
        fresh = jobs()
        while room > 0 and (job := next(fresh, None)) is not None:
            self._submit(job)
            room -= 1

    def _submit(self, job: Job) -> None:
        try:
            self._flying[self._executor.submit(self._run, job)] = job
        except BrokenProcessPool:
            self._rebuild()
            self._flying[self._executor.submit(self._run, job)] = job

    def _take_in(self, future: Future[dict[str, Any]]) -> None:
        if future not in self._flying:
            return
        if future.cancelled():
            raise InputError(
                "the workers are out of reach; the rows of finished episodes are safe, and the same command goes on"
            )
        job = self._flying[future]
        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            self._on_dead_worker(error)
            return
        del self._flying[future]
        if error is None:
            self._finished(job, future.result())
        elif job.episode.name in self._failed:
            self._finished(job, crashed_row(job, _told(error)))
        else:
            self._failed.add(job.episode.name)
            self._again.append(job)

    def _on_dead_worker(self, error: BrokenProcessPool) -> None:
        """A worker died, and with it the pool; which of the episodes in flight killed it is not known."""
        lost = list(self._flying.items())
        self._flying = {}
        self._rebuild()
        for future, job in lost:
            if future.done() and not future.cancelled() and future.exception() is None:
                self._finished(job, future.result())
            elif len(lost) == 1 and job.episode.name in self._failed:
                self._finished(job, crashed_row(job, _told(error)))
            else:
                self._failed.add(job.episode.name)
                self._alone.append(job)

    def _stop(self) -> None:
        # One by one: not every kind of executor can cancel all when it shuts down.
        for future in self._flying:
            future.cancel()
        self._executor.shutdown(wait=False)

    def _rebuild(self) -> None:
        self._stop()
        self._executor = self._workers.make()


def _told(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))
