"""What a second worker is worth: the same small suite with one and with two processes, in turn."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from scenarios.suite_library import load_suite
from sim.executors import local
from sim.results import read_results
from sim.sweep import run_sweep
from tests.benchmarks.timing import show, table

SUITE = """description = "enough work that the start of the workers does not show"
scenario = "quiet"
replicas = 6

[axes]
controller = ["supervisor", "regulator"]
direction = [0, 90]
delta_v = [0.2, 0.45, 0.6]
start = [0.5]

[replica]
pose = 0.002
"""


def timed(workers: int, folder: Path) -> tuple[float, int]:
    """Wall time of the sweep, start of the workers included [s], and how many episodes it ran."""
    suite = folder / "suite.toml"
    suite.write_text(SUITE, encoding="utf-8")
    out = folder / f"with-{workers}"
    begin = time.perf_counter()
    with local(workers) as crew:
        run_sweep(load_suite(suite), out, crew)
    return time.perf_counter() - begin, read_results(out).num_rows


def main() -> None:
    """Print the table."""
    made = table("A sweep, start of the workers included", "workers", "episodes", "time", "rate", "over one worker")
    with tempfile.TemporaryDirectory() as folder:
        one, episodes = timed(1, Path(folder))
        two, again = timed(2, Path(folder))
    assert episodes == again
    made.add_row("1", str(episodes), f"{one:.1f} s", f"{episodes / one:.2f}/s", "1.00")
    made.add_row("2", str(episodes), f"{two:.1f} s", f"{episodes / two:.2f}/s", f"{one / two:.2f} (reach: 1.80)")
    show(made)
