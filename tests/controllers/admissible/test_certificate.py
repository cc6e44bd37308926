from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from controllers import gains
from controllers.admissible.certificate import certify, plane_area
from controllers.admissible.gilbert_tan import NotDeterminedError
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.robust import ZmpError
from controllers.admissible.tracking_sets import tracking_sets
from controllers.gains import dcm
from controllers.geometry.polytope import Polytope
from tests.controllers.stances import GAINS, PENDULUM, STANCES, walk


@pytest.mark.parametrize("gain", GAINS)
@pytest.mark.parametrize("error", [None, ZmpError.box(0.002)])
def test_regulator_sets_certify_themselves(gain: str, error: ZmpError | None) -> None:
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES["yawed"], error=error)
    certificate = certify(moa, planes=())
    assert certificate.holds
    assert certificate.t_star == moa.t_star
    assert certificate.rows == len(moa.a)
    assert certificate.bounded == (gain != "dcm")
    assert certificate.bounded == moa.bounded
    # Not vacuous: for a bounded set the last rows are reached exactly.
    if gain != "dcm":
        assert certificate.invariance > -1e-8
    assert certificate.w_bar == (0.002 if error else 0.0)


@pytest.mark.parametrize("gain", ["lqr", "dcm"])
@pytest.mark.parametrize("error", [None, ZmpError.box(0.002)])
def test_tracking_sets_certify_themselves(gain: str, error: ZmpError | None) -> None:
    reference = walk()
    terminal = regulator_set(PENDULUM, GAINS[gain], reference.final, reference.xi[-1, 0::2], error=error)
    certificate = certify(tracking_sets(PENDULUM, GAINS[gain], reference, terminal), planes=("y-yd",), phases=(0, 400))
    assert certificate.holds
    assert certificate.phases == 401
    assert [area.phase for area in certificate.areas] == [0, 400]
    text = certificate.render()
    assert text.startswith(f"tracking sets, {GAINS[gain].name}: certified")
    assert "y-yd, phase 400: slice" in text
    assert ("withstands a ZMP error up to 2 mm" in text) == (error is not None)


def without(moa: MoaSet, rows: np.ndarray) -> MoaSet:
    keep = np.setdiff1d(np.arange(len(moa.a)), rows)
    return dataclasses.replace(
        moa, polytope=Polytope(S=moa.S[keep], a=moa.a[keep]), sample=moa.sample[keep], edge=moa.edge[keep]
    )


def test_a_set_that_is_too_large_is_not_certified() -> None:
    moa = regulator_set(PENDULUM, GAINS["lqr complex"], STANCES["hexagon"])
    late = certify(without(moa, np.flatnonzero(moa.sample == moa.t_star)), planes=())
    assert late.invariance > 1e-8
    assert late.inner <= 1e-8
    early = certify(without(moa, np.flatnonzero(moa.sample == 0)), planes=())
    assert early.inner > 1e-8
    assert not early.holds
    assert "NOT CERTIFIED" in early.render()
    # A set made without the error does not withstand it.
    assert not certify(dataclasses.replace(moa, error=ZmpError.box(1e-4)), planes=()).holds


def test_tracking_sets_that_are_too_large_are_not_certified() -> None:
    reference = walk()
    terminal = regulator_set(PENDULUM, GAINS["dcm"], reference.final, reference.xi[-1, 0::2])
    sets = tracking_sets(PENDULUM, GAINS["dcm"], reference, terminal)
    for k in (0, 400):
        a = sets.a.copy()
        a[sets.start[k] : sets.start[k + 1]] += 1e-6
        certificate = certify(dataclasses.replace(sets, a=a), planes=())
        assert certificate.invariance == pytest.approx(1e-6, rel=1e-2)


def test_areas_are_slices_and_projections() -> None:
    # The box of a cross polytope: each plane's shadow is larger than its cut only where the axes are coupled.
    x = np.array([1.0, 0.5, 0.0, 0.0])
    free = Polytope.box(-np.ones(4), np.ones(4))
    area = plane_area(free, x, "x-y")
    assert area.slice == pytest.approx(4.0)
    assert area.projection == pytest.approx(4.0)
    coupled = free.intersect(Polytope(S=np.array([[1.0, 0.0, 1.0, 0.0]]), a=np.array([1.0])))
    # At y = 0.5 the cut allows x up to 0.5; its shadow on x-xd all of x.
    area = plane_area(coupled, np.array([0.0, 0.0, 0.5, 0.0]), "x-xd")
    assert area.slice == pytest.approx(1.5 * 2.0)
    assert area.projection == pytest.approx(4.0)
    assert plane_area(coupled, np.array([0.0, 0.0, 3.0, 0.0]), "x-xd").slice == 0.0
    moa = regulator_set(PENDULUM, dcm(PENDULUM, 1.5), STANCES["box"])
    certificate = certify(moa, planes=("x-xd", "x-y"))
    assert all(math.isinf(area.slice) for area in certificate.areas[:1])
    # Two positions at rest: the polygon shrunk by k about the centre.
    assert certificate.areas[1].slice == pytest.approx(0.1 * 0.16 / 1.5**2)
    with pytest.raises(KeyError):
        certify(moa, planes=("x-z",))


def test_a_box_has_equal_slices_and_projections_and_a_hexagon_has_not() -> None:
    box = certify(regulator_set(PENDULUM, GAINS["lqr"], STANCES["box"])).areas
    hexagon = certify(regulator_set(PENDULUM, GAINS["lqr"], STANCES["hexagon"])).areas
    for area in box:
        assert area.slice == pytest.approx(area.projection, rel=1e-6)
    assert hexagon[0].projection > 1.2 * hexagon[0].slice


@pytest.mark.parametrize("poles", [(-0.05, -0.05), (-0.2, -0.3)])
def test_sets_of_thousands_of_rows_are_certified(poles: tuple[float, float]) -> None:
    moa = regulator_set(PENDULUM, gains.poles(PENDULUM, poles), STANCES["box"])
    assert len(moa.a) > 3_000
    certificate = certify(moa)
    assert certificate.holds
    # All rows but the last few are there literally, a sample earlier.
    assert certificate.programs < 50
    # The axes are apart, so the shadow is the slice.
    area = certificate.areas[0]
    assert area.projection == pytest.approx(area.slice, rel=1e-9)


def test_a_set_that_needs_too_many_rows_in_4_d_is_refused_by_name() -> None:
    slow, quick = gains.poles(PENDULUM, (-0.05, -0.06)).F, gains.lqr(PENDULUM, (1.0, 1.0), 1.0).F
    mixed = gains.Gain(F=np.vstack((slow[0], quick[1])), name="slow ahead")
    with pytest.raises(NotDeterminedError, match=r"slow ahead.*more than .* constraints of 4 coordinates"):
        regulator_set(PENDULUM, mixed, STANCES["hexagon"])


def test_no_state_is_in_no_set_and_said_so() -> None:
    moa = regulator_set(PENDULUM, GAINS["lqr"], STANCES["box"])
    assert not moa.contains([0.0, np.nan, 0.0, 0.0])
    for x in ([0.0, np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0, 0.0]):
        assert moa.explain(x) == "the state is not finite, and in no set"
