from __future__ import annotations

import numpy as np
import pytest

from controllers.admissible.gain_bank import (
    GainBank,
    GainBankError,
    best_dcm_ratio,
    gain_bank,
    stiffness,
)
from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.gains import Gain, dcm, lqr, poles
from controllers.geometry.support_polygon import SupportPolygon
from tests.controllers.stances import GAINS, PENDULUM, STANCES

SPREAD = np.array([0.05, 0.3, 0.05, 0.3])
# One sample's rounding beside a set that is left by nothing else.
ROUNDING = 1e-12


def standard_gains(polygon: SupportPolygon, w_bar: float) -> tuple[Gain, ...]:
    """LQR from stiff to soft, slow poles, and DCM gains down to the one that is best under an error [m]."""
    nearest = polygon.slack(polygon.centre)
    return (
        lqr(PENDULUM, (100.0, 1.0), 1.0),
        lqr(PENDULUM, (1.0, 1.0), 1.0),
        lqr(PENDULUM, (1.0, 0.0), 1.0),
        poles(PENDULUM, (-0.2 * PENDULUM.omega, -0.8 * PENDULUM.omega)),
        dcm(PENDULUM, 2.0),
        dcm(PENDULUM, 1.2),
        dcm(PENDULUM, best_dcm_ratio(nearest, w_bar)),
    )


def choices(bank: GainBank, x: np.ndarray) -> np.ndarray:
    """Index (n,) of the stiffest gain whose set holds each state (n, 4); -1 outside the union."""
    inside = np.stack([moa.slacks(x) >= 0.0 for moa in bank.sets])
    return np.where(inside.any(axis=0), inside.argmax(axis=0), -1)


def bank_of(stance: str, error: ZmpError | None = None) -> GainBank:
    polygon = STANCES[stance]
    return gain_bank(PENDULUM, standard_gains(polygon, 0.002), polygon, error=error)


def on_boundary(bank: GainBank, n: int) -> np.ndarray:
    """States (n, 4) in the union, a millionth inside its boundary, along rays from the centre."""
    rays = np.random.default_rng(1).normal(size=(n, 4)) * SPREAD
    reach = np.max([1.0 / ((rays @ moa.S.T) / moa.a).max(axis=1) for moa in bank.sets], axis=0)
    return bank.x_C + rays * reach[:, None] * (1.0 - 1e-6)


@pytest.mark.parametrize(("stance", "error"), [*((stance, None) for stance in STANCES), ("yawed", ZmpError.box(0.001))])
def test_switching_to_the_stiffest_gain_never_leaves_the_union(stance: str, error: ZmpError | None) -> None:
    bank, rng = bank_of(stance, error), np.random.default_rng(2)
    x = on_boundary(bank, 120)
    F = np.array([moa.gain.F for moa in bank.sets])
    before, switched = np.full(len(x), -1), 0
    for _ in range(600):
        chosen = choices(bank, x)
        assert (chosen >= 0).all()
        # Never back to a softer gain: the set of the present one is not left.
        assert (before == -1).all() or (chosen <= before).all() or error is not None
        switched += int((chosen != before).sum())
        before = chosen
        u = bank.centre - np.einsum("nij,nj->ni", F[chosen], x - bank.x_C)
        if error is not None:
            angle = rng.integers(0, 8, len(x)) * np.pi / 4
            u = u + error.w_bar * np.sign(np.column_stack((np.cos(angle), np.sin(angle))).round(9))
        assert bank.polygon.slacks(u).min() >= -ROUNDING
        x = x @ PENDULUM.A.T + u @ PENDULUM.B.T
    # On the way from the boundary to rest more than one gain has been in charge.
    assert switched > 2 * len(x)
    if error is None:
        assert (before == 0).all()


def test_the_stiffest_of_the_sets_that_contain_the_state_is_chosen() -> None:
    bank = bank_of("hexagon")
    found = [stiffness(PENDULUM, moa.gain) for moa in bank.sets]
    assert found == sorted(found, reverse=True)
    states = bank.x_C + np.random.default_rng(3).normal(size=(5_000, 4)) * SPREAD * 0.5
    inside = bank.slacks(states) >= 0.0
    own = np.array([moa.slacks(states) >= 0.0 for moa in bank.sets])
    np.testing.assert_array_equal(own.any(axis=0), inside)
    # Every gain is in charge somewhere, so the stiffest alone would not do.
    assert set(choices(bank, states).tolist()) == {-1, *range(len(bank.sets))}
    for state, index in zip(states[:300], choices(bank, states), strict=False):
        assert bank.contains(state) == (index >= 0) == (bank.slack(state) >= 0.0)


def test_stiffness_of_a_dcm_gain_is_k() -> None:
    assert stiffness(PENDULUM, dcm(PENDULUM, 1.7)) == pytest.approx(1.7)
    bank = gain_bank(PENDULUM, [GAINS["lqr"], GAINS["dcm"]], STANCES["box"])
    assert bank[GAINS["lqr"].name] is bank.sets[0]
    with pytest.raises(KeyError):
        bank["none"]


def test_gains_that_do_not_withstand_the_error_are_left_out_and_named() -> None:
    gains = [dcm(PENDULUM, k) for k in (1.02, 1.5)]
    bank = gain_bank(PENDULUM, gains, STANCES["box"], error=ZmpError.box(0.003))
    assert [moa.gain.name for moa in bank.sets] == ["dcm k=1.5"]
    assert "only below" in bank.left_out["dcm k=1.02"]
    with pytest.raises(EmptySetError) as caught:
        gain_bank(PENDULUM, gains, STANCES["box"], error=ZmpError.box(0.03))
    assert gain_bank(PENDULUM, gains, STANCES["box"], error=caught.value.largest.scaled(0.999)).sets


def test_banks_that_cannot_be_are_refused() -> None:
    with pytest.raises(GainBankError, match="different names"):
        gain_bank(PENDULUM, [], STANCES["box"])
    with pytest.raises(GainBankError, match="different names"):
        gain_bank(PENDULUM, [GAINS["dcm"], GAINS["dcm"]], STANCES["box"])
    for w in (0.0, 0.025, -0.001, np.nan):
        with pytest.raises(GainBankError, match="half"):
            best_dcm_ratio(0.05, w)
