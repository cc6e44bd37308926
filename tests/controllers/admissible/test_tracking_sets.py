from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.linalg import block_diag

from controllers.admissible.dcm_plane import limiting_samples
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.tracking_sets import TrackingMismatchError, TrackingSets, tracking_sets
from controllers.gains import Gain, UnstableGainError, dcm
from controllers.geometry.linear_program import LinearProgram
from controllers.pendulum import Pendulum
from tests.controllers.stances import GAINS, PENDULUM, reach_along, walk

WALK = walk()
M = WALK.m
SPREAD = np.array([0.05, 0.3, 0.05, 0.3])
AFTER = 600
PLAIN = ["lqr", "lqr complex", "double pole", "dcm"]
# Hundreds of products of a contraction with numbers below one.
ROUNDING = 1e-11


def terminal(gain: Gain, offset: float = 0.0) -> MoaSet:
    """Of the regulator that takes over, holding a point beside the end of the reference if offset."""
    return regulator_set(PENDULUM, gain, WALK.final, WALK.xi[-1, 0::2] + [offset, -offset])


@pytest.fixture(scope="module")
def all_sets() -> dict[str, TrackingSets]:
    sets = {name: tracking_sets(PENDULUM, GAINS[name], WALK, terminal(GAINS[name])) for name in PLAIN}
    # Another gain, or another place, for the regulator at the end.
    sets["dcm, then lqr"] = tracking_sets(PENDULUM, GAINS["dcm"], WALK, terminal(GAINS["lqr"]))
    sets["dcm, then dcm beside"] = tracking_sets(PENDULUM, GAINS["dcm"], WALK, terminal(dcm(PENDULUM, 1.2), 0.005))
    sets["lqr, then beside"] = tracking_sets(PENDULUM, GAINS["lqr"], WALK, terminal(GAINS["lqr"], 0.005))
    return sets


NAMES = [*PLAIN, "dcm, then lqr", "dcm, then dcm beside", "lqr, then beside"]
PHASES = [0, 19, 37, 155, 399, 400]


def simulated(sets: TrackingSets, k: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ZMP u (T, N, 2) under (8), (27) and, from m on, (18), and the slack (T, N) in the support of the time."""
    p, ref, last = sets.pendulum, sets.reference, sets.terminal
    us, slack = [], []
    for i in range(k, M + last.t_star + AFTER):
        target, error, F = (
            (ref.mu[i], x - ref.xi[i], sets.gain.F) if i < M else (last.centre, x - last.x_C, last.gain.F)
        )
        u = target - error @ F.T
        us.append(u)
        slack.append((ref.support(i) if i < M else last.polygon).slacks(u))
        x = x @ p.A.T + u @ p.B.T
    return np.array(us), np.array(slack)


def boundary(sets: TrackingSets, k: int, rays: np.ndarray) -> np.ndarray:
    """How far (N,) the simulated loop admits each ray (N, 4) from xi_k: the ZMP is affine along it."""
    ref, last = sets.reference, sets.terminal
    base, _ = simulated(sets, k, ref.xi[k][None])
    moved, _ = simulated(sets, k, ref.xi[k] + rays)
    polygons = [ref.support(i) if i < M else last.polygon for i in range(k, k + len(base))]
    room = np.concatenate([p.v - p.M @ u[0] for p, u in zip(polygons, base, strict=True)])
    usage = np.concatenate([(u - b) @ p.M.T for p, u, b in zip(polygons, moved, base, strict=True)], axis=1)
    return reach_along(usage, room)


@pytest.mark.parametrize(("name", "k"), list(itertools.product(NAMES, PHASES)))
def test_member_if_and_only_if_tracking_keeps_the_zmp_inside(
    all_sets: dict[str, TrackingSets], name: str, k: int
) -> None:
    sets, rng = all_sets[name], np.random.default_rng(k + len(name))
    rays = rng.normal(size=(60, 4)) * SPREAD
    edge = boundary(sets, k, rays)[:, None]
    assert np.isfinite(edge).all()
    factor = np.concatenate((edge * rng.uniform(0.0, 1.2, edge.shape), edge * (1.0 - 1e-6), edge * (1.0 + 1e-6)))
    x = WALK.xi[k] + np.tile(rays, (3, 1)) * factor
    _, slack = simulated(sets, k, x)
    admissible = slack.min(axis=0) >= 0.0
    np.testing.assert_array_equal(sets.slacks(k, x) >= 0.0, admissible)
    assert admissible[60:120].all()
    assert not admissible[120:].any()


def explicit_rows(sets: TrackingSets, k: int) -> dict[tuple[int, int], tuple[np.ndarray, float]]:
    """Rows of (31) and (39) for a start at k, with the exponents and sums as they must read, by (sample, edge)."""
    ref, F, loop, B = sets.reference, sets.gain.F, sets.gain.closed_loop(PENDULUM), PENDULUM.B
    power = [np.eye(4)]
    for _ in range(M - k):
        power.append(loop @ power[-1])
    supports = [ref.support(i) for i in range(k, M)]
    b = np.concatenate([ref.mu[i] + F @ ref.xi[i] for i in range(k, M)] or [np.empty(0)])
    rows = {}
    if supports:
        Phi = np.vstack([-F @ power[i] for i in range(M - k)])
        Gamma = np.eye(2 * (M - k))
        for i in range(M - k):
            for j in range(i):
                Gamma[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = -F @ power[i - 1 - j] @ B
        M_hat = block_diag(*[p.M for p in supports])
        left, right = M_hat @ Phi, np.concatenate([p.v for p in supports]) - M_hat @ (Gamma @ b)
        names = [(k + i, j) for i, p in enumerate(supports) for j in range(len(p.v))]
        rows = {name: (left[r], right[r]) for r, name in enumerate(names)}
    drift = sum((power[M - 1 - k - j] @ B @ b[2 * j : 2 * j + 2] for j in range(M - k)), np.zeros(4))
    last = sets.terminal
    left, right = last.S @ power[M - k], last.a + last.S @ (last.x_C - drift)
    for r in range(len(right)):
        rows[M + int(last.sample[r]), int(last.edge[r])] = (left[r], right[r])
    return rows


@pytest.mark.parametrize("name", ["lqr", "dcm", "dcm, then lqr", "dcm, then dcm beside"])
@pytest.mark.parametrize("k", [0, 250, 391, 400])
def test_rows_are_those_of_the_paper_and_the_missing_ones_cut_nothing(
    all_sets: dict[str, TrackingSets], name: str, k: int
) -> None:
    sets = all_sets[name]
    explicit = explicit_rows(sets, k)
    first, stop = sets.start[k], sets.start[k + 1]
    kept = set()
    for row in range(first, stop):
        if np.isinf(sets.a[row]):
            continue
        key = int(sets.sample[row]), int(sets.edge[row])
        left, right = explicit[key]
        np.testing.assert_allclose(sets.S[row], left, atol=ROUNDING)
        assert sets.a[row] == pytest.approx(right, abs=ROUNDING)
        kept.add(key)
    assert len(kept) > 3
    program = LinearProgram(sets.S[first:stop], sets.a[first:stop])
    # Every seventh of the rest: what was pruned must follow from what was kept.
    for key in sorted(set(explicit) - kept)[::7]:
        left, right = explicit[key]
        if np.abs(left).max() < 1e-12:
            continue
        assert left @ program.maximise(left) <= right + 1e-8


def test_queries_agree_with_one_another(all_sets: dict[str, TrackingSets]) -> None:
    for sets in all_sets.values():
        assert sets.m == M
        for x in WALK.xi[[0, 100, 300]] + np.random.default_rng(1).normal(size=(3, 4)) * SPREAD * 0.1:
            every = sets.slack_all(x)
            assert every.shape == (M + 1,)
            for k in (0, 1, 150, M):
                assert sets.slack(k, x) == pytest.approx(every[k], abs=1e-14)
                assert sets.slacks(k, x[None])[0] == pytest.approx(every[k], abs=1e-14)
                assert sets.contains(k, x) == (every[k] >= 0.0)
                i, j = sets.tight(k, x)
                rows = slice(sets.start[k], sets.start[k + 1])
                row = np.flatnonzero((sets.sample[rows] == i) & (sets.edge[rows] == j))[0] + sets.start[k]
                assert sets.a[row] - sets.S[row] @ x == pytest.approx(every[k], abs=1e-14)
        assert not sets.contains(0, np.full(4, np.nan))


def test_slack_is_the_zmp_margin_of_the_reference_itself(all_sets: dict[str, TrackingSets]) -> None:
    for name in ("lqr", "dcm"):
        sets = all_sets[name]
        for k in (0, 100, 170):
            # On the reference the error is zero; a pruned row may only leave more room.
            assert sets.slack(k, WALK.xi[k]) >= WALK.margins()[k:].min() - ROUNDING
            i, j = sets.tight(k, WALK.xi[k])
            assert k <= i < M
            support = WALK.support(i)
            assert sets.slack(k, WALK.xi[k]) == pytest.approx(support.v[j] - support.M[j] @ WALK.mu[i], abs=ROUNDING)


def test_last_set_is_that_of_the_regulator(all_sets: dict[str, TrackingSets]) -> None:
    x = WALK.xi[-1] + np.random.default_rng(2).normal(size=(300, 4)) * SPREAD
    for sets in all_sets.values():
        np.testing.assert_allclose(sets.slacks(M, x), sets.terminal.slacks(x), atol=ROUNDING)


def test_tracking_from_a_member_leads_into_the_next_set(all_sets: dict[str, TrackingSets]) -> None:
    for name, sets in all_sets.items():
        rays = np.random.default_rng(3).normal(size=(20, 4)) * SPREAD
        x = WALK.xi[0] + rays * boundary(sets, 0, rays)[:, None] * (1.0 - 1e-6)
        for k in range(M):
            u = WALK.mu[k] + (WALK.xi[k] - x) @ sets.gain.F.T
            x = x @ PENDULUM.A.T + u @ PENDULUM.B.T
            if k % 40 == 0:
                assert (sets.slacks(k + 1, x) >= 0.0).all(), name


def test_dcm_plane_gives_the_sets_of_the_general_recursion(all_sets: dict[str, TrackingSets]) -> None:
    # Bounds of the state too wide to matter send a DCM gain through the recursion in 4-D.
    gain = GAINS["dcm"]
    wide = regulator_set(PENDULUM, gain, WALK.final, WALK.xi[-1, 0::2], bounds=(50.0, 50.0 * PENDULUM.omega))
    general = tracking_sets(PENDULUM, gain, WALK, wide)
    for k in (0, 80, 250, 400):
        rays = np.random.default_rng(k).normal(size=(200, 4)) * SPREAD
        edge = boundary(general, k, rays)[:, None]
        for factor, inside in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
            x = WALK.xi[k] + rays * edge * factor
            assert ((general.slacks(k, x) >= 0.0) == inside).all()
            assert ((all_sets["dcm"].slacks(k, x) >= 0.0) == inside).all()


@pytest.mark.parametrize("contraction", [0.98, 0.5, 1e-3, 1e-9])
def test_limiting_sample_is_that_of_looking_at_each(contraction: float) -> None:
    # 1e-9 a sample passes the range of doubles after 35 samples, so that the search goes block by block.
    rng = np.random.default_rng(4)
    least = rng.uniform(0.01, 1.0, size=(120, 3)) * contraction ** rng.uniform(-1.5, 1.5, size=(120, 3))
    least[rng.uniform(size=least.shape) < 0.3] = np.inf
    least[5, 0] = 0.0
    found = limiting_samples(least, contraction)
    for k, d in itertools.product(range(120), range(3)):
        later = [np.log(v) - (i) * np.log(contraction) if v > 0 else -np.inf for i, v in enumerate(least[k:, d])]
        if np.isfinite(min(later)) or min(later) == -np.inf:
            assert found[k, d] == k + int(np.argmin(later))


def test_steps_of_a_walk_open_the_set_forward(all_sets: dict[str, TrackingSets]) -> None:
    # Fig. 6: a push from behind that the standing robot cannot stop is inside the set of the stepping motion.
    for name in ("lqr", "dcm"):
        sets = all_sets[name]
        stand = regulator_set(PENDULUM, GAINS[name], WALK.supports[0])
        x = WALK.xi[0].copy()
        while sets.contains(0, x):
            x[1] += 0.001
        x[1] -= 0.001
        assert not stand.contains(x)


def test_explain_says_which_edge_and_when(all_sets: dict[str, TrackingSets]) -> None:
    sets = all_sets["dcm"]
    # At 0.3 s the robot stands on its right foot; to the left of the reference the ZMP is at the left edge at once.
    now = sets.explain(60, WALK.xi[60] + [0.0, 0.0, 0.04, 0.0])
    assert now.startswith("the ZMP would leave through the left edge now (")
    # Pushed to the right in double support: it fails as soon as the other foot is off the ground.
    late = WALK.xi[0] + [0.0, 0.0, 0.03, 0.0]
    _, slack = simulated(sets, 0, late[None])
    first = int(np.flatnonzero(slack[:, 0] < 0.0)[0])
    assert first == 20
    assert "through the left edge 0.10 s from now" in sets.explain(0, late)
    assert "the ZMP stays inside, tightest at the" in sets.explain(0, WALK.xi[0])
    assert sets.explain(M, WALK.xi[-1] + [0.2, 0.0, 0.0, 0.0]).startswith("the ZMP would leave through the front")
    # Only the regulator at the end fails: holding a point beside the reference with another, harder law.
    beside = all_sets["dcm, then dcm beside"]
    assert "stays inside" in beside.explain(M, WALK.xi[-1])


def test_explain_agrees_with_the_simulation(all_sets: dict[str, TrackingSets]) -> None:
    for name in ("lqr", "dcm, then dcm beside"):
        sets = all_sets[name]
        rng = np.random.default_rng(5)
        for k in (0, 60, 350):
            rays = rng.normal(size=(20, 4)) * SPREAD
            x = WALK.xi[k] + rays * boundary(sets, k, rays)[:, None] * 1.2
            _, slack = simulated(sets, k, x)
            for state, history in zip(x, slack.T, strict=True):
                i = int(np.flatnonzero(history < 0.0)[0])
                when = f"{i * PENDULUM.dt:.2f} s from now (" if i else "now ("
                assert f"edge {when}{-1e3 * history[i]:.1f} mm beyond)" in sets.explain(k, state)


def test_pieces_that_do_not_belong_together_are_refused() -> None:
    gain = GAINS["dcm"]
    slower = Pendulum(PENDULUM.omega, 0.01)
    with pytest.raises(TrackingMismatchError, match="share omega and dt"):
        tracking_sets(slower, dcm(slower, 1.5), WALK, terminal(gain))
    with pytest.raises(UnstableGainError):
        tracking_sets(PENDULUM, Gain(F=np.zeros((2, 4)), name="none"), WALK, terminal(gain))
