from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers.nstep.certificate import Separation, StepCertificate, Witness, certify_steps
from controllers.nstep.step_sets import step_sets
from models.errors import InputError
from tests.controllers.nstep.stepping_plane import LIMITS, OCTAGON, PENDULUM, SLOW, SOLE, draw, rim

SETS = {
    "rectangle": step_sets(PENDULUM, 1.5, SOLE, LIMITS, (0.15, 0.2), 4, edge=0.002),
    "octagon": step_sets(PENDULUM, 1.2, OCTAGON, SLOW, (0.15,), 3),
    "robust": step_sets(PENDULUM, 1.5, SOLE, LIMITS, (0.15,), 3, zmp_error=0.003),
}
SWING = np.array([0.02, 0.1])


def asked(name: str, inside: float, rng: np.random.Generator, margin: float = 0.0) -> StepCertificate:
    sets = SETS[name]
    steps, stance, ticks, swing, time = draw(sets, rng)
    # From where any next step can follow.
    swing = np.clip(swing, *sets.boxes(stance, ticks, None, time)[1])
    left = ticks * PENDULUM.dt
    dcm = rim(sets, (steps, stance, left, swing, time), rng, inside)
    return certify_steps(sets, dcm, stance, left, swing, time, steps, margin=margin)


@pytest.mark.parametrize("name", SETS)
def test_every_state_is_certified_one_way_or_the_other(name: str) -> None:
    rng = np.random.default_rng(1)
    for inside in (1e-6, 1e-3, -1e-6, -1e-3, -0.3) * 5:
        certificate = asked(name, inside, rng, float(rng.choice([0.0, 0.01])))
        assert certificate.member == (inside > 0.0)
        assert certificate.slack == pytest.approx(inside, abs=1e-9)
        assert certificate.holds(SETS[name])
        if isinstance(certificate.reason, Witness):
            assert certificate.reason.footholds.shape == (certificate.question.steps, 2)
            assert (certificate.reason.slacks >= -1e-8).all()


def test_a_member_beyond_its_margin_keeps_it_to_the_end() -> None:
    sets = SETS["rectangle"]
    middle = sets.polygon(3, "right", 0.1, SWING, step_time=0.15).vertices().mean(axis=0)
    certificate = certify_steps(sets, middle, "right", 0.1, SWING, 0.15, 3, margin=0.01)
    assert isinstance(certificate.reason, Witness)
    # The slack of the solver's margin comes back less its rounding.
    assert (certificate.reason.slacks >= 0.01 - 1e-7).all()
    lines = certificate.render().splitlines()
    assert "recovers in 3 step(s)" in lines[0]
    assert len(lines) == 4


@pytest.mark.parametrize("what", ["footholds", "zmp", "landing_dcm"])
def test_tampered_steps_are_refused(what: str) -> None:
    rng = np.random.default_rng(2)
    for _ in range(10):
        certificate = asked("rectangle", 1e-6, rng)
        assert isinstance(certificate.reason, Witness)
        genuine = getattr(certificate.reason, what)
        for step in range(certificate.question.steps):
            forged = genuine.copy()
            # Half a millimetre away from where the rim allows nothing, or whole steps too far.
            forged[step] += rng.choice([-1.0, 1.0], 2) * (0.5 if what == "footholds" else 5e-4)
            tampered = replace(certificate, reason=replace(certificate.reason, **{what: forged}))
            if what == "zmp" and certificate.question.time_left == 0.0 and step == 0:
                # No time is left for this ZMP to matter, but it may still be outside.
                continue
            assert not tampered.holds(SETS["rectangle"])
    short = replace(certificate.reason, footholds=certificate.reason.footholds[1:])
    assert replace(certificate, reason=short).violation(SETS["rectangle"]) == math.inf


def test_tampered_lines_are_refused() -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        certificate = asked("rectangle", -1e-3, rng)
        assert isinstance(certificate.reason, Separation)
        assert "lost in" in certificate.render()
        line = certificate.reason
        turned = np.array([-line.normal[1], line.normal[0]])
        for forged in (
            replace(line, bound=line.bound - 1e-4),
            replace(line, bound=line.bound + 2e-3),
            replace(line, normal=1.01 * line.normal),
            replace(line, normal=turned),
        ):
            assert not replace(certificate, reason=forged).holds(SETS["rectangle"])
        # What is true of one state is not of one that the line does not part from the set.
        inside = certificate.question._replace(dcm=certificate.question.dcm - 2e-3 * line.normal)
        assert not replace(certificate, question=inside).holds(SETS["rectangle"])


def test_a_certificate_of_other_sets_is_refused() -> None:
    rng, refused = np.random.default_rng(4), 0
    weaker = step_sets(PENDULUM, 1.5, SOLE, replace(LIMITS, max_stride=0.1), (0.15, 0.2), 4, edge=0.006)
    for _ in range(10):
        refused += not asked("rectangle", 1e-6, rng).holds(weaker)
    assert refused == 10


def test_no_state_has_no_certificate() -> None:
    with pytest.raises(InputError, match="dcm"):
        certify_steps(SETS["rectangle"], np.array([math.nan, 0.0]), "right", 0.1, SWING, 0.15, 1)
    with pytest.raises(InputError, match="steps"):
        certify_steps(SETS["rectangle"], np.zeros(2), "right", 0.1, SWING, 0.15, 9)


SHAPES = {
    "rectangle": [[-0.05, -0.03], [0.05, -0.03], [0.05, 0.03], [-0.05, 0.03]],
    "triangle": [[-0.05, -0.035], [0.06, 0.0], [-0.05, 0.035]],
    "kite": [[-0.05, 0.0], [0.0, -0.035], [0.06, 0.0], [0.0, 0.035]],
}


@pytest.mark.parametrize("shape", SHAPES)
def test_outsiders_are_certified_on_any_convex_sole_with_an_error_of_the_zmp(shape: str) -> None:
    sole, limits = np.array(SHAPES[shape]), LIMITS
    sets = step_sets(PENDULUM, 1.5, sole, limits, (0.15, 0.2), 3, zmp_error=0.002)
    rng, outside = np.random.default_rng(0), 0
    for _ in range(40):
        ticks, steps = int(rng.integers(0, round(0.15 / PENDULUM.dt))), int(rng.integers(1, 4))
        swing = np.array([0.0, -limits.stance_width])
        asked = rng.uniform(-0.2, 0.2, 2), "left", ticks * PENDULUM.dt, swing, 0.15, steps
        certificate = certify_steps(sets, *asked)
        outside += not certificate.member
        assert certificate.holds(sets)
    assert 10 <= outside <= 35
