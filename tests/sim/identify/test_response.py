"""The numerics of the identification, on a pendulum whose ZMP follows its command by a known law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.identify.excitation import FREQUENCIES, Sway
from sim.identify.response import Window, feedback_gain, lines, mean_of, spread, transfer

DT, OMEGA = 0.002, 6.0
# A lag is rounded by the hold of a command over a tick [s]; the rest of it is exact.
HOLD = 0.5 * DT


def swayed(k: float, gain: float, time_constant: float, noise: float = 0.0, seed: int = 3) -> list[Window]:
    """Both windows of a pendulum under u = k xi + r; its ZMP is p + noise, p' = (gain u - p) / time_constant."""
    sway, rng = Sway.drawn(seed, np.array([0.01, 0.02])), np.random.default_rng(seed)
    ticks = round(Sway.duration() / DT)
    decay = math.exp(-DT / time_constant) if time_constant else 0.0
    follows, dcm, zmp = np.zeros(2), np.zeros((ticks + 1, 2)), np.zeros((ticks + 1, 2))
    command, offset = np.zeros((ticks, 2)), np.zeros((ticks, 2))
    for i in range(ticks):
        offset[i] = sway.at(i * DT)
        command[i] = k * dcm[i] + offset[i]
        follows = decay * follows + (1.0 - decay) * gain * command[i]
        zmp[i + 1] = follows + rng.normal(0.0, noise, 2)
        growth = math.exp(OMEGA * DT)
        dcm[i + 1] = growth * dcm[i] + (1.0 - growth) * zmp[i + 1]
    found = []
    for axis in (0, 1):
        begin, end = (round(edge / DT) for edge in Sway.window(axis))
        at = np.arange(begin, end)
        found.append(
            Window(
                time=at * DT,
                law=command[at, axis],
                command=command[at, axis],
                realised=zmp[at + 1, axis],
                offset=offset[at, axis],
                dcm=dcm[at, axis],
            )
        )
    return found


@pytest.mark.parametrize("noise", [0.0, 2e-4])
@pytest.mark.parametrize(("gain", "time_constant"), [(1.0, 0.0), (0.9, 0.01), (1.1, 0.03)])
def test_a_known_lag_and_gain_are_found(gain: float, time_constant: float, noise: float) -> None:
    for window in swayed(1.6, gain, time_constant, noise):
        command, _ = lines(window.time, window.command, FREQUENCIES)
        realised, _ = lines(window.time, window.realised, FREQUENCIES)
        gains, lags = transfer(realised, command, FREQUENCIES)
        turns = 2.0 * math.pi * np.array(FREQUENCIES)
        # White noise of 0.2 mm on sines of 1 mm and more over 2000 ticks: a per cent is over two standard deviations.
        assert gains == pytest.approx(gain / np.hypot(1.0, turns * time_constant), rel=0.03 if noise else 0.01)
        exact = np.arctan(turns * time_constant) / turns
        assert (np.abs(lags - exact) < HOLD + (0.03 / turns if noise else 0.0)).all()


@pytest.mark.parametrize("k", [1.3, 1.6, 2.5])
def test_the_gain_of_the_law_and_that_of_a_body_that_scales_it_are_found(k: float) -> None:
    for window in swayed(k, 0.9, 0.0):
        own, realised = feedback_gain(window, DT)
        assert own == pytest.approx(k, rel=1e-6)
        assert realised == pytest.approx(0.9 * k, rel=1e-6)


def test_noise_is_left_over_and_told_by_its_size() -> None:
    for window in swayed(1.6, 1.0, 0.0, noise=3e-4):
        _, rest = lines(window.time, window.realised, FREQUENCIES)
        found = spread(rest)
        assert found is not None
        # The noise goes round the loop, which adds a little to it.
        assert 2.7e-4 < found["rms"] < 4e-4
        assert found["rms"] < found["q95"] < found["q99"] < found["largest"]


def test_the_sway_reaches_its_peak_once_faded_in_and_moves_one_axis_at_a_time() -> None:
    peaks = np.array([0.01, 0.02])
    sway = Sway.drawn(0, peaks)
    offsets = np.array([sway.at(time) for time in np.arange(0.0, Sway.duration(), 1e-3)])
    assert np.abs(offsets).max(axis=0) == pytest.approx(peaks, rel=1e-3)
    assert not (offsets != 0.0).all(axis=1).any()
    assert (Sway.drawn(1, peaks).phases != sway.phases).all()


def test_intervals_hold_the_mean_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    found = [mean_of(list(rng.normal(1.0, 0.2, 4)))["interval"] for _ in range(400)]
    held = np.mean([low < 1.0 < high for low, high in found])
    # 95 % of 400: two standard deviations are 2.2 points.
    assert 0.92 < held < 0.98
