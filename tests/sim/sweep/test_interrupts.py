"""A Ctrl-C strikes where it does no harm, and nothing that was finished is lost by it."""

from __future__ import annotations

import signal
import threading
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from sim.sweep.executors import Workers
from sim.sweep.interrupts import HeldInterrupt
from sim.sweep.runner import Runner
from sim.sweep.worker import Job
from tests.sim.sweep.sweep_suites import Counting, jobs, suite


@pytest.fixture(autouse=True)
def heeds_interrupts() -> Any:
    """Whoever runs the tests in the background of a shell ignores Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def press() -> None:
    signal.raise_signal(signal.SIGINT)


def test_first_waits_for_a_check() -> None:
    reached = []

    def work() -> None:
        with HeldInterrupt() as interrupt:
            interrupt.check()
            press()
            reached.append("after Ctrl-C")
            interrupt.check()
            reached.append("after the check")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert reached == ["after Ctrl-C"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_second_strikes_at_once() -> None:
    reached = []

    def work() -> None:
        with HeldInterrupt():
            press()
            reached.append("after the first")
            press()
            reached.append("after the second")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert reached == ["after the first"]


def test_one_that_nobody_checked_for_strikes_at_the_end() -> None:
    with pytest.raises(KeyboardInterrupt), HeldInterrupt():
        press()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_others_do_with_it_is_left_alone() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with HeldInterrupt():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    signal.signal(signal.SIGINT, signal.default_int_handler)
    seen: list[object] = []

    def elsewhere() -> None:
        with HeldInterrupt():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


class Struck(Counting):
    """A pool whose second job is handed out while somebody presses Ctrl-C."""

    def submit(self, run: Any, /, job: Job) -> Future[Any]:
        """Hand out; an interrupt in here could leave a lock of the pool locked for ever."""
        if len(self.ran) == 1:
            press()
        return super().submit(run, job)


def test_crew_hands_its_job_out_before_it_gives_way(tmp_path: Path) -> None:
    work = jobs(suite(tmp_path))
    waiting = iter(work[:6])
    ran: list[str] = []
    crew = Runner(Workers(count=1, make=lambda: Struck(ran)), lambda job, row: None)
    with pytest.raises(KeyboardInterrupt):
        crew.work(lambda: waiting)
    assert ran == [job.episode.name for job in work[:2]]
