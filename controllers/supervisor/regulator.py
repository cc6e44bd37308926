"""COG regulator (18) about a stance, with the stiffest gain of its bank whose set holds the state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.gain_bank import GainBank, gain_bank
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.robust import ZmpError
from controllers.compiled import compiled
from controllers.gains import Gain
from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.pendulum import Pendulum
from models.robot import Robot, Side

Array = NDArray[np.float64]

# A stiffer gain is gone back to only with this much slack [m of ZMP], so that the rim of a set is no place to flutter.
HYSTERESIS = 0.002


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Keeps the COG over the middle of two standing feet (11) by state feedback (18).

    Attributes:
        gain: the gain asked for.
        feet: where the feet stand.
        polygon: their support polygon.
        bank: it and the softer ones, with their MOA sets (21)-(24).
    """

    gain: Gain
    feet: dict[Side, Foot]
    polygon: SupportPolygon
    bank: GainBank
    _x_C: Array = field(repr=False)

    @classmethod
    def at(
        cls,
        pendulum: Pendulum,
        gains: Sequence[Gain],
        feet: dict[Side, Foot],
        centre: Array | None = None,
        zmp_error: float = 0.0,
    ) -> Regulator:
        """Regulator of a stance; its MOA sets are computed here.

        Args:
            pendulum: model and period.
            gains: the one asked for, then those to fall back on.
            feet: where the feet stand.
            centre: (2,) where to hold the COG [m]; None for the middle of the feet.
            zmp_error: largest error of the ZMP along each axis [m] that the sets withstand; who cannot has none.

        Raises:
            EmptySetError: no gain withstands the error.
        """
        polygon = support_polygon([feet["left"], feet["right"]])
        if centre is None:
            centre = 0.5 * (feet["left"].position + feet["right"].position)
        error = ZmpError.box(zmp_error) if zmp_error else None
        return cls(
            gain=gains[0],
            feet=feet,
            polygon=polygon,
            bank=gain_bank(pendulum, gains, polygon, centre, error=error),
            _x_C=pendulum.rest(centre),
        )

    @property
    def centre(self) -> Array:
        """(2,) point that the COG is held over [m]."""
        return self._x_C[0::2]

    @property
    def softest(self) -> MoaSet:
        """MOA set of the gain that is given up last."""
        return self.bank.sets[-1]

    def slack(self, x: Array) -> float:
        """Signed slack of state x (4,) in the union of the bank's sets [m of ZMP]."""
        return self.bank.slack(x)

    def choose(self, x: Array, present: Gain | None) -> Gain:
        """The stiffest gain whose set holds state x (4,), else the softest; `present` is not left at the rim."""
        return self.bank.stiffest(x, present, HYSTERESIS).gain

    def zmp(self, x: Array, gain: Gain | None = None, centre: Array | None = None) -> Array:
        """ZMP command u (2,), (13) and (18) [m]; not limited to the polygon.

        Args:
            x: (4,) state.
            gain: None for the one asked for.
            centre: (2,) where to hold the COG instead of at `centre` [m].
        """
        F = self.gain.F if gain is None else gain.F
        zmp = np.empty(2)
        _regulated(F, self._x_C, x, zmp)
        if centre is None:
            return zmp
        # The same law about another centre: u_C moves, and -F x_C with it.
        shift = centre - self.centre
        return np.asarray(zmp + shift + F @ np.array([shift[0], 0.0, shift[1], 0.0]))

    def region(self, robot: Robot) -> Polytope:
        """States in the world that the softest gain holds, as far as the robot's legs allow, (21)-(24)."""
        of = self.softest
        return regulator_set(
            of.pendulum, of.gain, of.polygon, of.centre, bounds=leg_bounds(robot), error=of.error
        ).in_world()

    def explain(self, x: Array) -> str:
        """Which constraint is tightest, where and when, in the largest set."""
        return self.softest.explain(x)


@compiled
def _regulated(F: Array, x_C: Array, x: Array, zmp: Array) -> None:
    """Write u_C - F (x - x_C), (13) and (18), to zmp (2,)."""
    np.dot(F, x - x_C, zmp)
    zmp[0], zmp[1] = x_C[0] - zmp[0], x_C[2] - zmp[1]


def leg_bounds(robot: Robot) -> tuple[float, float]:
    """Largest offset of the COG that the legs allow [m], and three times the speed whose DCM is that far out [m/s]."""
    return robot.hip_reach, 3.0 * robot.omega * robot.hip_reach
