"""What the estimator believes follows from sensors and robot, unless its options say otherwise."""

from __future__ import annotations

import math
from typing import Any

import pytest

from controllers.estimation.beliefs import Beliefs, SensorFigures, beliefs
from controllers.estimation.options import EkfOptions
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_estimator

ROBOT = load_robot("utmu2")


def believed(**sensing: Any) -> Beliefs:
    """What the estimator of a scenario believes."""
    made = make_estimator(load("quiet", {"sensing": sensing}), ROBOT)
    found: Beliefs = made._believed  # type: ignore[union-attr]
    return found


def test_the_presets() -> None:
    typical, cheap = believed(preset="typical"), believed(preset="cheap")
    assert typical.encoder == 1e-5
    assert cheap.encoder == pytest.approx(2.0 * math.pi / 2**14 / math.sqrt(12.0))
    # the figures that the filter was tuned with
    assert (typical.gyro, typical.accelerometer) == (pytest.approx(0.006, rel=1e-12), pytest.approx(0.1, rel=1e-12))
    assert (typical.gyro_bias, cheap.gyro_bias) == (0.003, 0.01)
    assert cheap.accelerometer > typical.accelerometer


def test_a_figure_of_the_scenario_replaces_the_presets() -> None:
    assert believed(preset="typical", joint={"counts": 2**12}).encoder > 100.0 * 1e-6


def test_what_an_option_says_is_believed() -> None:
    given = {"name": "ekf", "encoder": 2e-4, "push_threshold": 0.0, "edge": 0.0}
    found = believed(preset="cheap", estimator=given)
    assert (found.encoder, found.push_threshold, found.edge) == (2e-4, 0.0, 0.0)


def test_for_this_robot_the_numbers_are_its_own() -> None:
    found = beliefs(EkfOptions(), ROBOT, SensorFigures())
    assert (found.push_threshold, found.contact_speed) == (3.0, 0.01)
    assert (found.edge, found.flat) == (pytest.approx(0.004), pytest.approx(0.010))
