"""When a step is due: the state has left the regulator's sets, or it surely will."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.supervisor.regulator import Regulator

Array = NDArray[np.float64]

# So long after a landing [s] the rate of the DCM is that of the impact and tells nothing of where it is going.
SETTLING = 1.0
# A state that is only extrapolated to leave the regulator's set must be this far outside [m of ZMP]: a weaker push is
# over before it gets there.
SURE = 0.04
# Share by which the rate of the DCM follows its differences at each tick, at most; less where they jump from tick to
# tick, as only noise does, so that what noise leaves of the rate stays below a certain speed.
RATE_FILTER = 0.3
# Jump of the differences, RMS, from which on the share is less [m/s], and the share by which that is averaged.
JUMP, JUMP_FILTER = 1.2, 0.02


class StepTrigger:
    """Watches the DCM.

    Attributes:
        rate: (2,) smoothed rate of the DCM [m/s].
    """

    def __init__(self, dt: float, lead: float, *, steady: bool = True) -> None:
        """Begin to watch.

        Args:
            dt: control period [s].
            lead: how far ahead the DCM is extrapolated [s]; 0 for not at all.
            steady: whether the rate follows its differences the less, the more they jump.
        """
        self.rate = np.zeros(2)
        self._dt = dt
        self._lead, self._steady = lead, steady
        self._dcm: tuple[float, float] | None = None
        self._difference: tuple[float, float] | None = None
        self._jump = 0.0

    def see(self, dcm: Array) -> None:
        """Take in the DCM (2,) of this tick [m]."""
        # Plain floats: sums of arrays of two take several times as long.
        x, y = dcm.tolist()
        if self._dcm is not None:
            dx, dy = (x - self._dcm[0]) / self._dt, (y - self._dcm[1]) / self._dt
            share, (rate_x, rate_y) = self._share(dx, dy), self.rate.tolist()
            self.rate = np.array([rate_x + share * (dx - rate_x), rate_y + share * (dy - rate_y)])
            self._difference = dx, dy
        self._dcm = x, y

    def _share(self, dx: float, dy: float) -> float:
        """By which the rate follows a difference (dx, dy) [m/s]."""
        if self._difference is not None and self._steady:
            x, y = dx - self._difference[0], dy - self._difference[1]
            self._jump += JUMP_FILTER * (0.5 * (x * x + y * y) - self._jump)
        return RATE_FILTER if self._jump <= JUMP**2 else RATE_FILTER * JUMP / math.sqrt(self._jump)

    def ahead(self, dcm: Array, since_landing: float) -> Array:
        """DCM (2,) that a step is looked for: where it goes to, once that can be told, else where it is [m].

        Args:
            dcm: (2,) now [m].
            since_landing: time since a foot last landed [s].
        """
        if self._lead and since_landing > SETTLING:
            return np.asarray(dcm + self._lead * self.rate)
        return dcm

    def reason(self, regulator: Regulator, x: Array, slack: float, by: Array) -> str:
        """Why a step is due, in words; empty if none is.

        Args:
            regulator: whose sets are to hold the state.
            x: (4,) state.
            slack: of it in them [m of ZMP].
            by: (2,) how far the DCM is looked ahead [m].
        """
        if slack < 0.0:
            return "the state left the regulator's set"
        by_x, by_y = by.tolist()
        if by_x or by_y:
            px, vx, py, vy = x.tolist()
            if regulator.slack(np.array([px + by_x, vx, py + by_y, vy])) < -SURE:
                return "the state is about to leave it"
        return ""
