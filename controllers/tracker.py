"""Tracking controller (27) of a stepping reference, with its tracking sets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.gait import StepPlan
from controllers.moa import regulator_set
from controllers.tracking_sets import tracking_sets
from models.robot import Side

Array = NDArray[np.float64]


class Tracker:
    """Follows a plan tick by tick: u_k = mu_k + F (xi_k - x_k) (27).

    Attributes:
        plan: footholds and reference.
        sets: kO_inf of every phase (28)-(41).
        k: the present phase.
    """

    def __init__(self, plan: StepPlan, gain: Gain) -> None:
        """Start a plan at its phase 0; computes its tracking sets."""
        reference = plan.reference
        terminal = regulator_set(reference.pendulum, gain, reference.final, centre=reference.xi[-1, 0::2])
        self.plan = plan
        self.sets = tracking_sets(reference.pendulum, gain, reference, terminal)
        self.k = 0
        self._F = gain.F
        self._last = reference.m - 1
        self._until_landing = plan.landings[0] if plan.landings else None

    @property
    def swing(self) -> Side | None:
        """The foot in the air now; None in double support."""
        return self.plan.swing[0] if self._until_landing is not None else None

    @property
    def finished(self) -> bool:
        """Whether the reference has ended: time for the regulator of the new stance."""
        return self.k > self._last

    @property
    def time_left(self) -> float:
        """Until the swing foot should land [s]; 0 if it is late."""
        if self._until_landing is None:
            return 0.0
        return max(self._until_landing - self.k, 0) * self.plan.reference.pendulum.dt

    @property
    def phase(self) -> int:
        """Phase of the reference that holds now: a late landing keeps the last phase before it."""
        last = self._last if self._until_landing is None else self._until_landing - 1
        return min(self.k, last)

    def zmp(self, x: Array) -> Array:
        """ZMP command u_k (2,) for state x (4,), (27) [m]; not limited to the polygon."""
        reference, k = self.plan.reference, self.phase
        return reference.mu[k] + self._F @ (reference.xi[k] - x)

    def slack(self, x: Array) -> float:
        """Signed slack of state x (4,) in the present set kO_inf [m of ZMP]."""
        return self.sets.slack(self.phase, x)

    def explain(self, x: Array) -> str:
        """Which constraint is tightest, where and when."""
        return self.sets.explain(self.phase, x)

    def advance(self) -> None:
        """One control period has passed."""
        self.k += 1
