"""What a sweep asked of the motors: medians and peaks over its episodes, and the joints that gave most."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from sim.analysis.statistics import Row, grouped, number, recovered

# Column -> the column of the joint that it is of.
_COLUMNS = {
    "peak_torque_use": "peak_torque_joint",
    "peak_speed_use": "peak_speed_joint",
    "saturated_time": "saturated_joint",
}


def motor_use(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The section `motors` of a summary: an entry for every robot and controller, pendulums apart.

    Of the episodes that were recovered, and of all trains, which end in a fall: `peak_torque_use` and `peak_speed_use`
    [share of stall torque and no-load speed] and `saturated_time` [s], each with its median and maximum over the
    episodes and the joint of the latter; the first two also with that joint's `peak` there [N m], [rad/s].
    """
    counted = [row for row in rows if recovered(row) or row.get("train") is not None]
    bodies = [row for row in counted if number(row.get("peak_torque_use")) is not None]
    return [
        {
            "robot": robot,
            "controller": controller,
            "n": len(members),
            **{name: _use(members, name, joint) for name, joint in _COLUMNS.items()},
        }
        for (robot, controller), members in grouped(bodies, ["robot", "controller"]).items()
    ]


def _use(rows: Sequence[Row], name: str, joint: str) -> dict[str, Any]:
    worst = max(rows, key=lambda row: float(row[name]))
    found = {"median": median(float(row[name]) for row in rows), "max": float(worst[name]), "joint": worst[joint]}
    peak = name.removesuffix("_use")
    return found | ({"peak": float(worst[peak])} if peak != name else {})
