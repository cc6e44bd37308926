"""An episode that is told to go on ends by a fall or its time, and is the same until it would have ended."""

from __future__ import annotations

import numpy as np
import pytest

from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import make_plant


def run(scenario: Scenario, *, goes_on: bool) -> Episode:
    robot = load_robot(scenario.robot)
    episode = Episode(scenario, make_plant(scenario, robot), make_controller(scenario, robot), goes_on=goes_on)
    while episode.tick():
        row = dict(zip(episode.channels, episode.row, strict=True))
        assert row["time"] == pytest.approx(episode.time - scenario.timing.control)
        assert (0 in episode.acting) == (np.hypot(row["push_fx"], row["push_fy"]) > 0.0)
    return episode


def test_goes_on_at_rest_until_its_time_is_over() -> None:
    scenario = load("push_left", {"world": "pendulum"})
    short, long = (run(scenario, goes_on=goes_on).result().trace for goes_on in (False, True))
    assert len(short) < len(long) == scenario.ticks
    # The last tick of the short one was not acted any more.
    np.testing.assert_array_equal(short.values[:-1], long.values[: len(short) - 1])


def test_a_fall_ends_it_all_the_same() -> None:
    scenario = load("push_that_fells")
    short, long = (run(scenario, goes_on=goes_on).result() for goes_on in (False, True))
    assert short.outcome == long.outcome
    assert len(short.trace) == len(long.trace) < scenario.ticks
