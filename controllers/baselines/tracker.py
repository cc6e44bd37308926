"""Tracking controller (27) of a walk from rest to rest, with its tracking sets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.moa import regulator_set
from controllers.admissible.robust import ZmpError
from controllers.admissible.tracking_sets import tracking_sets
from controllers.gains import Gain
from controllers.reference.walking_reference import Stride, WalkPlan

Array = NDArray[np.float64]


class Tracker:
    """Follows a walk tick by tick: u_k = mu_k + F (xi_k - x_k) (27).

    A foot that lands early only makes the support larger than the reference knows; while one is late the reference
    waits for it.

    Attributes:
        walk: reference and footholds.
        sets: kO_inf of every phase (28)-(41).
        k: the present tick; beyond `phase` while a foot is late.
    """

    def __init__(self, walk: WalkPlan, gain: Gain, zmp_error: float = 0.0) -> None:
        """Compute the tracking sets of a walk, and stand before its first tick.

        Args:
            walk: reference and footholds.
            gain: of (27), and of the regulator at its end.
            zmp_error: largest error of the ZMP along each axis that the sets withstand [m].

        Raises:
            EmptySetError: no state withstands the error.
        """
        reference, error = walk.reference, ZmpError.box(zmp_error) if zmp_error else None
        centre = reference.xi[-1, 0::2]
        terminal = regulator_set(reference.pendulum, gain, reference.final, centre=centre, error=error)
        self.walk = walk
        self.sets = tracking_sets(reference.pendulum, gain, reference, terminal)
        self._F = gain.F
        self.start()

    def start(self) -> None:
        """Go back to phase 0."""
        self.k = 0
        self._landed = 0

    @property
    def stride(self) -> Stride | None:
        """The foot that is in the air, or now leaves the floor; None in double support."""
        if self._landed == len(self.walk.strides) or self.k < self.walk.strides[self._landed].lift:
            return None
        return self.walk.strides[self._landed]

    @property
    def finished(self) -> bool:
        """Whether the reference has ended: time for the regulator of the new stance."""
        return self.k >= self.walk.reference.m and self.stride is None

    @property
    def phase(self) -> int:
        """Phase of the reference that holds now, 0..m."""
        stride = self.stride
        return min(self.k, self.walk.reference.m if stride is None else stride.landing - 1)

    def zmp(self, x: Array) -> Array:
        """ZMP command u_k (2,) for state x (4,), (27) [m]; not limited to the support. Not for phase m."""
        reference, k = self.walk.reference, self.phase
        return reference.mu[k] + self._F @ (reference.xi[k] - x)

    def slack(self, x: Array) -> float:
        """Signed slack of state x (4,) in the present set kO_inf [m of ZMP]."""
        return self.sets.slack(self.phase, x)

    def explain(self, x: Array) -> str:
        """Which constraint is tightest, where and when."""
        return self.sets.explain(self.phase, x)

    def land(self) -> None:
        """The foot in the air is on the floor."""
        stride = self.stride
        assert stride is not None
        self.k = min(self.k, stride.landing)
        self._landed += 1

    def advance(self) -> None:
        """One control period has passed."""
        self.k += 1
