"""How far the ZMP is from the edge: against the polygon of the soles, worked out anew."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import Observation
from models.robot import load_robot
from sim.record.support_slack import SupportSlack
from tests.controllers.sight import seen

ROBOT = load_robot("utmu2")
# Two roundings of numbers below one; between ticks a known polygon may be kept that is up to 0.1 mm and mrad off.
ROUNDING, KEPT = 1e-12, 3e-4


def standing(yaw: float, *, left: float = 30.0, right: float = 30.0, zmp: tuple[float, float]) -> Observation:
    found = seen((0.02, 0.05), (-0.01, -0.04), yaw)
    feet = {side: replace(found.feet[side], force=force) for side, force in (("left", left), ("right", right))}
    return replace(found, feet=feet, zmp=np.array(zmp))


def anew(observation: Observation) -> float:
    sole = ROBOT.sole_vertices["left"]
    feet = [foot for foot in observation.feet.values() if foot.force > 0.0]
    polygon = support_polygon([Foot(position=foot.position[:2], yaw=foot.yaw, sole=sole) for foot in feet])
    return polygon.slack(observation.zmp)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0])
@pytest.mark.parametrize(("left", "right"), [(30.0, 30.0), (30.0, 0.0), (0.0, 30.0)])
@pytest.mark.parametrize("zmp", [(0.0, 0.04), (0.03, -0.05), (0.4, 0.4)])
def test_it_is_that_of_the_soles_on_the_floor(yaw: float, left: float, right: float, zmp: tuple[float, float]) -> None:
    observation = standing(yaw, left=left, right=right, zmp=zmp)
    assert SupportSlack(ROBOT).of(observation) == pytest.approx(anew(observation), abs=ROUNDING)


def test_it_follows_feet_that_move() -> None:
    slack = SupportSlack(ROBOT)
    for yaw in np.linspace(0.0, 0.01, 40):
        observation = standing(float(yaw), zmp=(0.03, 0.0))
        assert slack.of(observation) == pytest.approx(anew(observation), abs=KEPT)


def test_in_the_air_there_is_none() -> None:
    assert math.isnan(SupportSlack(ROBOT).of(standing(0.0, left=0.0, right=0.0, zmp=(0.0, 0.0))))
    assert math.isnan(SupportSlack(ROBOT).of(standing(0.0, zmp=(math.nan, math.nan))))
