"""The choice of the foothold and of the ZMP."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_sets import StepSets
from models.robot import Side
from tests.controllers.nstep.stepping_plane import PENDULUM, draw, rim
from tests.controllers.nstep.stepping_sets import NOMINAL, SETS, SOLVER, WITHSTANDING


@pytest.mark.parametrize("sets", [NOMINAL, SETS["diamond"], SETS["sideways"]])
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_foothold_is_the_one_nearest_to_the_wanted_with_the_slack_asked_for(sets: StepSets, steps: int) -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(15):
        _, stance, ticks, swing, time = draw(sets, rng)
        margin, left = float(rng.choice([0.0, 0.005, 0.01])), ticks * PENDULUM.dt
        dcm = rim(sets, (steps, stance, left, swing, time), rng, float(rng.choice([-0.01, 1e-4, 0.015])))
        toward = rng.uniform(-0.2, 0.2, 2)
        choice = choose_foothold(sets, dcm, stance, left, swing, time, steps, toward=toward, margin=margin)
        last, more = sets.boxes(stance, ticks, swing, time)
        low, high = np.array(last if steps == 1 else more)
        assert (choice.position >= low).all()
        assert (choice.position <= high).all()
        assert sets.tables.usable.slack(choice.zmp) >= -1e-12
        landing = choice.zmp + (dcm - choice.zmp) * math.exp(PENDULUM.omega * left)
        np.testing.assert_allclose(choice.landing_dcm, landing, rtol=0, atol=1e-12)

        grid = np.stack(np.meshgrid(*np.linspace(low, high, 20).T), axis=-1).reshape(-1, 2)
        points = np.vstack((choice.position, grid))
        if steps == 1:
            # How far the DCM less lam p is inside the sole over k, by the best lam out of many.
            lams = np.linspace(0.5 - 0.5 / sets.gain_k, 0.5 + 0.5 / sets.gain_k, 400)
            rest = landing - lams[:, None, None] * points
            slacks = ((sets.sole.v / sets.gain_k - rest @ sets.sole.M.T).min(axis=2)).max(axis=0)
            # Half a step of lam times the longest foothold.
            accuracy = 0.5 / (400 * sets.gain_k) * 0.35
        else:
            other: Side = "left" if stance == "right" else "right"
            slacks = np.array([sets.slacks(landing - p, other, time, None, time)[steps - 2] for p in points])
            accuracy = SOLVER
        if choice.slack < 0.0 and steps == 1:
            # Outside, the distance to a corner of the regulator's set is a matter of definition.
            continue
        assert slacks[0] == pytest.approx(choice.slack, abs=accuracy)
        assert slacks.max() <= choice.slack + accuracy or choice.slack >= margin - 3.0 * SOLVER
        nearer = np.hypot(*(grid - toward).T) < math.dist(choice.position, toward) - 1e-3
        assert not (slacks[1:][nearer] >= min(choice.slack, margin) + accuracy).any()
        found += choice.slack >= margin - 3.0 * SOLVER
    assert 3 <= found <= 14


def test_any_state_however_far_out_has_a_foothold_within_reach() -> None:
    rng, every = np.random.default_rng(10), [*SETS.values(), *WITHSTANDING.values()]
    for trial in range(300):
        sets = every[trial % len(every)]
        steps, stance, ticks, _, time = draw(sets, rng)
        swing, dcm, toward = (rng.normal(size=2) * rng.choice([0.0, 0.01, 0.1, 1.0, 50.0]) for _ in range(3))
        margin = float(rng.choice([0.0, 0.01, 1.0]))
        choice = choose_foothold(
            sets, dcm, stance, ticks * PENDULUM.dt, swing, time, steps, toward=toward, margin=margin
        )
        low, high = sets.boxes(stance, ticks, swing, time)[0 if steps == 1 else 1]
        assert (choice.position >= low).all()
        assert (choice.position <= high).all()
        assert sets.tables.usable.slack(choice.zmp) >= -1e-12
        slack = float(sets.slacks(dcm, stance, ticks * PENDULUM.dt, swing, time)[steps - 1])
        if sets.error.w_bar == 0.0 and abs(slack) > 1e-7:
            assert (choice.slack > 0.0) == (slack > 0.0)


def test_a_solver_that_gives_up_is_stood_in_for(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, asked = np.random.default_rng(11), []
    for _ in range(8):
        steps, stance, ticks, swing, time = draw(NOMINAL, rng)
        left = ticks * PENDULUM.dt
        asked.append((rim(NOMINAL, (steps, stance, left, swing, time), rng, 1e-4), stance, left, swing, time, steps))
    options = {"toward": np.array([0.0, 0.08]), "margin": 0.05}
    slacks = [choose_foothold(NOMINAL, *question, **options).slack for question in asked]
    monkeypatch.setattr("controllers.nstep.foothold.daqp.solve", lambda *_, **__: (np.full(5, 1e3), 0.0, -1, {}))
    for question, slack in zip(asked, slacks, strict=True):
        assert choose_foothold(NOMINAL, *question, **options).slack == pytest.approx(slack, abs=SOLVER)
