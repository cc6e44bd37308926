"""Tables of sweeps made up from a law of who recovers from what; no physics, since only conclusions are tested."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from sim.analysis.frame import as_frame
from sim.results.columns import COLUMNS
from sim.results.table import RESULTS, SUITE, SWEEP, as_table, write_table

DIRECTIONS = tuple(float(angle) for angle in range(0, 360, 45))
OMEGA, HEIGHT, GRAVITY = 4.0, 0.613, 9.81
STEP = 0.05
STRAIGHT_FAILURES = 10

CONTROLLERS = {
    "supervisor": {"label": "supervisor", "colour": "#239023", "marker": "o", "source": None},
    "regulator": {"label": "regulator (never steps)", "colour": "#1f5fd6", "marker": "s", "source": None},
    "statue": {"label": "statue (holds still)", "colour": "#808080", "marker": "^", "source": None},
}
"""How the controllers look, as `sweep.json` has it."""
LIMITS = {"supervisor": 1.5, "regulator": 0.8, "statue": 0.5}
"""Of most of the laws, in units of omega d."""

Law = Callable[[Mapping[str, Any]], bool]


def edge(direction_deg: float) -> float:
    """d of a foot polygon of 0.2 m x 0.16 m [m]."""
    angle = math.radians(direction_deg)
    return min(0.1 / max(abs(math.cos(angle)), 1e-9), 0.08 / max(abs(math.sin(angle)), 1e-9))


def threshold_law(limits: Mapping[str, float], *, pockets: Sequence[tuple[float, int]] = ()) -> Law:
    """Recovers below a controller's limit in units of omega d; the last replica is 1.5 steps weaker.

    `pockets` are further pairs of a change of velocity and a replica that recover.
    """

    def recovers(row: Mapping[str, Any]) -> bool:
        limit = limits[row["controller"]] * OMEGA * edge(row["direction_deg"])
        if any(abs(row["delta_v"] - dv) < 1e-9 and row["replica"] == replica for dv, replica in pockets):
            return True
        return bool(row["delta_v"] <= limit - 1.5 * STEP * (row["replica"] == 4))

    return recovers


def row(law: Law, **parameters: Any) -> dict[str, Any]:
    """One episode."""
    asked = {
        "robot": "utmu2",
        "world": "humanoid",
        "controller": "supervisor",
        "whole_body": "dynamics",
        "body": "trunk",
        "direction_deg": 0.0,
        "delta_v": 0.1,
        "impulse": 0.0,
        "duration": 0.1,
        "start": 1.0,
        "height": 0.0,
        "mass_scale": 1.0,
        "friction": None,
        "sensing": "exact",
        "latency": 0.0,
        "noise_position": 0.0,
        "noise_velocity": 0.0,
        "body_error": 0.0,
        "replica": 0,
    } | parameters
    asked["impulse"] = 40.0 * asked["delta_v"]
    series = json.dumps({name: value for name, value in asked.items() if name not in ("delta_v", "impulse", "replica")})
    name = hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()[:12]
    well = law(asked)
    d, dv = edge(asked["direction_deg"]), asked["delta_v"]
    slack = 0.5 * (d - dv / OMEGA)
    obeys = asked["controller"] != "statue"
    steps = asked["controller"] == "supervisor"
    reach = 1.4 * d - dv / OMEGA if steps else None
    result: dict[str, Any] = dict.fromkeys(COLUMNS)
    result |= asked | {
        "episode": name,
        "suite": "made_up",
        "seed": int(name[:6], 16),
        "series": hashlib.sha256(series.encode()).hexdigest()[:12],
        "push_start": asked["start"],
        "push_direction_deg": asked["direction_deg"],
        "outcome": "recovered" if well else "fell",
        "reason": "at rest with no step under way" if well else "trunk tilted by more than 75 degrees",
        "time_of_fall": None if well else 2.0,
        "delivered_impulse": asked["impulse"],
        "d_edge": d,
        "delta_v_over_omega_d": dv / (OMEGA * d),
        "delta_v_over_sqrt_gh": dv / math.sqrt(GRAVITY * HEIGHT),
        "chosen": "stepping" if obeys and steps and slack < 0.0 else "standing",
        "steps": 2 if steps and slack < 0.0 else 0,
        "settle_time": 1.2 if well else None,
        "peak_torque": 4.0,
        "peak_torque_use": 0.8,
        "peak_torque_joint": "left_knee",
        "peak_speed": 6.0,
        "peak_speed_use": 0.6,
        "peak_speed_joint": "right_knee",
        "saturated_time": 0.02,
        "saturated_joint": "left_knee",
        "real_time_factor": 1.0,
        "wall_time": 5.0,
        "trace_hash": name * 5,
        "scenario": json.dumps({"stepping": {"step_times": [0.25, 0.3], "max_steps": 3, "max_stride": 0.16}}),
        "versions": json.dumps({"python": "3.11", "mujoco": "3.17.0"}),
        "commit": "0" * 40,
    }
    for moment in ("end", "decision"):
        result |= {
            f"regulator_slack_{moment}": slack if obeys else None,
            f"tracking_slack_{moment}": reach,
            f"in_regulator_set_{moment}": slack >= 0.0 if obeys else None,
            f"in_tracking_set_{moment}": None if reach is None else reach >= 0.0,
        }
    result["outside_all"] = slack < 0.0 and (reach is None or reach < 0.0) if obeys else None
    return result


def train_row(survived: int, *, count: int = 10, **parameters: Any) -> dict[str, Any]:
    """A train of which `survived` pushes of 0.5, 0.6 ... omega d were survived; every tenth of a turn, alike."""
    one = row(lambda _: survived == count, delta_v=0.1, **parameters)
    begun = min(survived + 1, count)
    pushes = []
    for number in range(begun):
        way, size = (36.0 * number) % 360.0, 0.5 + 0.1 * number
        stood = number < survived
        told = row(lambda _, stood=stood: stood, direction_deg=way, delta_v=size * OMEGA * edge(way), **parameters)
        kept = ("direction_deg", "delta_v", "impulse", "d_edge", "delta_v_over_omega_d", "delta_v_over_sqrt_gh")
        said = {name: told[name] for name in told if name.endswith(("_end", "_decision")) or name == "outside_all"}
        pushes.append({"start": 1.0 + 3.0 * number, "survived": stood, **{k: told[k] for k in kept}, **said})
    nothing = dict.fromkeys((*kept, *said, "push_direction_deg", "mid_step"))
    # Named by who and which, not by how it went: another run of the same train has the same name.
    key = json.dumps([one["controller"], one["replica"], parameters.get("world"), count])
    name = hashlib.sha256(key.encode()).hexdigest()[:12]
    return (
        one
        | nothing
        | {
            "episode": name,
            "series": name,
            "train": count,
            "pushes_survived": survived,
            "total_impulse": sum(push["impulse"] for push in pushes[:survived]),
            "pushes": json.dumps(pushes),
            "time_of_fall": None if survived == count else pushes[-1]["start"] + 1.0,
        }
    )


def adaptive(
    law: Law,
    *,
    controllers: Sequence[str] = ("supervisor", "regulator", "statue"),
    directions: Sequence[float] = DIRECTIONS,
    levels: int = 40,
    replicas: int = 5,
    **parameters: Any,
) -> list[dict[str, Any]]:
    """Series upward in steps of 0.05 m/s that end after 10 failures in a row."""
    rows = []
    for controller in controllers:
        for direction in directions:
            failures = 0
            for level in range(1, levels + 1):
                for replica in range(replicas):
                    pushed = {"controller": controller, "direction_deg": direction, "replica": replica}
                    one = row(law, delta_v=round(STEP * level, 9), **pushed, **parameters)
                    rows.append(one)
                    failures = 0 if one["outcome"] == "recovered" else failures + 1
                if failures >= STRAIGHT_FAILURES:
                    break
    return rows


def frame(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """The rows as a data frame, in the same order."""
    return as_frame(as_table(rows))


def sweep_facts(rows: Sequence[Mapping[str, Any]], **changes: Any) -> dict[str, Any]:
    """What `sweep.json` says of these rows."""
    return {
        "name": "made_up",
        "description": "Pushes that nobody gave.",
        "suite_hash": "f" * 16,
        "seed": 0,
        "versions": {"python": "3.11", "mujoco": "3.17.0"},
        "commit": "0" * 40,
        "controllers": CONTROLLERS,
        "planned": len(rows),
        "finished": len(rows),
    } | changes


def folder_of(path: Path, rows: Sequence[Mapping[str, Any]], **changes: Any) -> Path:
    """A sweep's folder that holds these rows."""
    path.mkdir(parents=True)
    write_table(as_table(sorted(rows, key=lambda one: str(one["episode"]))), path / RESULTS)
    (path / SWEEP).write_text(json.dumps(sweep_facts(rows, **changes)), encoding="utf-8")
    (path / SUITE).write_text('description = "Pushes that nobody gave."\n', encoding="utf-8")
    return path
