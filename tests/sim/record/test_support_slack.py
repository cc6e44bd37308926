"""How far the ZMP is from the edge: against the polygon of the soles, worked out anew."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import Observation
from models.robot import Robot, load_robot
from sim.record.support_slack import SupportSlack
from tests.controllers.sight import seen

ROBOT = load_robot("utmu2")
# Two roundings of numbers below one. The polygon leaves out corners that are up to 1e-9 m beyond its edges.
ROUNDING, COLLINEAR = 1e-12, 1e-8


def standing(yaw: float, *, left: float = 30.0, right: float = 30.0, zmp: tuple[float, float]) -> Observation:
    found = seen((0.02, 0.05), (-0.01, -0.04), yaw)
    feet = {side: replace(found.feet[side], force=force) for side, force in (("left", left), ("right", right))}
    return replace(found, feet=feet, zmp=np.array(zmp))


def anew(observation: Observation, robot: Robot = ROBOT) -> float:
    sole = robot.sole_vertices["left"]
    feet = [foot for foot in observation.feet.values() if foot.force > 0.0]
    polygon = support_polygon([Foot(position=foot.position[:2], yaw=foot.yaw, sole=sole) for foot in feet])
    return polygon.slack(observation.zmp)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0])
@pytest.mark.parametrize(("left", "right"), [(30.0, 30.0), (30.0, 0.0), (0.0, 30.0)])
@pytest.mark.parametrize("zmp", [(0.0, 0.04), (0.03, -0.05), (0.4, 0.4)])
def test_it_is_that_of_the_soles_on_the_floor(yaw: float, left: float, right: float, zmp: tuple[float, float]) -> None:
    observation = standing(yaw, left=left, right=right, zmp=zmp)
    assert SupportSlack(ROBOT).of(observation) == pytest.approx(anew(observation), abs=ROUNDING)


def test_it_is_that_of_soles_with_any_number_of_corners_anywhere() -> None:
    """Soles apart, overlapping, side by side with corners in one line, and one upon the other."""
    round_sole = 0.04 * np.array([[math.cos(i * math.pi / 8), math.sin(i * math.pi / 8)] for i in range(16)])
    robots = ROBOT, replace(ROBOT, sole_vertices=dict.fromkeys(("left", "right"), round_sole))
    rng = np.random.default_rng(5)
    for case in range(400):
        robot, yaw = robots[case % 2], 0.0 if case % 3 == 0 else float(rng.uniform(-1.0, 1.0))
        left, right = rng.uniform(-0.1, 0.1, (2, 2))
        if case % 5 == 0:
            right[0] = left[0]
        if case % 20 == 0:
            right = left
        observation = replace(seen(tuple(left), tuple(right), yaw), zmp=rng.uniform(-0.2, 0.2, 2))
        feet = {side: replace(foot, force=30.0) for side, foot in observation.feet.items()}
        observation = replace(observation, feet=feet)
        assert SupportSlack(robot).of(observation) == pytest.approx(anew(observation, robot), abs=COLLINEAR)


def test_in_the_air_there_is_none() -> None:
    assert math.isnan(SupportSlack(ROBOT).of(standing(0.0, left=0.0, right=0.0, zmp=(0.0, 0.0))))
    assert math.isnan(SupportSlack(ROBOT).of(standing(0.0, zmp=(math.nan, math.nan))))
