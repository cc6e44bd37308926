"""Membership if and only if the closed loop keeps the ZMP inside, over systems nobody chose."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.moa import regulator_set
from controllers.admissible.tracking_sets import tracking_sets
from controllers.gains import Gain, GainError, dcm, lqr, poles
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference
from tests.controllers.closed_loop import AFTER, least_slack, random_polygon
from tests.controllers.stances import walk

# Rows of a set are products of up to a thousand samples; beside them the boundary is off by a millionth.
CLOSE = 1e-6
RAYS = 600
SEEDS = 32


def random_gain(rng: np.random.Generator, pendulum: Pendulum) -> Gain:
    """A stabilising gain: LQR, real or complex poles, DCM, or different axes that see one another."""
    w, kind = pendulum.omega, rng.integers(5)
    if kind == 0:
        return lqr(pendulum, tuple(10.0 ** rng.uniform(-1.0, 2.0, 2)), 10.0 ** rng.uniform(-1.0, 1.0))
    if kind == 1:
        return poles(pendulum, tuple(-w * rng.uniform([0.3, 1.2], [0.8, 4.0])))
    if kind == 2:
        p = complex(-w * rng.uniform(0.3, 2.0), w * rng.uniform(0.1, 1.5))
        return poles(pendulum, (p, p.conjugate()))
    if kind == 3:
        return dcm(pendulum, rng.uniform(1.05, 3.0))
    F = np.zeros((2, 4))
    for axis in (0, 1):
        F[axis, 2 * axis : 2 * axis + 2] = poles(pendulum, tuple(-w * rng.uniform([0.5, 1.5], [0.8, 3.0]))).F[0, :2]
    F[0, 2:] = rng.uniform(-0.05, 0.05, 2) * [1.0, 1.0 / w]
    return Gain(F=F, name="coupled")


def random_pendulum(rng: np.random.Generator) -> Pendulum:
    return Pendulum.from_height(rng.uniform(0.2, 1.0), 9.81, float(rng.choice([0.005, 0.01, 0.02])))


def on_both_sides(rays: np.ndarray, edge: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Factors (4, N): two anywhere, and two a millionth inside and outside."""
    return np.stack((
        rng.uniform(0.0, 2.0, len(rays)) * edge, rng.uniform(0.9, 1.1, len(rays)) * edge,
        (1.0 - CLOSE) * edge, (1.0 + CLOSE) * edge,
    ))  # fmt: skip


@pytest.mark.parametrize("seed", range(SEEDS))
def test_regulator_sets_of_random_systems(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pendulum, polygon = random_pendulum(rng), random_polygon(rng)
    gain = random_gain(rng, pendulum)
    centre = polygon.centre + 0.3 * polygon.slack(polygon.centre) * rng.uniform(-1.0, 1.0, 2)
    moa = regulator_set(pendulum, gain, polygon, centre)
    rays = rng.normal(size=(RAYS, 4)) * np.tile([1.0, pendulum.omega], 2)
    # Where the set ends along a ray is only a guess to aim at; what is a member, the simulation decides.
    usage = (rays @ moa.S.T) / moa.a
    edge = 1.0 / usage.max(axis=1)
    x = moa.x_C + (rays * on_both_sides(rays, edge, rng)[..., None]).reshape(-1, 4)
    horizon = moa.t_star + round(AFTER / pendulum.dt)
    admissible = least_slack(pendulum, gain, x, [(centre, moa.x_C, polygon)] * horizon) >= 0.0
    np.testing.assert_array_equal(moa.slacks(x) >= 0.0, admissible)
    assert admissible[2 * RAYS : 3 * RAYS].all()
    assert not admissible[3 * RAYS :].any()


def random_reference(rng: np.random.Generator, pendulum: Pendulum) -> Reference:
    """A motion over random supports that ends at rest, its ZMP anywhere well inside."""
    m, parts = int(rng.integers(20, 120)), int(rng.integers(1, 4))
    supports = tuple(random_polygon(rng) for _ in range(parts))
    support_of = np.sort(rng.integers(0, parts, m))
    mu = np.array([0.7 * supports[i].centre + 0.3 * supports[i].vertices[rng.integers(3)] for i in support_of])
    # Backward from rest over the final support; the start is then whatever it has to be.
    final = supports[-1]
    xi = [pendulum.rest(final.centre)]
    back = np.linalg.inv(pendulum.A)
    for zmp in mu[::-1]:
        xi.append(back @ (xi[-1] - pendulum.B @ zmp))
    return Reference(
        pendulum=pendulum, xi=np.array(xi[::-1]), mu=mu, supports=supports, support_of=support_of, final=final
    )


@pytest.mark.parametrize("seed", range(SEEDS))
def test_tracking_sets_of_random_references(seed: int) -> None:
    rng = np.random.default_rng(1_000 + seed)
    pendulum = random_pendulum(rng)
    gain, reference = random_gain(rng, pendulum), random_reference(rng, pendulum)
    terminal = regulator_set(pendulum, gain, reference.final, reference.xi[-1, 0::2])
    sets = tracking_sets(pendulum, gain, reference, terminal)
    m = reference.m
    for k in sorted({0, m, *rng.integers(0, m, 2).tolist()}):
        part = sets.polytope(k)
        finite = np.isfinite(part.a)
        room = part.a[finite] - part.S[finite] @ reference.xi[k]
        rays = rng.normal(size=(RAYS // 3, 4)) * np.tile([1.0, pendulum.omega], 2)
        edge = 1.0 / ((rays @ part.S[finite].T) / room).max(axis=1)
        x = reference.xi[k] + (rays * on_both_sides(rays, edge, rng)[..., None]).reshape(-1, 4)
        plan = [(reference.mu[i], reference.xi[i], reference.support(i)) for i in range(k, m)]
        plan += [(terminal.centre, terminal.x_C, reference.final)] * (terminal.t_star + round(AFTER / pendulum.dt))
        admissible = least_slack(pendulum, gain, x, plan) >= 0.0
        np.testing.assert_array_equal(sets.slacks(k, x) >= 0.0, admissible)
        n = len(rays)
        assert admissible[2 * n : 3 * n].all()
        assert not admissible[3 * n :].any()


def test_the_suite_looks_at_a_hundred_thousand_states() -> None:
    # Two to four phases a reference: three on average, of which at least two differ.
    assert SEEDS * 4 * RAYS + SEEDS * 2 * 4 * (RAYS // 3) > 100_000


def test_whatever_the_gain_there_is_a_set_or_a_typed_refusal() -> None:
    rng, refused = np.random.default_rng(7), []
    pendulum = random_pendulum(rng)
    base = dcm(pendulum, 1.5).F
    for _ in range(200):
        gain = Gain(F=base + rng.normal(size=(2, 4)) * np.tile([0.5, 0.2], 2), name="random")
        moa = None
        try:
            moa = regulator_set(pendulum, gain, random_polygon(rng), max_samples=256)
        except (GainError, MoaError) as error:
            refused.append(str(error))
        assert moa is None or moa.contains(moa.x_C)
    assert 20 < len(refused) < 180
    assert all("gain 'random'" in reason for reason in refused)


def test_walk_of_the_paper_at_random_gains() -> None:
    reference = walk()
    for seed in range(2):
        rng = np.random.default_rng(seed)
        gain = random_gain(rng, reference.pendulum)
        terminal = regulator_set(reference.pendulum, gain, reference.final, reference.xi[-1, 0::2])
        sets = tracking_sets(reference.pendulum, gain, reference, terminal)
        assert (sets.slack_all(reference.xi[0])[0]) >= 0.0
        assert min(sets.slack(k, reference.xi[k]) for k in range(0, reference.m, 7)) >= -1e-9
