"""The physical limits that thresholds are read beside: without a step, and with Koolen's N steps."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import pandas as pd

from controllers.admissible.limits import capturability_steps
from controllers.pendulum import Pendulum
from models.errors import InputError
from models.robot import Robot, load_robot
from sim.analysis.frame import groups

_PERIOD = 0.001  # [s]; a pendulum wants one, limits do not depend on it
# A step straight along one axis is not bounded by the other one.
_ALONG = 1e-9


@dataclass(frozen=True, kw_only=True)
class PushLimit:
    """How hard a pendulum on these feet can be pushed in a direction by a sudden change of velocity.

    Attributes:
        robot: its name.
        direction_deg: [deg].
        no_step: omega d [m/s], which no controller exceeds without a step.
        steps: Koolen's limit with at most 1, 2, ... steps [m/s]: feet put down at once and weightless, each step the
            longest and the quickest that the scenario allows, straight into the push.
    """

    robot: str
    direction_deg: float
    no_step: float
    steps: tuple[float, ...]

    def as_dict(self) -> dict[str, Any]:
        """The entry of `limits` in a summary."""
        return {
            "robot": self.robot,
            "direction_deg": self.direction_deg,
            "no_step_delta_v": self.no_step,
            "n_step_delta_v": list(self.steps),
            "n_step_over_omega_d": [step / self.no_step for step in self.steps],
        }


def push_limits(frame: pd.DataFrame) -> list[PushLimit]:
    """The limits of every robot and direction of a table; none for rows that do not say d."""
    scale = frame["delta_v_over_omega_d"] * frame["d_edge"]
    known = frame.assign(omega=frame["delta_v"] / scale.where(scale != 0.0))
    known = known[known["omega"] > 0.0]
    robots = {name: _robot(name) for name in known["robot"].unique()}
    return [
        _limit(members.iloc[0], robots[name], name, direction)
        for (name, direction), members in groups(known, ["robot", "direction_deg"])
    ]


def _limit(row: pd.Series, robot: Robot | None, name: str, direction: float) -> PushLimit:
    omega, edge = float(row["omega"]), float(row["d_edge"])
    distances = [edge]
    stepping = json.loads(row["scenario"]).get("stepping")
    if robot is not None and stepping is not None:
        angle = math.radians(direction)
        stride = min(
            float(stepping["max_stride"]) / max(abs(math.cos(angle)), _ALONG),
            robot.hip_reach / max(abs(math.sin(angle)), _ALONG),
        )
        quickest, most = min(stepping["step_times"]), int(stepping["max_steps"])
        distances = capturability_steps(Pendulum(omega, _PERIOD), edge, stride, quickest, most).tolist()
    return PushLimit(
        robot=name,
        direction_deg=direction,
        no_step=omega * edge,
        steps=tuple(omega * distance for distance in distances[1:]),
    )


def _robot(name: str) -> Robot | None:
    try:
        return load_robot(name)
    except InputError:
        return None  # its file has gone since; what was measured is still worth a summary
