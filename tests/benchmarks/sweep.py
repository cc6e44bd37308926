"""What a second worker is worth: the same small suite with one and with two processes, in turn."""

from __future__ import annotations

import tempfile
from pathlib import Path

from scenarios.suite_catalogue import load_suite
from sim.sweep.executors import local
from sim.sweep.sweep import run_sweep
from tests.benchmarks.rate import Watch
from tests.benchmarks.timing import show, table

SUITE = """description = "enough work to tell the rate of one worker from that of two"
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


def rate(workers: int, folder: Path) -> tuple[float, int]:
    """Episodes a second, the workers' start left out, and how many there were."""
    suite, watch = folder / "suite.toml", Watch()
    suite.write_text(SUITE, encoding="utf-8")
    with local(workers) as crew:
        run_sweep(load_suite(suite), folder / f"with-{workers}", crew, progress=watch)
    return watch.rate(workers), len(watch.ends)


def main() -> None:
    """Print the table."""
    made = table("A sweep, once its workers have started", "workers", "episodes", "rate", "over one worker")
    with tempfile.TemporaryDirectory() as folder:
        one, episodes = rate(1, Path(folder))
        two, again = rate(2, Path(folder))
    assert episodes == again
    made.add_row("1", str(episodes), f"{one:.2f}/s", "1.00")
    made.add_row("2", str(episodes), f"{two:.2f}/s", f"{two / one:.2f} (wanted: 1.90)")
    show(made)
