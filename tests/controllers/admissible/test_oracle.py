"""The library `polytope` as an oracle: it takes the definition (23)-(24), far past t*, and finds our sets."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.admissible.moa import MoaSet, regulator_set
from tests.controllers.stances import GAINS, PENDULUM, STANCES

oracle = pytest.importorskip("polytope", reason="pip install okiagari[test]")

BOUNDED = [name for name in GAINS if name != "dcm"]
_SAMPLES = 2000


def definition(moa: MoaSet) -> tuple[np.ndarray, np.ndarray]:
    """M (-F Atilde^i) and vbar for twice as many samples as the set says it needs, nothing left out."""
    loop, block, blocks = moa.gain.closed_loop(PENDULUM), -moa.polygon.M @ moa.gain.F, []
    for _ in range(2 * (moa.t_star + 1)):
        blocks.append(block)
        block = block @ loop
    limits = moa.polygon.v - moa.polygon.M @ moa.centre
    return np.vstack(blocks), np.tile(limits, len(blocks))


@pytest.mark.parametrize("gain", BOUNDED)
@pytest.mark.parametrize("stance", ["hexagon", "yawed"])
def test_same_extent(stance: str, gain: str) -> None:
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES[stance])
    lower, upper = oracle.Polytope(*definition(moa), normalize=False).bounding_box
    for axes in ((0, 1), (2, 3)):
        outline = moa.polytope.project(axes)
        extent = np.concatenate((outline.min(axis=0), outline.max(axis=0)))
        theirs = np.concatenate((lower.ravel()[list(axes)], upper.ravel()[list(axes)]))
        # Two linear-program solvers at their feasibility tolerance of 1e-7 on rows of length about 1.
        assert extent == pytest.approx(theirs, abs=1e-6)


@pytest.mark.parametrize("gain", BOUNDED)
@pytest.mark.parametrize("stance", STANCES)
def test_same_members_up_to_the_boundary(stance: str, gain: str) -> None:
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES[stance])
    rng = np.random.default_rng(1991)
    S, a = definition(moa)
    library = oracle.Polytope(S, a, normalize=False)
    directions = rng.normal(size=(_SAMPLES, 4)) * np.array([1.0, PENDULUM.omega, 1.0, PENDULUM.omega])
    edge = 1.0 / np.max(directions @ S.T / a, axis=1)
    shares = np.where(rng.random(_SAMPLES) < 0.5, 1.0 - 1e-6, 1.0 + 1e-6)
    xbar = (shares * edge)[:, None] * directions
    theirs = library.contains(xbar.T, abs_tol=0.0)
    assert np.array_equal(moa.slacks(xbar + moa.x_C) >= 0.0, theirs)
    assert np.array_equal(theirs, shares < 1.0)


@pytest.mark.parametrize("gain", ["lqr", "double pole"])
def test_library_keeps_no_other_rows(gain: str) -> None:
    """Of the rows past t* it keeps none; of ours it drops those it takes for parallel, which it should not."""
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES["box"])
    reduced = oracle.reduce(oracle.Polytope(*definition(moa)))
    assert len(reduced.b) <= len(moa.a)
    normed = np.column_stack((moa.S, moa.a)) / np.linalg.norm(moa.S, axis=1)[:, None]
    theirs = np.column_stack((reduced.A, reduced.b)) / np.linalg.norm(reduced.A, axis=1)[:, None]
    # Each row the library keeps is one of ours, up to the rounding of its own normalisation.
    assert np.abs(theirs[:, None] - normed[None]).max(axis=2).min(axis=1).max() < 1e-9
