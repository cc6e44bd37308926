"""Suites that run in seconds, and workers that fail on purpose."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pyarrow as pa

from scenarios.suite_catalogue import LoadedSuite, load_suite
from sim.results.columns import TIMING
from sim.sweep.executors import Workers
from sim.sweep.plan import plan, scenario_of
from sim.sweep.worker import Job, run_job

PENDULUM = """
description = "short pushes on the pendulum"
replicas = 2
seed = 7

[axes]
world = ["pendulum"]
controller = ["statue", "regulator"]
direction = [0, 90]
delta_v = [0.1, 0.5]
start = [0.2]

[replica]
time = 0.05
direction = 5.0

# Coarse, for the tests' time.
[scenario.timing]
physics = 0.005
control = 0.01
"""
HUMANOID = """
description = "pushes to the back of the humanoid"
after = 1.0 # of determinism, not of recovery: for the tests' time

[axes]
world = ["humanoid"]
controller = ["supervisor", "statue"]
direction = [180]
delta_v = [0.35]
start = [0.2]
"""
TRAIN = """
description = "growing pushes on the pendulum"
replicas = 2

[axes]
world = ["pendulum"]
controller = ["supervisor", "regulator", "statue"]
start = [0.2]

[train]
count = 9
interval = 1.5
first = 0.5
growth = 0.4

# Coarse, for the tests' time.
[scenario.timing]
physics = 0.005
control = 0.01
"""
SECOND = """
description = "pushes on the pendulum that is still recovering"
replicas = 2

[axes]
world = ["pendulum"]
controller = ["supervisor", "statue"]
direction = [0]
delta_v = [0.1, 0.2]
start = [0.6]

[first]
size = 3.0
gap = 0.1

[replica]
direction = 5.0

[scenario.timing]
physics = 0.005
control = 0.01
"""


class Counting(ThreadPoolExecutor):
    """Notes what is run."""

    def __init__(self, ran: list[str]) -> None:
        super().__init__(1)
        self.ran = ran

    def submit(self, run: Any, /, job: Job) -> Any:
        """Note and run."""
        self.ran.append(job.episode.name)
        return super().submit(run, job)


def lasting(table: pa.Table) -> pa.Table:
    """All but what a clock measured, and the commit, which may change while the tests run."""
    return table.drop_columns([*TIMING, "commit"])


# One worker, in this process: nothing to start.
HERE = Workers(count=1, make=lambda: ThreadPoolExecutor(1))


def suite(folder: Path, text: str = PENDULUM, name: str = "short") -> LoadedSuite:
    """A suite from the text of its file."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return load_suite(path)


def jobs(loaded: LoadedSuite) -> list[Job]:
    """All of a suite, in order."""
    return [
        Job(episode=episode, scenario=scenario_of(loaded, episode))
        for series in plan(loaded)
        for episode in series.episodes
    ]


def die(job: Job) -> dict[str, Any]:
    """A worker that is killed by one of the episodes, always."""
    if job.episode.name == os.environ["VICTIM"]:
        os.kill(os.getpid(), signal.SIGKILL)
    return run_job(job)


def die_once(job: Job) -> dict[str, Any]:
    """A worker that is killed by one of the episodes, the first time."""
    mark = Path(os.environ["MARK"])
    if job.episode.name == os.environ["VICTIM"] and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return run_job(job)


def fail(job: Job) -> dict[str, Any]:
    """An episode that raises an error."""
    with open(os.environ["MARK"], "a") as file:
        file.write(job.episode.name + "\n")
    raise ZeroDivisionError("on purpose")
