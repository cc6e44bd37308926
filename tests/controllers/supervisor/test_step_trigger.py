"""When a step is due: outside of the regulator's sets, or on a way that surely leads there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.gains import dcm
from controllers.supervisor.regulator import Regulator
from controllers.supervisor.step_trigger import SETTLING, SURE, StepTrigger
from scenarios.catalogue import load
from sim.episode.episode import run_episode
from sim.record.outcome import Result
from tests.controllers.stances import PENDULUM, foot

REGULATOR = Regulator.at(PENDULUM, (dcm(PENDULUM, 1.1),), {"left": foot(0.0, 0.05), "right": foot(0.0, -0.05)})
LEAD = 0.1


def watching(speed: float, lead: float = LEAD) -> StepTrigger:
    trigger = StepTrigger(PENDULUM.dt, lead)
    for tick in range(100):
        trigger.see(np.array([speed * tick * PENDULUM.dt, 0.0]))
    return trigger


def test_the_rate_follows_a_steady_dcm_and_is_nothing_at_first() -> None:
    # 0.7^100 of it is left.
    assert watching(0.4).rate == pytest.approx([0.4, 0.0])
    first = StepTrigger(PENDULUM.dt, LEAD)
    first.see(np.array([0.3, 0.2]))
    assert not first.rate.any()


def test_the_dcm_is_looked_ahead_of_unless_a_foot_has_just_landed() -> None:
    here = np.array([0.01, 0.02])
    assert watching(0.4).ahead(here, math.inf) - here == pytest.approx([0.4 * LEAD, 0.0])
    assert watching(0.4).ahead(here, 0.9 * SETTLING) is here
    assert watching(0.4, lead=0.0).ahead(here, math.inf) is here


def test_a_step_is_due_outside_the_sets_or_surely_soon() -> None:
    trigger = watching(0.4)
    centre = REGULATOR.centre

    def reason(at: float, by: float) -> str:
        x = PENDULUM.rest(centre + np.array([at, 0.0]))
        return trigger.reason(REGULATOR, x, REGULATOR.slack(x), np.array([by, 0.0]))

    # Slack falls by the gain for every metre of DCM from the middle forward, down to zero at the rim.
    rim = REGULATOR.slack(PENDULUM.rest(centre + np.array([0.01, 0.0]))) / 1.1 + 0.01
    assert reason(rim + 1e-6, 0.0) == "the state left the regulator's set"
    assert reason(rim - 1e-6, 0.0) == ""
    assert reason(0.0, rim + 0.99 * SURE / 1.1) == ""
    assert reason(0.0, rim + 1.01 * SURE / 1.1) == "the state is about to leave it"


def test_noise_of_the_velocity_leaves_little_of_the_rate() -> None:
    rng, lead = np.random.default_rng(7), 0.1
    noisy, smooth, hasty = (StepTrigger(0.002, lead, steady=steady) for steady in (True, True, False))
    noisy_rates, smooth_rates, hasty_rates = [], [], []
    for tick in range(1000):
        way = np.array([0.1 * 0.002 * tick, 0.0])  # 0.1 m/s
        seen = way + rng.normal(0.0, 0.02 / 6.14, 2)
        noisy.see(seen)
        smooth.see(way)
        hasty.see(seen)
        hasty_rates.append(hasty.rate)
        noisy_rates.append(noisy.rate)
        smooth_rates.append(smooth.rate)
    assert np.allclose(smooth_rates[100:], [0.1, 0.0], atol=1e-9)
    # Extrapolated, three sigma of it are within what a step has to be sure of.
    assert 3 * lead * float(np.std(noisy_rates[200:], axis=0).max()) < 1.5 * SURE
    # One that does not heed the noise is left with 0.53 m/s of it, and sure of steps that are not due.
    assert 3 * lead * float(np.std(hasty_rates[200:], axis=0).min()) > 3 * SURE


@pytest.mark.parametrize("steady", [True, False])
def test_a_scenario_decides_whether_noise_is_heeded_and_hasty_steps_end_in_no_rest(steady: bool) -> None:
    noisy = {"world": "pendulum", "duration": 4.0, "sensing": {"state_noise": {"velocity": 0.02}}}
    result = run_episode(load("quiet", noisy | {"stepping": {"steady_trigger": steady}}), polygons=False)
    assert (result.outcome.result is Result.RECOVERED) is steady
