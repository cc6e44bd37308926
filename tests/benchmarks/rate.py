"""What more workers are worth: the suite `smoke` over 1, 2, 4 processes, and over a local Dask cluster's workers."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from scenarios.suite_catalogue import load_suite
from sim.results.table import read_results
from sim.sweep import executors
from sim.sweep.executors import Workers
from sim.sweep.progress import SweepDisplay
from sim.sweep.scheduler import Scheduler
from sim.sweep.sweep import run_sweep
from tests.benchmarks.timing import show, table

SUITE = "smoke"
WORKERS = (1, 2, 4)
MISSING = "no Dask cluster: the package distributed is missing; pip install 'okiagari[cluster]'"


class Watch(SweepDisplay):
    """Notes when each episode has ended, and shows nothing."""

    def __init__(self) -> None:
        super().__init__("watch")
        self.ends: list[float] = []

    def begin(self, scheduler: Scheduler, outcomes: Iterable[str]) -> None:
        """Nothing to show."""

    def tell(self, scheduler: Scheduler, outcome: str) -> None:
        """Note the time."""
        self.ends.append(time.perf_counter())

    def rate(self, workers: int) -> float:
        """Episodes a second from the end of as many as there are workers to the last end: their start is left out."""
        return (len(self.ends) - workers) / (self.ends[-1] - self.ends[workers - 1])


@contextmanager
def dask_cluster(count: int) -> Iterator[Workers]:
    """The workers of a cluster on this machine, each a process with one thread.

    Raises:
        ImportError: if `distributed` is not installed.
    """
    # Of every worker, whose environment this is; it is read when `distributed` is imported.
    os.environ.setdefault("DASK_LOGGING__DISTRIBUTED", "error")
    from distributed import LocalCluster

    with (
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
        ) as made,
        executors.cluster(made.scheduler_address) as crew,
    ):
        yield crew


def main() -> None:
    """Print the table, after a check that all gave the same rows bit for bit."""
    loaded, cores = load_suite(SUITE), len(os.sched_getaffinity(0))
    made = table(
        f"The suite {SUITE} on {cores} cores", "workers", "episodes", "a minute, once started", "over one", "in all"
    )
    hashes: set[tuple[str, ...]] = set()
    kinds: dict[str, Callable[[int], AbstractContextManager[Workers]]] = {
        "processes": executors.local,
        "Dask": dask_cluster,
    }
    missing = ""
    for kind, start in kinds.items():
        one = 0.0
        for count in WORKERS:
            watch, begin = Watch(), time.perf_counter()
            try:
                with tempfile.TemporaryDirectory() as folder, start(count) as crew:
                    run_sweep(loaded, Path(folder), crew, progress=watch)
                    took = time.perf_counter() - begin
                    hashes.add(tuple(read_results(Path(folder))["trace_hash"].to_pylist()))
            except ImportError:
                missing = MISSING
                break
            rate = 60.0 * watch.rate(count)
            one = one or rate
            made.add_row(f"{count} {kind}", str(len(watch.ends)), f"{rate:.0f}", f"{rate / one:.2f}", f"{took:.1f} s")
    assert len(hashes) == 1, "the rows differ by who ran them"
    show(made)
    if missing:
        print(missing)
