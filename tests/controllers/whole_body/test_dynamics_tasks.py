"""How low the COG goes over feet far apart: against the legs' geometry, and on a body that would slide apart else."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.interface import Observation
from controllers.whole_body import dynamics_tasks
from controllers.whole_body.dynamics_tasks import MOST_LOWERED, CogTask
from controllers.whole_body.placo_model import PlacoModel
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.episode import run_episode
from sim.episode.humanoid_world import HumanoidWorld

ROBOT = load_robot("utmu2")
TASK = CogTask(ROBOT, PlacoModel(ROBOT).wrapper.model, 0.002)
STAND = HumanoidWorld(load("quiet", {"variation": {"pose": 0.0}}), ROBOT).observe()
# Rounding of lengths of a metre.
ROUNDING = 1e-12


def over(apart: float, turn: float = 0.0, middle: tuple[float, float] = (0.0, 0.0), aside: float = 0.0) -> Observation:
    """A robot whose feet are so far apart on a line turned by `turn`, its COG beside their middle along it."""
    along = np.array([-math.sin(turn), math.cos(turn), 0.0])
    centre = np.array([*middle, 0.0])
    feet = {
        side: replace(STAND.feet[side], position=centre + sign * 0.5 * apart * along)
        for side, sign in (("left", 1.0), ("right", -1.0))
    }
    height = np.array([0.0, 0.0, ROBOT.cog_height])
    return replace(STAND, feet=feet, cog=centre + height + aside * along)


def leg(apart: float, lowered: float) -> float:
    """Length of either leg with the COG in the middle [m]."""
    standing = math.sqrt(ROBOT.leg_length**2 - ROBOT.hip_reach**2)
    return math.hypot(0.5 * (apart - ROBOT.stance_width), standing - lowered)


def test_it_stands_as_high_as_ever_on_feet_side_by_side() -> None:
    assert TASK.lowered(over(ROBOT.stance_width)) == pytest.approx(0.0, abs=ROUNDING)
    assert TASK.lowered(STAND) == 0.0


def test_legs_of_a_wide_stance_are_as_long_as_in_the_stand() -> None:
    for apart in (0.2, 0.25, 0.3, 0.35):
        lowered = TASK.lowered(over(apart))
        assert 0.0 < lowered < MOST_LOWERED
        assert leg(apart, lowered) == pytest.approx(leg(ROBOT.stance_width, 0.0), abs=ROUNDING)


def test_it_does_not_sink_to_the_floor() -> None:
    assert TASK.lowered(over(2.0)) == MOST_LOWERED


@given(
    apart=st.floats(0.05, 0.6),  # soles do not stand upon each other
    turn=st.floats(-math.pi, math.pi),
    x=st.floats(-5.0, 5.0),
    y=st.floats(-5.0, 5.0),
    aside=st.floats(0.0, 0.1),
)
def test_where_it_stands_and_faces_does_not_matter_and_a_cog_off_the_middle_is_no_higher(
    apart: float, turn: float, x: float, y: float, aside: float
) -> None:
    here = TASK.lowered(over(apart, aside=aside))
    # The farther a leg is from a right angle, the more of a rounding of metres remains.
    assert TASK.lowered(over(apart, turn, (x, y), aside)) == pytest.approx(here, abs=1e-9)
    assert here >= TASK.lowered(over(apart)) - ROUNDING


def test_feet_far_apart_stand_still_on_bent_legs_and_slide_on_straight_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    push = {"start": 1.3, "direction": 302.0, "delta_v": 1.08}
    scenario = load("quiet", {"seed": 2, "duration": 6.0, "pushes": [push]})

    def quiet() -> tuple[str, np.ndarray, float]:
        """What came of it; how far the feet are apart after the steps [m]; the least bend of a knee then [rad]."""
        result = run_episode(scenario)
        trace = result.trace
        later = trace["time"] > 2.3
        apart = np.hypot(trace["left_x"] - trace["right_x"], trace["left_y"] - trace["right_y"])[later]
        knee = min(trace[f"q_{side}_knee"][later].min() for side in ("left", "right"))
        return result.outcome.result.value, apart, knee

    outcome, apart, knee = quiet()
    assert outcome == "recovered"
    assert apart.min() > 0.3, "this push no longer ends in a wide stance: look for another"
    # A sole that holds is pressed into the floor by some tenths of a millimetre; one that slides goes centimetres.
    assert np.ptp(apart) < 0.002
    assert knee > 0.3
    monkeypatch.setattr(dynamics_tasks, "MOST_LOWERED", 0.0)
    assert np.ptp(quiet()[1]) > 0.01
