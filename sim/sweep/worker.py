"""One episode of a sweep, run in a worker, as one row of the table."""

from __future__ import annotations

import hashlib
import json
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Phase
from controllers.registry import CONTROLLERS, ESTIMATORS, LAYERS
from scenarios.schema import Scenario
from sim.episode.build import layer_of
from sim.episode.episode import EpisodeResult
from sim.record.motors import MotorUse
from sim.record.versions import commit, versions
from sim.results.columns import COLUMNS
from sim.results.prediction import prediction_columns
from sim.results.push_size import push_columns, robot_named
from sim.results.train import train_columns
from sim.sweep.kept import run_kept, warm_up_shipped
from sim.sweep.plan import PlannedEpisode

Array = NDArray[np.float64]

CRASHED = "crashed"
"""Outcome of an episode that ended in an error of the program."""

# Cluster workers may run tasks in threads; the solvers were not made for that.
_ONE_AT_A_TIME = threading.Lock()
# Times are sums of many periods.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a worker is sent: an episode and its scenario, as run."""

    episode: PlannedEpisode
    scenario: Scenario


def run_job(job: Job) -> dict[str, Any]:
    """Run an episode and make its row."""
    with _ONE_AT_A_TIME:
        warm_up_shipped([job.scenario])
        begin = time.perf_counter()
        result = run_kept(job.scenario)
        row = _known(job) | happened(result, train="train" in job.episode.parameters)
        return row | {
            "real_time_factor": result.real_time_factor,
            "wall_time": time.perf_counter() - begin,
        }


def crashed_row(job: Job, traceback: str) -> dict[str, Any]:
    """The row of an episode that could not be run."""
    reason = traceback.strip().splitlines()[-1] if traceback.strip() else CRASHED
    return _known(job) | {"outcome": CRASHED, "reason": reason, "traceback": traceback}


def trace_hash(values: Array, channels: Sequence[str]) -> str:
    """SHA-256 of the channels' names and of every bit of their values (n, c)."""
    digest = hashlib.sha256(json.dumps(list(channels)).encode())
    digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


def makers_of(scenario: Scenario) -> dict[str, str]:
    """What an episode's bits depend on: versions, the robot, and what of all classes is in files."""
    robot = robot_named(scenario.robot)
    chosen = [(CONTROLLERS, scenario.controller)]
    if (layer := layer_of(scenario)) is not None:
        chosen.append((LAYERS, layer))
    if scenario.sensing.estimates:
        chosen.append((ESTIMATORS, scenario.sensing.who))
    brought = tuple(library for registry, choice in chosen for library in registry.entry(choice.name).libraries)
    found = versions(brought) | {f"robot {robot.name}": robot.sha256[:12]}
    for registry, choice in chosen:
        found |= {called: source[:12] for called, source in choice.sources(registry).items()}
    return found


def _known(job: Job) -> dict[str, Any]:
    """What is known before it is run; all else is null."""
    episode, pushes = job.episode, job.scenario.pushes
    robot, asked = robot_named(job.scenario.robot), dict(episode.parameters)
    nominal, train, first = (asked.pop(name, None) for name in ("direction", "train", "first"))
    for name in ("relative", "changes"):  # the row has the size in every unit, and the whole scenario
        asked.pop(name, None)
    row: dict[str, Any] = dict.fromkeys(COLUMNS) | asked
    row |= {
        "episode": episode.name,
        "suite": episode.suite,
        "series": episode.series,
        "seed": episode.seed,
        "push_start": pushes[0 if train else -1].start,
        "scenario": json.dumps(job.scenario.as_dict(), sort_keys=True),
    }
    if train is not None:
        row["train"] = len(pushes)
    else:
        row |= push_columns(robot, pushes[-1], nominal) | {"push_direction_deg": pushes[-1].direction_deg}
    if first is not None:
        before = push_columns(robot, pushes[0])
        row |= {"first_direction_deg": before["direction_deg"], "first_delta_v": before["delta_v"]}
    return row | {"versions": json.dumps(makers_of(job.scenario), sort_keys=True), "commit": commit()}


def happened(result: EpisodeResult, *, train: bool) -> dict[str, Any]:
    """The columns of `OUTCOME` that the episode decides.

    Args:
        result: of the episode; of several pushes, the last is the one that was asked for.
        train: whether its pushes are a train.
    """
    outcome, trace, push = result.outcome, result.trace, result.pushes[-1]
    settled = outcome.settled_at
    row: dict[str, Any] = {
        "outcome": outcome.result.value,
        "reason": outcome.reason.value,
        "time_of_fall": outcome.time_of_fall,
        "steps": outcome.steps_taken,
        "settle_time": None if settled is None else max(0.0, settled - push.start - push.duration),
        "trace_hash": trace_hash(trace.values, trace.channels),
    }
    if result.sight is not None:
        row |= {"dcm_error_rms": result.sight.rms, "dcm_error_peak": result.sight.peak}
    row |= {field.name: getattr(result.motors, field.name, None) for field in fields(MotorUse)}
    if train:
        return row | train_columns(result)
    row |= {"delivered_impulse": push.delivered_impulse, "mid_step": _mid_step(result)}
    return row | prediction_columns(push, result.decisions)


def _mid_step(result: EpisodeResult) -> bool | None:
    tick = int(np.searchsorted(result.trace.time, result.pushes[-1].start - _ROUNDING))
    if tick >= len(result.trace):
        return None
    return bool(result.trace["phase"][tick] == Phase.STEPPING.value)
