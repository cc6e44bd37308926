"""A small sum of sines that is added to the ZMP command of a regulator that stands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, BalanceController, Observation

Array = NDArray[np.float64]

FREQUENCIES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
"""Of the sines [Hz]: whole multiples of 0.5 Hz."""
PERIOD = 2.0
"""After which the sum of the sines is the same again [s]."""
SETTLE, LEAD, MEASURED = 2.0, 2.0, 2 * PERIOD
"""Time that the robot settles in, that a sum of sines acts before it is measured, and that it is measured [s]."""
_FADE = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Sway:
    """The offset of the ZMP over time: first along x, then along y.

    Attributes:
        phases: (2, f) of the sines, cosines in fact, for each axis [rad].
        scale: (2,) amplitude of each sine along each axis [m].
    """

    phases: Array
    scale: Array

    @classmethod
    def drawn(cls, seed: int, peaks: Array) -> Sway:
        """Random phases; along each axis the sum reaches its peak (2,) [m] once a period."""
        phases = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, (2, len(FREQUENCIES)))
        times = np.arange(0.0, PERIOD, 1e-3)
        turns = 2.0 * math.pi * np.outer(times, FREQUENCIES)
        highest = [float(np.abs(np.cos(turns + phase).sum(axis=1)).max()) for phase in phases]
        return cls(phases=phases, scale=np.asarray(peaks) / highest)

    @staticmethod
    def duration() -> float:
        """Of the whole [s]."""
        return SETTLE + 2.0 * (LEAD + MEASURED)

    @staticmethod
    def window(axis: int) -> tuple[float, float]:
        """From when until when the offset along an axis is measured [s]."""
        begin = SETTLE + axis * (LEAD + MEASURED) + LEAD
        return begin, begin + MEASURED

    def at(self, time: float) -> Array:
        """(2,) offset [m] at a time [s]."""
        found = np.zeros(2)
        for axis in (0, 1):
            begin, end = self.window(axis)
            since = time - (begin - LEAD)
            if 0.0 <= since < end - (begin - LEAD):
                turns = 2.0 * math.pi * since * np.array(FREQUENCIES)
                found[axis] = min(since / _FADE, 1.0) * self.scale[axis] * np.cos(turns + self.phases[axis]).sum()
        return found


class Swayed:
    """A balance controller whose ZMP command is moved by a `Sway`.

    It is not shown what the offset did to the measured ZMP, so that it does not learn the offset as an error.

    Attributes:
        decisions: those of the controller within.
        offsets: (2,) [m] of each tick so far.
    """

    def __init__(self, inner: BalanceController, sway: Sway, delay: int) -> None:
        """Wrap a controller.

        Args:
            inner: who balances.
            sway: the offset.
            delay: control ticks that the measured ZMP is late by, beside the one that it always is.
        """
        self._inner, self._sway, self._delay = inner, sway, delay
        self.offsets: list[Array] = []

    @property
    def decisions(self) -> list[object]:
        """Those of the controller within."""
        return list(getattr(self._inner, "decisions", ()))

    def reset(self) -> None:
        """Forget the last episode."""
        self.offsets = []
        if (reset := getattr(self._inner, "reset", None)) is not None:
            reset()

    def command(self, observation: Observation) -> BalanceCommand:
        """One control tick."""
        ago = len(self.offsets) - 1 - self._delay
        past = self.offsets[ago] if ago >= 0 else np.zeros(2)
        command = self._inner.command(replace(observation, zmp=observation.zmp - past))
        offset = self._sway.at(observation.time)
        self.offsets.append(offset)
        return replace(command, zmp=command.zmp + offset)
