"""The physical limits that thresholds are read beside: without a step, and with Koolen's N steps."""

from __future__ import annotations

import json
import math
from typing import Any

import pandas as pd

from controllers.admissible.limits import capturability_steps
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from models.errors import InputError
from models.robot import Robot, load_robot
from sim.analysis.frame import groups

_PERIOD = 0.001  # [s]; a pendulum wants one, limits do not depend on it
# A step straight along one axis is not bounded by the other one.
_ALONG = 1e-9


def push_limits(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The section `limits` of a summary: an entry for every robot and direction; none for rows that do not say d.

    Each has `no_step_delta_v`, omega d [m/s], which no controller exceeds without a step, and `n_step_delta_v` [m/s]
    and `n_step_over_omega_d`, Koolen's limits with at most 1, 2, ... steps: feet put down at once and weightless, each
    step the longest and the quickest that the scenario allows, straight into the push.
    """
    scale = frame["delta_v_over_omega_d"] * frame["d_edge"]
    known = frame.assign(omega=frame["delta_v"] / scale.where(scale != 0.0))
    known = known[known["omega"] > 0.0]
    named = known.drop_duplicates("robot").set_index("robot")["scenario"]
    robots = {name: _robot(json.loads(scenario).get("robot", name)) for name, scenario in named.items()}
    found = []
    for (name, direction), members in groups(known, ["robot", "direction_deg"]):
        row = members.iloc[0]
        omega, edge = float(row["omega"]), float(row["d_edge"])
        steps = [omega * distance for distance in _edges(row, omega, edge, robots[name], direction)]
        found.append(
            {
                "robot": name,
                "direction_deg": direction,
                "no_step_delta_v": omega * edge,
                "n_step_delta_v": steps,
                "n_step_over_omega_d": [step / (omega * edge) for step in steps],
            }
        )
    return found


def _edges(row: pd.Series, omega: float, edge: float, robot: Robot | None, direction: float) -> list[float]:
    """How far the DCM may be with at most 1, 2, ... steps [m]; nothing if the robot is gone or none steps."""
    stepping = json.loads(row["scenario"]).get("stepping")
    if robot is None or stepping is None:
        return []
    angle = math.radians(direction)
    stride = min(
        float(stepping["max_stride"]) / max(abs(math.cos(angle)), _ALONG),
        robot.hip_reach / max(abs(math.sin(angle)), _ALONG),
    )
    quickest, most = min(Stepping.model_validate(stepping).times(robot, _PERIOD)), int(stepping["max_steps"])
    found: list[float] = capturability_steps(Pendulum(omega, _PERIOD), edge, stride, quickest, most)[1:].tolist()
    return found


def _robot(name: str) -> Robot | None:
    try:
        return load_robot(name)
    except InputError:
        return None  # its file has gone since; what was measured is still worth a summary
