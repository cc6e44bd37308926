"""Where the feet stand, what they span and where the robot faces; told anew only once a foot has moved."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.interface import Observation
from controllers.stepping.step_policy import Heading
from models.arena import SIDES
from models.robot import Side

Array = NDArray[np.float64]

# The commanded ZMP stays this far inside the support, so that a foot does not tip over its edge [m].
EDGE = 0.003
# A foot that has moved this far is somewhere else, and what depends on it is computed anew [m].
MOVED = 0.002


def heading_of(feet: Mapping[Side, Foot]) -> Heading:
    """Where a robot faces, by its feet."""
    return Heading(0.5 * (feet["left"].yaw + feet["right"].yaw))


class ContactState:
    """The feet as the controllers know them.

    Attributes:
        feet: where each foot stands; of the one in the air, where it last stood. Empty before the first tick.
        lifted: the foot in the air.
    """

    def __init__(self, sole: Array, edge: float) -> None:
        """Know nothing yet.

        Args:
            sole: (n, 2) outline of either foot, in its frame [m].
            edge: distance that a ZMP keeps from the edges of the support [m].
        """
        self.feet: dict[Side, Foot] = {}
        self.lifted: Side | None = None
        self._at: dict[Side, tuple[float, float]] = {}
        self._sole = sole
        self._edge = edge
        self._heading: Heading | None = None
        self._hull: SupportPolygon | None = None
        self._support: SupportPolygon | None = None

    @property
    def heading(self) -> Heading:
        """Where the robot faced when its feet were first seen."""
        assert self._heading is not None, "there is one from the first tick on"
        return self._heading

    @property
    def positions(self) -> dict[Side, Array]:
        """(2,) of either foot [m]."""
        return {side: foot.position for side, foot in self.feet.items()}

    @property
    def middle(self) -> Array:
        """(2,) between the feet [m]."""
        (left_x, left_y), (right_x, right_y) = self._at["left"], self._at["right"]
        return np.array([0.5 * (left_x + right_x), 0.5 * (left_y + right_y)])

    @property
    def hull(self) -> SupportPolygon:
        """Of the feet on the floor."""
        if self._hull is None:
            self._hull = support_polygon([foot for side, foot in self.feet.items() if side != self.lifted])
        return self._hull

    @property
    def support(self) -> SupportPolygon:
        """Where the ZMP may be commanded: the hull less its edge."""
        if self._support is None:
            self._support = self.hull.shrunk(self._edge)
        return self._support

    def see(self, observation: Observation) -> bool:
        """Take the feet on the floor for where they are; True if one of them had moved."""
        moved = False
        for side in SIDES:
            if side == self.lifted:
                continue
            state, known = observation.feet[side], self._at.get(side)
            x, y, _ = state.position.tolist()
            if known is not None and abs(x - known[0]) <= MOVED and abs(y - known[1]) <= MOVED:
                continue
            self._at[side] = x, y
            self.feet[side] = Foot(position=state.position[:2], yaw=state.yaw, sole=self._sole)
            moved = True
        if moved:
            self._hull = self._support = None
        if self._heading is None:
            self._heading = heading_of(self.feet)
        return moved

    def lift(self, side: Side) -> None:
        """A foot leaves the floor."""
        self.lifted, self._hull, self._support = side, None, None

    def land(self) -> None:
        """The foot in the air is on the floor again."""
        self.lifted = self._hull = self._support = None

    def forget(self) -> None:
        """Take both feet for where they are when they are seen next, however little they moved."""
        self.feet, self._at = {}, {}
