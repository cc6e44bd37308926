"""Where a foot may land, and where it would like to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from controllers.gait_program import PlanningError, Reach
from controllers.pendulum import Pendulum
from controllers.support import Foot, SupportPolygon
from models.arena import Side
from models.robot import other

_OCTAGON = np.array([[math.cos(a), math.sin(a)] for a in np.arange(4) * math.pi / 4])


@dataclass(frozen=True, kw_only=True, slots=True)
class StepLimits:
    """Where a foot may land, in the yaw frame of the stance foot.

    Attributes:
        max_stride: largest |dx| from the stance foot [m].
        min_width, max_width: lateral distance of the feet [m], to the foot's own side: never crossed.
        stance_width: natural lateral distance [m], kept where the state leaves the choice.
        swing_speed: largest mean horizontal speed of a foot in the air [m/s].
        swing_acceleration: largest horizontal acceleration of a foot that swings from rest to rest [m/s^2]; without
            one it is at full speed at once, as a foot is that swings already.
    """

    max_stride: float
    min_width: float
    max_width: float
    stance_width: float
    swing_speed: float
    swing_acceleration: float = math.inf

    def __post_init__(self) -> None:
        values = (self.max_stride, self.min_width, self.max_width, self.stance_width, self.swing_speed)
        ordered = 0.0 < self.min_width <= self.stance_width <= self.max_width
        quick = self.swing_speed > 0.0 and self.swing_acceleration > 0.0
        if not (all(map(math.isfinite, values)) and ordered and self.max_stride >= 0.0 and quick):
            raise PlanningError(f"step limits must be positive with min <= stance <= max width, got {self}")

    def swing_reach(self, time: float) -> float:
        """How far a foot swings from rest to rest in a time [s] at most [m].

        By its mean speed, or by half of the time speeding up and half of it braking.
        """
        reach = self.swing_speed * time
        # Infinity times a time of 0 is no number.
        if math.isinf(self.swing_acceleration):
            return reach
        return min(reach, 0.25 * self.swing_acceleration * time**2)


def _axes(yaw: float) -> np.ndarray:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, s], [-s, c]])


def _box(side: Side, limits: StepLimits) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the reachable rectangle of foot `side` in the yaw frame of the stance foot [m]."""
    lateral = (limits.min_width, limits.max_width) if side == "left" else (-limits.max_width, -limits.min_width)
    return np.array([-limits.max_stride, lateral[0]]), np.array([limits.max_stride, lateral[1]])


def reach_rows(
    feet: Mapping[Side, Foot],
    swing: tuple[Side, ...],
    ticks: Sequence[int],
    start: np.ndarray,
    dt: float,
    limits: StepLimits,
) -> Reach:
    """Rectangle around the stance foot, and the octagon in the circle that the swing foot covers in time."""
    steps = len(swing)
    rows, lower, upper = np.zeros((6 * steps, 2 * steps)), np.empty(6 * steps), np.empty(6 * steps)
    for i, side in enumerate(swing):
        stance = feet[other(side)]
        axes, (low, high) = _axes(stance.yaw), _box(side, limits)
        radius = limits.swing_reach(ticks[i] * dt) * math.cos(math.pi / 8)
        box, circle = slice(6 * i, 6 * i + 2), slice(6 * i + 2, 6 * i + 6)
        rows[box, 2 * i : 2 * i + 2] = axes
        rows[circle, 2 * i : 2 * i + 2] = _OCTAGON
        lower[circle], upper[circle] = -radius, radius
        if i == 0:
            now = axes @ (start - stance.position)
            gap = np.clip(now, low, high) - now
            distance = math.hypot(*gap)
            if distance > radius:
                # A foot that cannot get back into the rectangle in time may land as near to it as it can get.
                nearest = now + gap * (radius / distance)
                low, high = np.minimum(low, nearest), np.maximum(high, nearest)
            shift = axes @ stance.position
            low, high = low + shift, high + shift
        else:
            rows[box, 2 * i - 2 : 2 * i] = -axes
            if i > 1:
                rows[circle, 2 * i - 4 : 2 * i - 2] = -_OCTAGON
        lower[box], upper[box] = low, high
        if i < 2:
            # The second foot to swing was the first stance foot; later ones leave their own foothold.
            leaves = _OCTAGON @ (start if i == 0 else feet[side].position)
            lower[circle] += leaves
            upper[circle] += leaves
    return Reach(G=rows, lower=lower, upper=upper)


def nominal_footholds(
    pendulum: Pendulum,
    x0: np.ndarray,
    feet: Mapping[Side, Foot],
    swing: Sequence[Side],
    ticks: Sequence[int],
    soles: Mapping[Side, SupportPolygon],
    limits: StepLimits,
) -> np.ndarray:
    """Footholds (N, 2) level with the DCM at each landing, at the natural width or as wide as the DCM.

    The DCM is carried forward with the ZMP at the point of the stance sole nearest to it.
    """
    dcm = pendulum.dcm(x0)
    place = feet[other(swing[0])].position
    footholds = np.empty((len(swing), 2))
    for i, side in enumerate(swing):
        stance = other(side)
        axes, (low, high) = _axes(feet[stance].yaw), _box(side, limits)
        zmp = place + soles[stance].nearest(dcm - place)
        # A DCM that is already far out would overflow over a long step; the rectangle clips it anyway.
        dcm = zmp + np.clip((dcm - zmp) * math.exp(pendulum.omega * pendulum.dt * ticks[i]), -10.0, 10.0)
        ahead, aside = axes @ (dcm - place)
        outward = limits.stance_width if side == "left" else -limits.stance_width
        aside = max(aside, outward) if side == "left" else min(aside, outward)
        place = place + np.clip([ahead, aside], low, high) @ axes
        footholds[i] = place
    return footholds
