"""The drag of held references, against work and power by hand, and that it is made up for where it should be."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.whole_body.placo_model import PlacoModel
from controllers.whole_body.servo_drag import SWAY, ServoDrag
from models.robot import load_robot

ROBOT = load_robot("utmu2")
MODEL = PlacoModel(ROBOT).wrapper.model
# A few roundings of a least-squares solution of order one.
ROUNDING = 1e-9


def drag(dt: float = 0.002) -> ServoDrag:
    return ServoDrag(ROBOT, MODEL, dt)


def test_it_goes_with_the_velocity_and_with_the_period() -> None:
    slow = np.array([0.4 * SWAY, -0.2 * SWAY, 1.0])
    once, twice = np.array(drag().made_up(slow)), np.array(drag().made_up(0.5 * slow))
    np.testing.assert_allclose(once, 2.0 * twice, rtol=ROUNDING)
    np.testing.assert_allclose(drag(0.004).made_up(slow), 2.0 * once, rtol=ROUNDING)
    assert once[0] > 0.0 > once[1]


def test_a_push_is_braked_all_the_same() -> None:
    assert drag().made_up(np.array([1.0, -1.0, 0.0])) == drag().made_up(np.array([SWAY, -SWAY, 0.0]))


def test_ankles_and_hips_alone_give_less_than_what_is_found() -> None:
    # A pendulum on the ankles with an upright trunk turns ankles and hips by v / z_G at least, in both legs.
    stiffness = dict(zip(ROBOT.joint_names, ROBOT.servo_stiffness.tolist(), strict=True))
    joints = [stiffness[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle_pitch", "hip_pitch")]
    least = 0.5 * 0.002 * sum(joints) / ROBOT.cog_height**2 / ROBOT.mass
    found = drag().made_up(np.array([SWAY, 0.0, 0.0]))[0] / SWAY
    assert 0.6 * least < found < 2.0 * least


def test_a_reference_that_is_not_held_drags_nothing() -> None:
    assert drag(0.0).made_up(np.ones(3)) == pytest.approx((0.0, 0.0), abs=0.0)
