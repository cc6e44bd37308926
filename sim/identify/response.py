"""Gain, lag, errors and feedback from what was commanded and what came of it; numbers only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """What is measured along one axis while it is swayed; (n,) each, one a control tick, whole periods of all sines.

    Attributes:
        time: [s].
        law: the ZMP that the regulator's gain asks for in the true state, with the offset [m].
        command: ZMP command [m].
        realised: the ZMP at the end of that tick [m].
        offset: what was added to the regulator's command [m].
        dcm: the true DCM at the start of the tick [m].
    """

    time: Array
    law: Array
    command: Array
    realised: Array
    offset: Array
    dcm: Array


def lines(time: Array, signal: Array, frequencies: Sequence[float]) -> tuple[Complex, Array]:
    """Least squares of a signal on sines, a constant and a slope.

    Args:
        time: (n,) [s].
        signal: (n,).
        frequencies: (f,) [Hz].

    Returns:
        (f,) complex amplitudes c of Re(c e^{i w t}), and (n,) what is left of the signal.
    """
    turns = 2.0 * math.pi * np.outer(time, frequencies)
    basis = np.column_stack([np.cos(turns), np.sin(turns), np.ones_like(time), time - time.mean()])
    found, *_ = np.linalg.lstsq(basis, signal, rcond=None)
    count = len(frequencies)
    return found[:count] - 1j * found[count : 2 * count], signal - basis @ found


def transfer(answer: Complex, cause: Complex, frequencies: Sequence[float]) -> tuple[Array, Array]:
    """Gain (f,) [1] and lag (f,) [s] of one signal's amplitudes (f,) against another's; a lead is a negative lag."""
    ratio = answer / cause
    return np.abs(ratio), -np.angle(ratio) / (2.0 * math.pi * np.asarray(frequencies))


def feedback_gain(window: Window, dt: float) -> tuple[float, float]:
    """Gain k of u = k xi + r + constant by least squares: of the regulator's command, and of the realised ZMP.

    In the latter the offset r and its rate have shares of their own, so that a body that follows r late or by a share
    only does not count as feedback.

    Args:
        window: what was measured.
        dt: control period [s].
    """
    constant = np.ones_like(window.time)
    own, *_ = np.linalg.lstsq(np.column_stack([window.dcm, constant]), window.command - window.offset, rcond=None)
    basis = np.column_stack([window.dcm, constant, window.offset, np.gradient(window.offset, dt)])
    realised, *_ = np.linalg.lstsq(basis, window.realised, rcond=None)
    return float(own[0]), float(realised[0])


def spread(error: Array) -> dict[str, float] | None:
    """RMS, quantiles and the largest of the size of an error (n,) [m]; None if there is none."""
    size = np.abs(error[np.isfinite(error)])
    if not len(size):
        return None
    return {
        "rms": float(np.sqrt(np.mean(size**2))),
        "q95": float(np.quantile(size, 0.95)),
        "q99": float(np.quantile(size, 0.99)),
        "largest": float(size.max()),
    }


def mean_of(values: Sequence[float]) -> dict[str, float | list[float]]:
    """Mean over at least two seeds, with its 95 % interval by Student's t."""
    from scipy.stats import t

    mean, count = float(np.mean(values)), len(values)
    half = float(t.ppf(0.975, count - 1) * np.std(values, ddof=1) / math.sqrt(count))
    return {"mean": mean, "interval": [mean - half, mean + half]}
