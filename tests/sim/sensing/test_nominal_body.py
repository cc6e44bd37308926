"""The nominal body, simulated beside the world: what it stands on, and that it stays whole."""

from __future__ import annotations

from dataclasses import replace

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
JOINTS = ROBOT.stand[7:]
STANDING = BodyState(
    configuration=ROBOT.stand,
    velocity=np.zeros(6 + len(JOINTS)),
    acceleration=np.zeros(3),
    load=np.full(2, 0.5 * WEIGHT),
    loaded=frozenset(SIDES),
    push=np.zeros(3),
)


def held(duration: float) -> list[Held]:
    """The servos keep the stand."""
    return [Held(JointTargets(position=JOINTS, velocity=0.0 * JOINTS, torque=0.0 * JOINTS), duration)]


def test_a_robot_that_stands_weighs_on_both_soles() -> None:
    _, _, load = BODY.forward(STANDING, held(0.3))
    # it settles on the soft floor: within 1 % from 0.05 s on
    assert load.sum() == pytest.approx(WEIGHT, rel=0.01)
    assert load[0] == pytest.approx(load[1], rel=0.01)


def test_nothing_carries_a_robot_in_the_air() -> None:
    lifted = ROBOT.stand.copy()
    lifted[2] += 0.05
    configuration, velocity, load = BODY.forward(
        replace(STANDING, configuration=lifted, loaded=frozenset()), held(0.004)
    )
    assert load.tolist() == [0.0, 0.0]
    assert velocity[2] == pytest.approx(-0.004 * ROBOT.gravity, rel=0.02)
    assert configuration[2] < lifted[2]


def test_what_cannot_be_simulated_stays_as_it_was() -> None:
    broken = ROBOT.stand.copy()
    broken[7] = np.nan
    given = replace(STANDING, configuration=broken)
    configuration, velocity, load = BODY.forward(given, held(0.004))
    assert configuration is given.configuration
    assert velocity is given.velocity
    assert load is given.load
    # the next one is simulated again
    assert BODY.forward(STANDING, held(0.1))[2].sum() == pytest.approx(WEIGHT, rel=0.01)


def test_a_state_for_which_nothing_is_held_has_nothing_of_the_one_before() -> None:
    lifted = ROBOT.stand.copy()
    lifted[2] += 0.05
    assert not BODY.forward(replace(STANDING, configuration=lifted, loaded=frozenset()), held(0.004))[2].any()
    configuration, velocity, load = BODY.forward(STANDING, [])
    assert configuration is STANDING.configuration
    assert velocity is STANDING.velocity
    assert load is STANDING.load
