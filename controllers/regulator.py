"""COG regulator (18) about a stance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.gains import Gain
from controllers.moa import MoaSet, regulator_set
from controllers.pendulum import Pendulum
from controllers.support import Foot, SupportPolygon, support_polygon
from models.robot import Side

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Keeps the COG over the middle of two standing feet (11) by state feedback (18).

    Attributes:
        gain: feedback F.
        feet: where the feet stand.
        polygon: their support polygon.
        admissible: its MOA set, (21)-(24).
    """

    gain: Gain
    feet: dict[Side, Foot]
    polygon: SupportPolygon
    admissible: MoaSet
    _x_C: Array = field(repr=False)

    @classmethod
    def at(cls, pendulum: Pendulum, gain: Gain, feet: dict[Side, Foot]) -> Regulator:
        """Regulator of a stance; its MOA set is computed here."""
        polygon = support_polygon([feet["left"], feet["right"]])
        centre = 0.5 * (feet["left"].position + feet["right"].position)
        return cls(
            gain=gain,
            feet=feet,
            polygon=polygon,
            admissible=regulator_set(pendulum, gain, polygon, centre),
            _x_C=pendulum.rest(centre),
        )

    def zmp(self, x: Array) -> Array:
        """ZMP command u (2,) for state x (4,), (13) and (18) [m]; not limited to the polygon."""
        return self.admissible.centre - self.gain.F @ (x - self._x_C)
