"""Joint speeds from angles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.estimation.joint_filter import JointFilter

DT = 0.001
COUNT = 2 * math.pi / 200_000
NOISE = COUNT / math.sqrt(12)


def followed(angles: np.ndarray, *, every: int = 1) -> np.ndarray:
    """Speeds (k,) that the filter finds, of angles (k,) that a coarse encoder measures every few samples."""
    joint = JointFilter(NOISE, 30.0)
    joint.reset(angles[:1])
    found = []
    for i, angle in enumerate(angles):
        if i:
            joint.predict(DT)
        if i % every == 0:
            joint.correct(np.array([round(angle / COUNT) * COUNT]))
        found.append(joint.velocity[0])
    return np.array(found)


@pytest.mark.parametrize("every", [1, 4])
def test_a_constant_speed_is_found_hardly_worse_than_by_differences(every: int) -> None:
    # no whole number of counts a sample, so that the rounding is like noise
    speed = math.sqrt(3.0)
    found = followed(speed * np.arange(0.0, 2.0, DT), every=every)[100:]
    # of the difference of two roundings, each of count / sqrt(12)
    differences = COUNT / math.sqrt(6.0) / (every * DT)
    assert np.sqrt(((found - speed) ** 2).mean()) < 1.1 * differences
    assert found.mean() == pytest.approx(speed, abs=0.01 * differences)


def test_it_lags_a_swing_by_less_than_a_tick() -> None:
    # 4 Hz, 0.4 rad: a swing leg. A lag of the tick of 2 ms would be worth 2 ms * the acceleration.
    time = np.arange(0.0, 1.0, DT)
    rate = 2 * math.pi * 4
    found, true = followed(0.4 * np.sin(rate * time)), 0.4 * rate * np.cos(rate * time)
    assert np.abs(found - true)[200:].max() < 0.002 * 0.4 * rate**2


def test_two_readings_of_one_moment_count_once() -> None:
    joint = JointFilter(NOISE, 30.0)
    joint.reset(np.zeros(1))
    joint.correct(np.ones(1))
    assert joint.velocity[0] == 0.0
    assert joint.position[0] == 0.0
