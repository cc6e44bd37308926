"""What an error of the ZMP leaves of the regulator's set, under the designed gain and the one that there is."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from controllers import gains
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.limits import no_step_limit, recoverable_delta_v
from controllers.admissible.moa import regulator_set
from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.gains import Gain, GainError
from controllers.geometry.support_polygon import SupportPolygon, standing_feet, support_polygon
from controllers.pendulum import Pendulum
from models.robot import Robot

DIRECTIONS = tuple(range(0, 360, 45))


def stand(robot: Robot) -> tuple[SupportPolygon, Any]:
    """The support polygon of a robot in its stand, and the (2,) middle of its feet [m]."""
    feet = [*standing_feet(robot).values()]
    return support_polygon(feet), 0.5 * (feet[0].position + feet[1].position)


def sets_left(
    robot: Robot, pendulum: Pendulum, designed: Gain, identified: float, errors: dict[str, float]
) -> list[dict[str, Any]]:
    """Recoverable velocity without a step, for both gains and each ZMP error.

    Args:
        robot: in its stand.
        pendulum: model and period.
        designed: the gain of the scenario.
        identified: DCM gain k that was found.
        errors: name -> largest error of the ZMP along each axis [m].

    Returns:
        For each gain and error the least and the mean over eight directions [m/s], and the mean's share of what any
        law could hold; null with a reason if there is no set, and the largest error that leaves one, if that is why.
    """
    polygon, centre = stand(robot)
    limits = [no_step_limit(pendulum, polygon, math.radians(way), centre) for way in DIRECTIONS]
    makers: dict[str, Callable[[], Gain]] = {
        "designed": lambda: designed,
        "identified": lambda: gains.dcm(pendulum, identified),
    }
    rows = []
    for which, make in makers.items():
        for name, size in errors.items():
            row: dict[str, Any] = {"gain": which, "error": name, "zmp_error": size}
            row |= {"least": None, "mean": None, "share": None, "withstood": None, "why": None}
            rows.append(row)
            try:
                error = ZmpError.box(size) if size else None
                found = regulator_set(pendulum, make(), polygon, centre, error=error)
            except EmptySetError as empty:
                row |= {"withstood": empty.w_bar, "why": str(empty)}
                continue
            except (GainError, MoaError) as reason:
                row["why"] = str(reason)
                continue
            speeds = [recoverable_delta_v(found, math.radians(way)) for way in DIRECTIONS]
            mean = sum(speeds) / len(speeds)
            row |= {"least": min(speeds), "mean": mean, "share": mean / (sum(limits) / len(limits))}
    return rows
