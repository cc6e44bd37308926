from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from controllers.planar import edge_lengths, supports
from controllers.polytope import Polytope
from controllers.robust import EmptySetError
from controllers.step_sets import StepSets, step_sets
from controllers.step_sets_box import within
from models.errors import InputError
from models.robot import Side
from tests.controllers.stepping_plane import (
    DIAMOND,
    LIMITS,
    OCTAGON,
    PENDULUM,
    SLOW,
    SOLE,
    best_by_program,
    best_of_sequences,
    draw,
    recovers,
    rim,
)

TIMES = (0.15, 0.2)
NOMINAL = step_sets(PENDULUM, 1.5, SOLE, LIMITS, TIMES, 4, edge=0.002)
ROBUST = step_sets(PENDULUM, 1.5, SOLE, LIMITS, TIMES, 4, edge=0.002, zmp_error=0.003)
SETS = {
    "rectangle": NOMINAL,
    "slow foot": step_sets(PENDULUM, 1.2, SOLE, SLOW, TIMES, 3),
    "diamond": step_sets(PENDULUM, 2.5, DIAMOND, LIMITS, TIMES, 3),
    "octagon": step_sets(PENDULUM, 1.5, OCTAGON, SLOW, TIMES, 3, edge=0.003),
}
WITHSTANDING = {
    "rectangle": ROBUST,
    "diamond": step_sets(PENDULUM, 2.5, DIAMOND, LIMITS, TIMES, 3, zmp_error=0.002),
    "octagon": step_sets(PENDULUM, 1.5, OCTAGON, SLOW, TIMES, 3, zmp_error=0.003),
}
# The solver keeps its rows to 1e-9 and the DCM grows 3.4-fold over the longest step.
SOLVER = 1e-8
DIRECTIONS = np.array([[math.cos(a), math.sin(a)] for a in np.arange(16) * math.pi / 8 + 0.1])
SWING = {"right": np.array([0.02, 0.1]), "left": np.array([0.02, -0.1])}


def extent(polygon: Polytope, normals: np.ndarray = DIRECTIONS) -> np.ndarray:
    return supports(polygon.vertices(), normals)


def holds_corners(outer: Polytope, inner: Polytope) -> bool:
    return bool((outer.slack(inner.vertices()) >= -1e-9).all())


@pytest.mark.parametrize("name", SETS)
def test_from_every_member_re_planning_each_tick_recovers(name: str) -> None:
    rng, sets = np.random.default_rng(5), SETS[name]
    for margin in (0.0, 0.01, 0.05) * 5:
        steps, stance, ticks, swing, time = draw(sets, rng)
        inside = float(rng.choice([1e-6, 1e-3]))
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, inside)
        assert sets.slacks(dcm, stance, ticks * PENDULUM.dt, swing, time)[steps - 1] >= inside - 1e-12
        assert recovers(sets, steps, stance, ticks, swing, dcm, time, margin) >= -SOLVER


def test_from_outside_no_sequence_of_footholds_and_zmps_recovers() -> None:
    rng = np.random.default_rng(6)
    near = 0
    for _ in range(25):
        question = draw(NOMINAL, rng)
        steps, stance, ticks, swing, time = question
        outside = float(rng.choice([1e-6, 1e-3]))
        polygon = NOMINAL.polygon(steps, stance, ticks * PENDULUM.dt, swing, step_time=time)
        dcm = rim(NOMINAL, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, -outside)
        normal = polygon.S[np.argmin(polygon.a - polygon.S @ dcm)]
        best = best_of_sequences(NOMINAL, question, dcm, rng, 240, normal)
        grown = outside * math.exp(PENDULUM.omega * PENDULUM.dt * (ticks + (steps - 1) * round(time / PENDULUM.dt)))
        # The distance to the line only grows; of the regulator's set no row is more than twice as far as the line.
        assert best < -0.4 * grown
        near += best > -1.001 * grown
    # The extremes are nearly enough for many of them: the sets are not larger than they need be, nor smaller.
    assert near >= 5


@pytest.mark.parametrize("name", SETS)
def test_one_program_over_all_zmps_and_footholds_agrees(name: str) -> None:
    rng, sets = np.random.default_rng(7), SETS[name]
    for inside in (1e-6, 1e-3, -1e-6, -1e-3) * 6:
        steps, stance, ticks, swing, time = draw(sets, rng)
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, inside)
        assert (best_by_program(sets, (steps, stance, ticks, swing, time), dcm) > 0.0) == (inside > 0.0)


@pytest.mark.parametrize("name", WITHSTANDING)
def test_members_withstand_the_error_of_the_zmp(name: str) -> None:
    rng, sets = np.random.default_rng(8), WITHSTANDING[name]
    w_bar = sets.error.w_bar
    for trial in range(15):
        steps, stance, ticks, swing, time = draw(sets, rng)
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
        lasting = w_bar * rng.choice([-1.0, 1.0], 2)

        def errors(lasting: np.ndarray = lasting, trial: int = trial) -> np.ndarray:
            return lasting if trial % 2 else w_bar * rng.choice([-1.0, 1.0], 2)

        assert recovers(sets, steps, stance, ticks, swing, dcm, time, errors=errors) >= -SOLVER


def test_members_on_the_rim_do_not_withstand_twice_the_error() -> None:
    rng, lost = np.random.default_rng(9), 0
    for _ in range(20):
        steps, stance, ticks, swing, time = draw(ROBUST, rng)
        dcm = rim(ROBUST, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
        away = 2.0 * ROBUST.error.w_bar * -np.sign(dcm - 0.5 * swing)
        lost += recovers(ROBUST, steps, stance, ticks, swing, dcm, time, errors=lambda away=away: away) < -1e-4
    assert lost >= 5


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    gain_k=st.floats(1.05, 4.0),
    half=st.tuples(st.floats(0.02, 0.1), st.floats(0.015, 0.06)),
    stride=st.floats(0.0, 0.4),
    widths=st.tuples(st.floats(0.04, 0.1), st.floats(0.0, 0.2)),
    speed=st.floats(0.3, 6.0),
    share=st.floats(0.0, 0.9),
    seed=st.integers(0, 2**32 - 1),
)
# Feet that only go sideways: the last foothold has a box of no width.
@example(gain_k=2.0, half=(0.0625, 0.0234375), stride=0.0, widths=(0.0625, 0.125), speed=1.0, share=0.0, seed=54)
def test_any_stepper_recovers_from_its_members(
    gain_k: float,
    half: tuple[float, float],
    stride: float,
    widths: tuple[float, float],
    speed: float,
    share: float,
    seed: int,
) -> None:
    narrow = max(widths[0], 2.0 * half[1])
    limits = replace(
        LIMITS,
        max_stride=stride,
        min_width=narrow,
        stance_width=narrow,
        max_width=narrow + widths[1],
        swing_speed=speed,
    )
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) * half
    error = share * min(half) / (1.0 + gain_k / (gain_k - 1.0))
    sets = step_sets(PENDULUM, gain_k, corners, limits, (0.15,), 3, zmp_error=error)
    rng = np.random.default_rng(seed)
    steps, stance, ticks, swing, time = draw(sets, rng)
    # A foot that is not too far out to get back to where any next step can follow.
    _, more = sets.boxes(stance, ticks, None, time)
    swing = np.clip(swing, *more)
    dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
    worst = recovers(sets, steps, stance, ticks, swing, dcm, time, errors=lambda: error * rng.choice([-1.0, 1.0], 2))
    assert worst >= -SOLVER


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
        every = sets.slack_all_phases(dcm, stance, where, time)
        assert every.shape == (round(time / PENDULUM.dt) + 1, sets.max_steps)
        if ticks < len(every):
            np.testing.assert_allclose(every[ticks], slacks, rtol=0, atol=1e-12)


def test_slacks_of_no_state_are_no_numbers() -> None:
    for dcm in ([math.nan, 0.0], [0.0, math.nan]):
        assert np.isnan(NOMINAL.slacks(np.array(dcm), "left", 0.1, SWING["left"], 0.15)).all()
        assert np.isnan(NOMINAL.slack_all_phases(np.array(dcm), "left", SWING["left"], 0.15)).all()


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
        given = {"max_stride": 0.2, "edge": 0.002, "zmp_error": 0.0, "swing_speed": 4.0} | changed
        limits = replace(LIMITS, max_stride=given["max_stride"], swing_speed=given["swing_speed"])
        sets = step_sets(PENDULUM, 1.5, SOLE, limits, TIMES, steps, edge=given["edge"], zmp_error=given["zmp_error"])
        return sets.polygon(steps, "right", 0.1, SWING["right"], step_time=0.15)

    for name, values in (
        ("max_stride", (0.2, 0.12, 0.0)),
        ("edge", (0.0, 0.004, 0.01)),
        ("zmp_error", (0.0, 0.002, 0.004)),
        ("swing_speed", (4.0, 1.0, 0.3)),
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


@pytest.mark.parametrize("sets", [NOMINAL, SETS["diamond"]])
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_foothold_is_the_one_nearest_to_the_wanted_with_the_slack_asked_for(sets: StepSets, steps: int) -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(15):
        _, stance, ticks, swing, time = draw(sets, rng)
        margin, left = float(rng.choice([0.0, 0.005, 0.01])), ticks * PENDULUM.dt
        dcm = rim(sets, (steps, stance, left, swing, time), rng, float(rng.choice([-0.01, 1e-4, 0.015])))
        toward = rng.uniform(-0.2, 0.2, 2)
        choice = sets.foothold(dcm, stance, left, swing, time, steps, toward=toward, margin=margin)
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
        choice = sets.foothold(dcm, stance, ticks * PENDULUM.dt, swing, time, steps, toward=toward, margin=margin)
        low, high = sets.boxes(stance, ticks, swing, time)[0 if steps == 1 else 1]
        assert (choice.position >= low).all()
        assert (choice.position <= high).all()
        assert sets.tables.usable.slack(choice.zmp) >= -1e-12
        slack = float(sets.slacks(dcm, stance, ticks * PENDULUM.dt, swing, time)[steps - 1])
        if sets.error.w_bar == 0.0 and abs(slack) > 1e-7:
            assert (choice.slack > 0.0) == (slack > 0.0)
        every_phase = sets.slack_all_phases(dcm, stance, swing, time)
        assert every_phase[min(ticks, len(every_phase) - 1), steps - 1] == pytest.approx(
            sets.slacks(dcm, stance, min(ticks, len(every_phase) - 1) * PENDULUM.dt, swing, time)[steps - 1], abs=1e-9
        )


def test_a_solver_that_gives_up_is_stood_in_for(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, asked = np.random.default_rng(11), []
    for _ in range(8):
        steps, stance, ticks, swing, time = draw(NOMINAL, rng)
        left = ticks * PENDULUM.dt
        asked.append((rim(NOMINAL, (steps, stance, left, swing, time), rng, 1e-4), stance, left, swing, time, steps))
    options = {"toward": np.array([0.0, 0.08]), "margin": 0.05}
    slacks = [NOMINAL.foothold(*question, **options).slack for question in asked]
    monkeypatch.setattr("controllers.step_sets_foothold.daqp.solve", lambda *_, **__: (np.full(5, 1e3), 0.0, -1, {}))
    for question, slack in zip(asked, slacks, strict=True):
        assert NOMINAL.foothold(*question, **options).slack == pytest.approx(slack, abs=SOLVER)


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
            NOMINAL.foothold(state, "left", 0.1, swing, 0.15, steps, toward=toward, margin=0.0)
        with pytest.raises(InputError, match="steps"):
            NOMINAL.polygon(steps, "left", 0.1, swing, step_time=0.15)
    for dcm, wanted, margin in (
        (state * math.nan, toward, 0.0),
        (state, np.full(2, math.inf), 0.0),
        (state, toward, -1.0),
    ):
        with pytest.raises(InputError, match="margin"):
            NOMINAL.foothold(dcm, "left", 0.1, swing, 0.15, 1, toward=wanted, margin=margin)
