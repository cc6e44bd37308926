"""The nominal body, simulated beside the world: what it stands on, and that it stays whole."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.estimation.look_ahead import BodyState, Held
from controllers.interface import JointTargets
from models.arena import SIDES
from models.robot import load_robot
from sim.sensing.nominal_body import SimulatedBody

ROBOT = load_robot("utmu2")
BODY = SimulatedBody(ROBOT, at_drive=False)
WEIGHT = ROBOT.mass * ROBOT.gravity


def state(**changed: object) -> BodyState:
    """The robot standing still, each sole carrying half of it."""
    joints = len(ROBOT.stand) - 7
    still = {
        "configuration": ROBOT.stand.copy(),
        "velocity": np.zeros(6 + joints),
        "acceleration": np.zeros(3),
        "load": np.full(2, 0.5 * WEIGHT),
        "loaded": frozenset(SIDES),
        "push": np.zeros(3),
    }
    return BodyState(**(still | changed))  # type: ignore[arg-type]


def held(duration: float) -> list[Held]:
    """The servos keep the stand."""
    joints = ROBOT.stand[7:]
    return [Held(JointTargets(position=joints, velocity=0.0 * joints, torque=0.0 * joints), duration)]


def test_a_robot_that_stands_weighs_on_both_soles() -> None:
    _, _, load = BODY.forward(state(), held(0.3))
    # servos without feed-forward sag, and the robot sways
    assert load.sum() == pytest.approx(WEIGHT, rel=0.05)
    assert load[0] == pytest.approx(load[1], rel=0.05)


def test_nothing_carries_a_robot_in_the_air() -> None:
    lifted = ROBOT.stand.copy()
    lifted[2] += 0.05
    configuration, velocity, load = BODY.forward(state(configuration=lifted, loaded=frozenset()), held(0.004))
    assert load.tolist() == [0.0, 0.0]
    assert velocity[2] == pytest.approx(-0.004 * ROBOT.gravity, rel=0.02)
    assert configuration[2] < lifted[2]


def test_what_cannot_be_simulated_stays_as_it_was() -> None:
    broken = ROBOT.stand.copy()
    broken[7] = np.nan
    given = state(configuration=broken)
    configuration, velocity, load = BODY.forward(given, held(0.004))
    assert configuration is given.configuration
    assert velocity is given.velocity
    assert load is given.load
    assert BODY.forward(state(), held(0.1))[2].sum() == pytest.approx(WEIGHT, rel=0.2)
