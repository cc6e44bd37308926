"""What a sole adds to the programs of the whole body, against rotations by hand."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.geometry.rotation import turn
from controllers.multibody.sole_terms import rotation_vector, sole_terms

# Numbers of order one, some dozen roundings.
ROUNDING = 1e-12


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, -2.0, 3.1])
def test_a_rotation_vector_is_what_was_turned_by(angle: float) -> None:
    vector = angle * np.array([0.6, -0.48, 0.64])
    np.testing.assert_allclose(rotation_vector(turn(vector)), vector, rtol=0, atol=1e-9 * max(1.0, abs(angle)))


def test_a_sole_on_a_body_without_joints_moves_with_it() -> None:
    rng = np.random.default_rng(1001)
    where, velocity, turning = rng.normal(size=(3, 3))
    ankle, sole, offset = turn(rng.normal(size=3)), turn(rng.normal(size=3)), rng.normal(size=3)
    # spatial velocity at the world's origin from linear and angular velocity there
    jacobian, qd = np.eye(6), np.concatenate([velocity, turning])
    local, rotation, missing = np.zeros((2, 6, 6)), np.empty((2, 3, 3)), np.empty((2, 6))
    foot = np.zeros(16)
    chain = np.zeros(0, dtype=np.int64)
    placed = np.concatenate([sole.ravel(), offset])
    sole_terms(1, jacobian, qd, ankle, where, placed, chain, foot, local, rotation, missing)

    R, middle = ankle @ sole, where + ankle @ offset
    np.testing.assert_allclose(rotation[1], R, rtol=0, atol=ROUNDING)
    speed = velocity + np.cross(turning, middle)
    np.testing.assert_allclose(local[1] @ qd, np.concatenate([R.T @ speed, R.T @ turning]), rtol=0, atol=ROUNDING)
    # at zero spatial acceleration a point of the body has that of turning about the origin
    wanted = np.concatenate([R.T @ np.cross(turning, speed), np.zeros(3)])
    np.testing.assert_allclose(missing[1], wanted, rtol=0, atol=ROUNDING)
    assert not local[0].any()


def test_a_foot_is_pulled_to_its_place_and_slowed_down() -> None:
    still, velocity = np.eye(3), np.array([0.3, -0.2, 0.1, 0.0, 0.0, 0.4])
    local, rotation, missing = np.zeros((2, 6, 6)), np.empty((2, 3, 3)), np.empty((2, 6))
    stiffness, damping, turning, slowing = 900.0, 60.0, 400.0, 40.0
    target, wanted, asked = np.array([0.1, 0.2, 0.0]), np.array([1.0, 0.0, 0.5]), np.array([2.0, -3.0, 4.0])
    foot = np.array([0.0, 0.25, 1.0, stiffness, damping, turning, slowing, *target, *wanted, *asked])
    placed = np.concatenate([still.ravel(), np.zeros(3)])
    chain = np.zeros(0, dtype=np.int64)
    sole_terms(0, np.eye(6), velocity, still, np.zeros(3), placed, chain, foot, local, rotation, missing)
    linear = np.cross(velocity[3:], velocity[:3]) - (stiffness * target + damping * (wanted - velocity[:3]) + asked)
    angular = -(turning * np.array([0.0, 0.0, 0.25]) - slowing * velocity[3:])
    np.testing.assert_allclose(missing[0], np.concatenate([linear, angular]), rtol=1e-12, atol=ROUNDING)
