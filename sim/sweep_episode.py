"""One episode of a sweep, run in a worker, as one row of the table."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.support import Foot, support_polygon
from controllers.whole_body import WholeBody, make_whole_body
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.push import Push
from scenarios.schema import Scenario
from scenarios.schema import WholeBody as WholeBodyKind
from sim.episode import EpisodeResult, run_episode
from sim.results import COLUMNS
from sim.sweep_plan import Episode
from sim.versions import commit, versions

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

    episode: Episode
    scenario: Scenario


def run_job(job: Job) -> dict[str, Any]:
    """Run an episode and make its row."""
    with _ONE_AT_A_TIME:
        begin = time.perf_counter()
        scenario = job.scenario
        layer = None
        if scenario.world == "humanoid" and scenario.controller != "statue":
            layer = _layer(scenario.robot, scenario.whole_body, scenario.timing.control)
        result = run_episode(scenario, robot=_robot(scenario.robot), layer=layer, polygons=False)
        row = _known(job) | happened(result)
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


def edge_distance(robot: Robot, unit: Array) -> float:
    """From the middle of the feet in `stand` to the edge of their hull, horizontally along `unit` (2,) [m]."""
    stance = robot.sole_stance
    feet = [
        Foot(position=np.array(stance[side][:2]), yaw=stance[side][2], sole=robot.sole_vertices[side]) for side in SIDES
    ]
    hull = support_polygon(feet)
    middle = 0.5 * (feet[0].position + feet[1].position)
    towards = hull.M @ unit
    ahead = towards > 1e-12
    return float(((hull.v - hull.M @ middle)[ahead] / towards[ahead]).min())


@functools.lru_cache(maxsize=8)
def _robot(name: str) -> Robot:
    return load_robot(name)


@functools.lru_cache(maxsize=8)
def _layer(robot: str, kind: WholeBodyKind, dt: float) -> WholeBody:
    # placo does not give back a solver's memory, 0.8 MB each: a worker must not make one an episode.
    return make_whole_body(kind, _robot(robot), dt)


@functools.lru_cache(maxsize=1)
def _makers() -> dict[str, str]:
    """Versions and commit of this process, which imported its code once."""
    return {"versions": json.dumps(versions(), sort_keys=True), "commit": commit()}


def _known(job: Job) -> dict[str, Any]:
    """What is known before it is run; all else is null."""
    episode, (push,) = job.episode, job.scenario.pushes
    robot, asked = _robot(job.scenario.robot), dict(episode.parameters)
    nominal = asked.pop("direction", None)
    unit = (push if nominal is None else Push(start=0.0, direction=nominal, impulse=1.0)).unit
    flat = float(np.hypot(*unit[:2]))
    distance = edge_distance(robot, unit[:2] / flat) if flat else None
    impulse = float(np.linalg.norm(push.impulse_vector(robot.mass)))
    size = impulse / robot.mass if push.delta_v is None else push.delta_v
    row: dict[str, Any] = dict.fromkeys(COLUMNS) | asked
    row |= {
        "episode": episode.name,
        "suite": episode.suite,
        "series": episode.series,
        "seed": episode.seed,
        "direction_deg": push.direction_deg % 360 if nominal is None else nominal % 360,
        "delta_v": size,
        "impulse": impulse,
        "push_start": push.start,
        "push_direction_deg": push.direction_deg,
        "d_edge": distance,
        "delta_v_over_omega_d": size / (robot.omega * distance) if distance else None,
        "delta_v_over_sqrt_gh": size / math.sqrt(robot.gravity * robot.cog_height),
        "scenario": json.dumps(job.scenario.as_dict(), sort_keys=True),
    }
    return row | _makers()


def happened(result: EpisodeResult) -> dict[str, Any]:
    """The columns of `OUTCOME` that the episode decides."""
    outcome, trace, (push,) = result.outcome, result.trace, result.pushes
    end = push.start + push.duration
    settled = outcome.settled_at
    row = {
        "outcome": outcome.result.value,
        "reason": outcome.reason.value,
        "time_of_fall": outcome.time_of_fall,
        "delivered_impulse": push.delivered_impulse,
        "regulator_slack_end": _number(push.regulator_slack),
        "tracking_slack_end": _number(push.tracking_slack),
        "in_regulator_set_end": push.in_regulator_set,
        "in_tracking_set_end": push.in_tracking_set,
        "chosen": push.chosen,
        "steps": outcome.steps_taken,
        "settle_time": None if settled is None else max(0.0, settled - end),
        "peak_torque_use": _peak(trace["torque_use"]),
        "peak_speed_use": _peak(trace["speed_use"]),
        "saturated_share": _share(trace["saturated"]),
        "trace_hash": trace_hash(trace.values, trace.channels),
    }
    return row | _decided(row, result.decisions, push.start)


def _decided(row: Mapping[str, Any], decisions: Sequence[Mapping[str, Any]], start: float) -> dict[str, Any]:
    """What the sets said when the regulator was given up; if it never was, at the end of the push."""
    for decision in decisions:
        if decision["time"] >= start - _ROUNDING and (decision["controller"] == "tracker" or decision["outside_all"]):
            found = {
                name: decision[name]
                for name in ("regulator_slack", "tracking_slack", "in_regulator_set", "in_tracking_set")
            }
            # No step within reach is no set to be in.
            if found["tracking_slack"] is None:
                found["tracking_slack"] = -math.inf
            return {f"{name}_decision": value for name, value in found.items()} | {
                "outside_all": decision["outside_all"]
            }
    names = ("regulator_slack", "tracking_slack", "in_regulator_set", "in_tracking_set")
    found = {f"{name}_decision": row[f"{name}_end"] for name in names}
    inside = (row["in_regulator_set_end"], row["in_tracking_set_end"])
    return found | {"outside_all": None if inside == (None, None) else not any(inside)}


def _number(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else float(value)


def _peak(values: Array) -> float | None:
    there = values[np.isfinite(values)]
    return float(there.max()) if there.size else None


def _share(values: Array) -> float | None:
    there = values[np.isfinite(values)]
    return float(np.mean(there > 0)) if there.size else None
