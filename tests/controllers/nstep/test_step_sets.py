"""The N-step sets as polygons, and what may be asked of them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from controllers.admissible.robust import EmptySetError
from controllers.geometry.planar import edge_lengths, supports
from controllers.geometry.polytope import Polytope
from controllers.nstep.box import within
from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_sets import StepSets, step_sets
from controllers.reference.reference_program import PlanningError
from models.errors import InputError
from tests.controllers.nstep.stepping_plane import DIAMOND, LIMITS, OCTAGON, PENDULUM, SOLE, draw
from tests.controllers.nstep.stepping_sets import NOMINAL, ROBUST, SETS, SWING, TIMES, WITHSTANDING

DIRECTIONS = np.array([[math.cos(a), math.sin(a)] for a in np.arange(16) * math.pi / 8 + 0.1])


def extent(polygon: Polytope, normals: np.ndarray = DIRECTIONS) -> np.ndarray:
    return supports(polygon.vertices(), normals)


def holds_corners(outer: Polytope, inner: Polytope) -> bool:
    return bool((outer.slack(inner.vertices()) >= -1e-9).all())


@pytest.mark.parametrize("sets", [*SETS.values(), *WITHSTANDING.values()])
def test_slack_is_the_distance_to_the_nearest_edge_line_of_the_polygon(sets: StepSets) -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        _, stance, ticks, swing, time = draw(sets, rng)
        where = swing if rng.uniform() < 0.8 else None
        polygons = [
            sets.polygon(n, stance, ticks * PENDULUM.dt, where, step_time=time) for n in range(1, sets.max_steps + 1)
        ]
        dcm = rng.uniform(-0.3, 0.3, 2)
        slacks = sets.slacks(dcm, stance, ticks * PENDULUM.dt, where, time)
        for slack, polygon in zip(slacks, polygons, strict=True):
            least = float(polygon.slack(dcm))
            # A row that touches a corner only may be nearer than all edges to a point beyond that corner.
            assert slack <= least + 1e-12
            assert (slack >= 0.0) == (least >= 0.0)
            if least >= 0.0:
                assert slack == pytest.approx(least, abs=1e-12)


def test_slacks_of_no_state_are_no_numbers() -> None:
    for dcm in ([math.nan, 0.0], [0.0, math.nan]):
        assert np.isnan(NOMINAL.slacks(np.array(dcm), "left", 0.1, SWING["left"], 0.15)).all()


@pytest.mark.parametrize("sets", [NOMINAL, ROBUST, SETS["octagon"]])
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_dropping_any_row_enlarges_the_polygon(sets: StepSets, steps: int) -> None:
    polygon = sets.polygon(steps, "right", 0.1, SWING["right"], step_time=0.15)
    assert len(polygon.irredundant()) == len(polygon.a)
    np.testing.assert_allclose(np.hypot(*polygon.S.T), 1.0, rtol=1e-12)
    assert (edge_lengths(polygon.S, polygon.a) > 1e-10).all()


def test_mirrored_sides_have_mirrored_sets() -> None:
    mirror = np.array([1.0, -1.0])
    for sets in (NOMINAL, ROBUST):
        for steps in range(1, 5):
            for swing in (None, SWING["right"]):
                right = sets.polygon(steps, "right", 0.1, swing, step_time=0.15)
                other = None if swing is None else swing * mirror
                left = sets.polygon(steps, "left", 0.1, other, step_time=0.15)
                np.testing.assert_allclose(extent(left, DIRECTIONS * mirror), extent(right), rtol=0, atol=1e-12)


@pytest.mark.parametrize("steps", [1, 2, 4])
def test_sets_shrink_with_every_restriction(steps: int) -> None:
    def built(**changed: float) -> Polytope:
        given = {"edge": 0.002, "zmp_error": 0.0} | changed
        limits = replace(LIMITS, **{name: value for name, value in changed.items() if hasattr(LIMITS, name)})
        sets = step_sets(PENDULUM, 1.5, SOLE, limits, TIMES, steps, edge=given["edge"], zmp_error=given["zmp_error"])
        return sets.polygon(steps, "right", 0.1, SWING["right"], step_time=0.15)

    for name, values in (
        ("max_stride", (0.2, 0.12, 0.0)),
        ("edge", (0.0, 0.004, 0.01)),
        ("zmp_error", (0.0, 0.002, 0.004)),
        ("swing_speed", (4.0, 1.0, 0.3)),
        ("swing_acceleration", (math.inf, 40.0, 10.0)),
    ):
        nested = [built(**{name: value}) for value in values]
        for outer, inner in pairwise(nested):
            assert holds_corners(outer, inner)
            assert inner.area < outer.area


def test_longer_steps_bring_the_set_nearer_to_the_sole() -> None:
    """Along any normal: the landing set's extent and that of the sole are mixed by e^{-omega T}."""
    sole = supports(NOMINAL.sole.vertices, DIRECTIONS)
    landing = extent(NOMINAL.polygon(1, "right", 0.0, None, step_time=0.15))
    by_time = [extent(NOMINAL.polygon(1, "right", t, None, step_time=0.15)) for t in (0.05, 0.1, 0.2)]
    for shorter, longer in pairwise(by_time):
        assert (np.abs(longer - sole) < np.abs(shorter - sole)).all()
        assert (np.sign(longer - sole) == np.sign(landing - sole)).all()
    forward = [NOMINAL.polygon(3, "right", 0.1, None, step_time=t).vertices()[:, 0].max() for t in TIMES]
    assert forward[0] > forward[1]


def test_without_error_robust_sets_are_the_others() -> None:
    tiny = step_sets(PENDULUM, 1.5, SOLE, LIMITS, TIMES, 3, edge=0.002, zmp_error=1e-9)
    for steps in (1, 2, 3):
        one, two = (s.polygon(steps, "left", 0.1, SWING["left"], step_time=0.2) for s in (tiny, NOMINAL))
        # Each of at most 3 x 40 ticks takes twice the error times e^{omega dt} - 1 = 0.03.
        np.testing.assert_allclose(extent(one), extent(two), rtol=0, atol=1e-8)


def test_an_error_too_large_for_any_state_names_the_largest() -> None:
    for sole, gain_k in ((SOLE, 1.5), (DIAMOND, 1.3), (OCTAGON, 3.0)):
        with pytest.raises(EmptySetError, match="only below") as caught:
            step_sets(PENDULUM, gain_k, sole, LIMITS, (0.1,), 2, zmp_error=0.04)
        largest = caught.value.w_bar
        assert 0.0 < largest < 0.04
        step_sets(PENDULUM, gain_k, sole, LIMITS, (0.1,), 2, zmp_error=largest)
        with pytest.raises(EmptySetError):
            step_sets(PENDULUM, gain_k, sole, LIMITS, (0.1,), 2, zmp_error=1.001 * largest)


def test_the_foot_in_the_air_lands_where_it_can_get_to() -> None:
    box = ((-0.2, 0.07), (0.2, 0.22))
    assert within(box, 0.0, 0.1, 1.0) == box
    assert within(box, 0.1, 0.1, 0.05) == ((0.05, 0.07), (pytest.approx(0.15), pytest.approx(0.15)))
    # Out of reach: the nearest that it gets to.
    assert within(box, 0.0, 0.0, 0.05) == ((-0.05, 0.05), (0.05, 0.05))
    assert within(box, 0.4, 0.3, 0.05) == ((pytest.approx(0.35), 0.25), (pytest.approx(0.35), 0.25))


def test_what_cannot_be_asked_is_said_in_one_line() -> None:
    good = (PENDULUM, 1.5, SOLE, LIMITS, TIMES, 2)
    for place, value, match in (
        (1, 1.0, "gain_k"), (1, math.nan, "gain_k"), (2, SOLE[::-1], "sole"), (2, SOLE[:, :1], "sole"),
        (2, np.full((4, 2), math.nan), "sole"), (4, (), "step_times"), (4, (0.151,), "step_times"),
        (4, (0.0,), "step_times"), (4, (math.inf,), "step_times"), (5, 0, "max_steps"), (5, 1.5, "max_steps"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=match) as caught:
            step_sets(*good[:place], value, *good[place + 1 :])  # type: ignore[arg-type]
        assert "\n" not in str(caught.value)
    for name, value in (("edge", -1.0), ("edge", math.nan), ("edge", 0.05), ("zmp_error", -1.0)):
        with pytest.raises(InputError, match=name):
            step_sets(*good, **{name: value})
    state, swing, toward = np.zeros(2), SWING["left"], np.array([0.0, -0.08])
    for time_left in (-0.005, 0.205, 0.0025, math.nan, math.inf):
        with pytest.raises(InputError, match="time_left"):
            NOMINAL.slacks(state, "left", time_left, swing, 0.15)
    with pytest.raises(InputError, match="step_time"):
        NOMINAL.slacks(state, "left", 0.1, swing, 0.17)
    with pytest.raises(InputError, match="stance"):
        NOMINAL.slacks(state, "both", 0.1, swing, 0.15)  # type: ignore[arg-type]
    for steps in (0, 5):
        with pytest.raises(InputError, match="steps"):
            choose_foothold(NOMINAL, state, "left", 0.1, swing, 0.15, steps, toward=toward, margin=0.0)
        with pytest.raises(InputError, match="steps"):
            NOMINAL.polygon(steps, "left", 0.1, swing, step_time=0.15)
    for dcm, wanted, margin in (
        (state * math.nan, toward, 0.0),
        (state, np.full(2, math.inf), 0.0),
        (state, toward, -1.0),
    ):
        with pytest.raises(InputError, match="margin"):
            choose_foothold(NOMINAL, dcm, "left", 0.1, swing, 0.15, 1, toward=wanted, margin=margin)


def test_a_foot_with_inertia_swings_as_far_as_half_speeding_up_and_half_braking_takes_it() -> None:
    limits = replace(LIMITS, swing_speed=3.0, swing_acceleration=50.0)
    dt, time = 1e-4, 0.15
    half = round(0.5 * time / dt)
    speed = np.concatenate((np.arange(half), np.arange(half, 0, -1))) * 50.0 * dt
    assert limits.swing_reach(time) == pytest.approx(dt * speed.sum(), rel=1e-9)
    # A long swing is limited by its mean speed, and one without inertia always.
    assert limits.swing_reach(0.4) == pytest.approx(1.2)
    assert replace(limits, swing_acceleration=math.inf).swing_reach(time) == pytest.approx(0.45)
    with pytest.raises(PlanningError):
        replace(limits, swing_acceleration=0.0)
