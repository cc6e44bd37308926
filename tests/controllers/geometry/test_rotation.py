"""Rotations of single vectors against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers.geometry.rotation import cross, from_quaternion, skew, to_quaternion, turn

# A few roundings of numbers of the order of one.
ROUNDING = 1e-14


@pytest.mark.parametrize("length", [0.0, 1e-9, 0.9e-6, 1.1e-6, 1e-3, 1.0, 3.0])
def test_turn_is_the_rotation_about_a_vector(length: float) -> None:
    vector = length * np.array([2.0, -1.0, 2.0]) / 3.0
    np.testing.assert_allclose(turn(vector), Rotation.from_rotvec(vector).as_matrix(), rtol=0, atol=ROUNDING)


def test_cross_and_skew_are_the_cross_product() -> None:
    a, b = np.random.default_rng(1).normal(size=(2, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), rtol=0, atol=ROUNDING)


def test_quaternions_there_and_back_wherever_their_largest_component_is() -> None:
    rng = np.random.default_rng(2)
    largest = set()
    for quaternion in rng.normal(size=(200, 4)):
        quaternion /= np.linalg.norm(quaternion)
        rotation = from_quaternion(quaternion)
        np.testing.assert_allclose(
            rotation, Rotation.from_quat(quaternion, scalar_first=True).as_matrix(), rtol=0, atol=ROUNDING
        )
        back = to_quaternion(rotation)
        largest.add(int(np.abs(back).argmax()))
        np.testing.assert_allclose(back * np.sign(back @ quaternion), quaternion, rtol=0, atol=ROUNDING)
    assert largest == {0, 1, 2, 3}
