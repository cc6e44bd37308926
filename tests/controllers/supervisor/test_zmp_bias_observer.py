"""What the ZMP of a standing body stays off by is learned while it is calm, and made up for within the support."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.geometry.support_polygon import SupportPolygon
from controllers.supervisor.zmp_bias_observer import CALM, MOST, SMOOTHING, ZmpBiasObserver
from models.robot import load_robot

DT = 0.002
ROBOT = load_robot("utmu2")
SUPPORT = SupportPolygon(np.array([[-0.05, -0.08], [0.05, -0.08], [0.05, 0.08], [-0.05, 0.08]]))
STILL, WANTED = np.zeros(2), np.array([0.01, 0.0])


def held_back(by: np.ndarray, seconds: float, rate: np.ndarray = STILL) -> np.ndarray:
    """(2,) the command after a body has been off by `by` for a while [m]."""
    offset = ZmpBiasObserver(DT, ROBOT.scale)
    command = offset.made_up(WANTED, SUPPORT)
    for _ in range(round(seconds / DT)):
        offset.see(command + by, rate)
        command = offset.made_up(WANTED, SUPPORT)
    return command


def test_a_constant_offset_is_made_up_for_with_its_time_constant() -> None:
    by = np.array([0.006, -0.01])
    # After one time constant, in steps of a fiftieth of it: (1 - 1/50)^50.
    assert WANTED - held_back(by, SMOOTHING) == pytest.approx((1.0 - (1.0 - DT / SMOOTHING) ** 50) * by)
    # exp(-20) of a centimetre is left.
    assert WANTED - held_back(by, 20 * SMOOTHING) == pytest.approx(by, abs=1e-9)


def test_it_is_made_up_for_only_so_far_and_within_the_support() -> None:
    assert held_back(np.array([0.0, 0.04]), 2.0) == pytest.approx(WANTED - [0.0, MOST])
    offset = ZmpBiasObserver(DT, ROBOT.scale)
    for _ in range(1000):
        offset.see(offset.made_up(np.array([0.045, 0.0]), SUPPORT) - [0.02, 0.0], STILL)
    assert offset.made_up(np.array([0.045, 0.0]), SUPPORT) == pytest.approx([0.05, 0.0])


def test_nothing_is_learned_from_a_body_on_the_move_in_the_air_or_on_another_stance() -> None:
    by = np.array([0.006, 0.0])
    assert np.array_equal(held_back(by, 1.0, np.array([1.01 * CALM, 0.0])), WANTED)
    assert np.array_equal(held_back(np.array([math.nan, math.nan]), 1.0), WANTED)
    offset = ZmpBiasObserver(DT, ROBOT.scale)
    offset.made_up(WANTED, SUPPORT)
    offset.see(WANTED + by, STILL)
    assert offset.made_up(WANTED, SUPPORT)[0] < WANTED[0]
    offset.forget()
    # The measured ZMP is that of a command from before.
    offset.see(WANTED + by, STILL)
    assert np.array_equal(offset.made_up(WANTED, SUPPORT), WANTED)
