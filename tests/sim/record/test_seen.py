"""What was seen, beside what is: errors are about the loaded soles, wherever the robot believes to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers.interface import Observation
from models.arena import SIDES
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.humanoid_world import HumanoidWorld
from sim.record.seen import in_the_world, loaded_soles, seen_row
from sim.record.trace import SEEN_CHANNELS, SEEN_STANCE_CHANNELS

ROBOT = load_robot("utmu2")
CHANNELS = (*SEEN_CHANNELS, *SEEN_STANCE_CHANNELS)


@pytest.fixture(scope="module")
def truth() -> Observation:
    """Standing on its left foot more than on its right."""
    world = HumanoidWorld(load("quiet"), ROBOT)
    there = world.observe()
    feet = {side: replace(there.feet[side], force=force) for side, force in zip(SIDES, (30.0, 10.0), strict=True)}
    return replace(there, feet=feet)


def drifted(truth: Observation, turn: float, away: tuple[float, float]) -> Observation:
    """The same robot, seen turned about the origin and then shifted."""
    cos, sin = np.cos(turn), np.sin(turn)
    rotation, shift = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]), np.array([*away, 0.0])
    feet = {
        side: replace(foot, position=rotation @ foot.position + shift, yaw=foot.yaw + turn)
        for side, foot in truth.feet.items()
    }
    return replace(
        truth,
        cog=rotation @ truth.cog + shift,
        cog_velocity=rotation @ truth.cog_velocity,
        zmp=rotation[:2, :2] @ truth.zmp + shift[:2],
        feet=feet,
    )


def seen(truth: Observation, sight: Observation) -> dict[str, float]:
    return dict(zip(CHANNELS, seen_row(truth, sight, loaded_soles(truth, sight), ROBOT.omega), strict=True))


def test_drift_of_the_place_is_no_error(truth: Observation) -> None:
    row = seen(truth, drifted(truth, 0.0, (0.3, -0.2)))
    assert (row["dcm_error_x"], row["dcm_error_y"]) == pytest.approx((0.0, 0.0), abs=1e-15)
    assert row["seen_cog_x"] == pytest.approx(truth.cog[0] + 0.3, abs=1e-15)


def test_errors_of_place_and_speed_are_those_of_the_dcm(truth: Observation) -> None:
    place, speed = np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.02, 0.0])
    sight = replace(truth, cog=truth.cog + place, cog_velocity=truth.cog_velocity + speed)
    row = seen(truth, sight)
    assert (row["dcm_error_x"], row["dcm_error_y"]) == pytest.approx((0.01, 0.02 / ROBOT.omega), abs=1e-15)


@pytest.mark.parametrize("turn", [0.0, 0.05, -0.4, np.pi])
def test_a_zmp_asked_for_under_a_sole_is_under_that_sole(turn: float, truth: Observation) -> None:
    sight = drifted(truth, turn, (0.3, -0.2))
    for side in SIDES:
        asked, soles = sight.feet[side].position[:2], loaded_soles(truth, sight)
        assert in_the_world(asked, soles) == pytest.approx(truth.feet[side].position[:2], abs=1e-14)


def test_a_true_sight_leaves_it_where_it_is(truth: Observation) -> None:
    assert in_the_world(np.array([0.02, 0.03]), loaded_soles(truth, truth)) == pytest.approx((0.02, 0.03), abs=1e-16)


def test_in_the_air_there_is_neither_a_place_nor_an_error(truth: Observation) -> None:
    air = replace(truth, feet={side: replace(foot, force=0.0) for side, foot in truth.feet.items()})
    assert np.isnan(in_the_world(np.zeros(2), loaded_soles(air, truth))).all()
    row = seen(air, truth)
    assert np.isnan([row["dcm_error_x"], row["dcm_error_y"]]).all()
    assert row["seen_cog_z"] == truth.cog[2]


def test_the_stance_is_told_as_it_is_seen(truth: Observation) -> None:
    leant = truth.configuration.copy()
    leant[3:7] = [np.cos(0.1), 0.0, np.sin(0.1), 0.0]
    row = seen(truth, replace(truth, configuration=leant, zmp=np.array([0.01, np.nan])))
    assert row["seen_tilt"] == pytest.approx(0.2, abs=1e-15)
    assert (row["seen_zmp_x"], row["seen_left_force"], row["seen_right_force"]) == (0.01, 30.0, 10.0)
    assert np.isnan(seen(truth, replace(truth, configuration=np.empty(0)))["seen_tilt"])
