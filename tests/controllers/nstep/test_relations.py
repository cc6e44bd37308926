"""What the N-step sets are to the sets of one reference, to Koolen's regions and to the parametric set."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.admissible.limits import capturability_steps
from controllers.admissible.moa import regulator_set
from controllers.admissible.robust import ZmpError
from controllers.admissible.tracking_sets import tracking_sets
from controllers.gains import dcm, lqr
from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.nstep.step_sets import StepSets, step_sets
from controllers.reference.reference import Reference
from models.errors import InputError
from models.robot import Side, other
from tests.controllers.nstep.reference_polygons import reference_polygons
from tests.controllers.nstep.stepping_plane import LIMITS, PENDULUM, SOLE
from tests.controllers.stances import PENDULUM as WALKER
from tests.controllers.stances import walk

DIRECTIONS = np.array([[math.cos(a), math.sin(a)] for a in np.arange(16) * math.pi / 8])
TIME = 0.15
# The COG of a reference comes to rest as e^{-omega t}: to a thousandth of the 1e-6 that a reference is allowed.
REST = 4.0


@pytest.mark.parametrize("error", [None, ZmpError.box(0.002), ZmpError.box(0.001, 0.0005)])
@pytest.mark.parametrize(("gain_k", "regulator_k"), [(1.5, 1.5), (1.2, 2.0), (3.0, 1.3)])
def test_sets_of_one_reference_are_its_tracking_sets(gain_k: float, regulator_k: float, error: ZmpError | None) -> None:
    reference = walk()
    terminal = regulator_set(WALKER, dcm(WALKER, regulator_k), reference.final, reference.xi[-1, 0::2], error=error)
    sets = tracking_sets(WALKER, dcm(WALKER, gain_k), reference, terminal)
    polygons = reference_polygons(WALKER, gain_k, reference, terminal)
    assert len(polygons) == sets.m + 1
    for k, polygon in enumerate(polygons):
        full = sets.polytope(k)
        finite = np.isfinite(full.a)
        rows, offsets = full.S[finite][:, [0, 2]], full.a[finite]
        length = np.hypot(*rows.T)
        for row, offset in zip(rows / length[:, None], offsets / length, strict=True):
            same = np.flatnonzero(np.abs(polygon.S - row).max(axis=1) < 1e-9)
            assert len(same) == 1
            assert polygon.a[same[0]] == pytest.approx(offset, abs=1e-9)
        assert len(polygon.a) == len(offsets)


def test_only_dcm_gains_have_sets_in_the_plane_of_the_dcm() -> None:
    reference = walk()
    for gain, bounds in ((lqr(WALKER, (1.0, 1.0), 1.0), None), (dcm(WALKER, 1.5), (0.1, 0.6))):
        terminal = regulator_set(WALKER, gain, reference.final, reference.xi[-1, 0::2], bounds=bounds)
        with pytest.raises(InputError, match="terminal"):
            reference_polygons(WALKER, 1.5, reference, terminal)


def stepping(sets: StepSets, steps: int, rng: np.random.Generator) -> tuple[Reference, list[np.ndarray], list[Side]]:
    """A reference of steps to random footholds with random ZMPs, to rest after the last; its feet and their sides."""
    pendulum, ticks = sets.pendulum, round(TIME / sets.pendulum.dt)
    places: list[np.ndarray] = [np.zeros(2)]
    sides: list[Side] = ["left" if rng.uniform() < 0.5 else "right"]
    for _ in range(steps):
        places.append(places[-1] + rng.uniform(*sets.tables.boxes[sides[-1]]))
        sides.append(other(sides[-1]))
    feet = [Foot(position=place, yaw=0.0, sole=sets.sole.vertices) for place in places]
    final, end = support_polygon(feet[-2:]), 0.5 * (places[-1] + places[-2])
    # Nearer to the middle of the sole than to its edge: tracking has to withstand errors.
    held = [place + 0.4 * rng.dirichlet(np.ones(4)) @ sets.sole.vertices for place in places[:-1]]
    divergent = end
    for zmp in held[::-1]:
        divergent = zmp + (divergent - zmp) * math.exp(-pendulum.omega * TIME)
    x0 = np.zeros(4)
    x0[1::2] = pendulum.omega * divergent
    stepped = np.repeat(held, ticks, axis=0)
    xi = pendulum.rollout(x0, stepped)
    # From the last landing on the DCM is at the end and stays; run open loop, (26) would lose it to rounding.
    time = pendulum.dt * np.arange(1, round(REST / pendulum.dt) + 1)
    beside = (xi[-1, 0::2] - end) * np.exp(-pendulum.omega * time)[:, None]
    rest = np.empty((len(time), 4))
    rest[:, 0::2], rest[:, 1::2] = end + beside, -pendulum.omega * beside
    reference = Reference(
        pendulum=pendulum,
        xi=np.vstack((xi, rest)),
        mu=np.vstack((stepped, np.tile(end, (len(time), 1)))),
        supports=(*(support_polygon([foot]) for foot in feet[:-1]), final),
        support_of=np.concatenate((np.repeat(np.arange(steps), ticks), np.full(len(time), steps))),
        final=final,
    )
    return reference, places, sides[:-1]


@pytest.mark.parametrize("error", [0.0, 0.002])
@pytest.mark.parametrize("gain_k", [1.2, 2.0])
def test_the_n_step_set_holds_the_tracking_set_of_every_reference(gain_k: float, error: float) -> None:
    rng = np.random.default_rng(2)
    sets = step_sets(PENDULUM, gain_k, SOLE, LIMITS, (TIME,), 3, zmp_error=error)
    shares = []
    for steps in (1, 2, 3, 1, 2, 3):
        reference, places, sides = stepping(sets, steps, rng)
        terminal = regulator_set(
            PENDULUM, dcm(PENDULUM, gain_k), reference.final, reference.xi[-1, 0::2],
            error=ZmpError.box(error) if error else None,
        )  # fmt: skip
        polygons = reference_polygons(PENDULUM, gain_k, reference, terminal)
        for i, (place, side) in enumerate(zip(places[:-1], sides, strict=True)):
            for left in (30, 17, 1):
                # The foot in the air is on a straight way to its foothold.
                swing = (places[i + 1] - place) * (1.0 - left / 30) if steps > 1 else None
                own = polygons[(i + 1) * 30 - left]
                outer = sets.polygon(steps - i, side, left * PENDULUM.dt, swing, step_time=TIME)
                assert (outer.slack(own.vertices() - place) >= -1e-9).all()
                shares.append(own.area / outer.area)
    # One reference is some part of the set, never all of it.
    assert min(shares) > 0.01
    assert max(shares) < 0.9


@pytest.mark.parametrize("steps", [1, 2, 3, 4])
def test_koolens_regions_are_approached_from_inside(steps: int) -> None:
    """d_0 is from the middle of a foot to its front edge, a step no longer than the stride: both are straight ahead."""
    reach = float(SOLE[:, 0].max())
    limit = capturability_steps(PENDULUM, reach, LIMITS.max_stride, TIME, steps)[-1]
    gaps = []
    for gain_k in (2.0, 1.1, 1.01, 1.001):
        sets = step_sets(PENDULUM, gain_k, SOLE, LIMITS, (TIME,), steps)
        polygon = sets.polygon(steps, "left", TIME, None, step_time=TIME)
        gaps.append(limit - float(polygon.vertices()[:, 0].max()))
    assert min(gaps) >= -1e-12
    # At the last landing the regulator lacks (1 - 1/k)(stride/2 + reach) of the sole; each step contracts that.
    lacks = [(1.0 - 1.0 / k) * (0.5 * LIMITS.max_stride + reach) for k in (2.0, 1.1, 1.01, 1.001)]
    shrink = math.exp(-steps * PENDULUM.omega * TIME)
    np.testing.assert_allclose(gaps, np.array(lacks) * shrink, rtol=1e-9)
