"""What a sweep asked of the motors: medians and peaks over its episodes, and the joints that gave most."""

from __future__ import annotations

from typing import Any

import pandas as pd

from sim.analysis.frame import groups, plain, recovered

# Column -> the column of the joint that it is of.
_COLUMNS = {
    "peak_torque_use": "peak_torque_joint",
    "peak_speed_use": "peak_speed_joint",
    "saturated_time": "saturated_joint",
}


def motor_use(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The section `motors` of a summary: an entry for every robot and controller, pendulums apart.

    Of the episodes that were recovered, and of all trains, which end in a fall: `peak_torque_use` and `peak_speed_use`
    [share of stall torque and no-load speed] and `saturated_time` [s], each with its median and maximum over the
    episodes and the joint of the latter; the first two also with that joint's `peak` there [N m], [rad/s].
    """
    counted = recovered(frame) | frame["train"].notna()
    return [
        {
            "robot": robot,
            "controller": controller,
            "n": len(members),
            **{name: _use(members, name, joint) for name, joint in _COLUMNS.items()},
        }
        for (robot, controller), members in groups(
            frame[counted & frame["peak_torque_use"].notna()], ["robot", "controller"]
        )
    ]


def _use(members: pd.DataFrame, name: str, joint: str) -> dict[str, Any]:
    worst = members.loc[members[name].idxmax()]
    peak = name.removesuffix("_use")
    found = {"median": float(members[name].median()), "max": float(worst[name]), "joint": plain(worst[joint])}
    return found | ({"peak": float(worst[peak])} if peak != name else {})
