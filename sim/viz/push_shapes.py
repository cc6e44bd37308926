"""What a push looks like in space: an arrow for a force, for a torque an arc around its axis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FADE = 0.3
"""How long a push is drawn after it [s]: pushes are shorter than an eye needs."""
_ARROW_PER_WEIGHT = 0.4  # [m] of arrow for a force of one body weight
_LEAST_ARROW = 0.16  # [m], so that its tail is out of the trunk
_ARC = np.linspace(0.0, 1.5 * math.pi, 25)  # [rad] of a torque's
_ARC_PER_ARM = 2.0  # radius of the arc of a torque, by its lever under one body weight
_ARCS = (0.09, 0.2)  # [m] the smallest and the largest radius
_ARC_HEAD = 0.07  # [m]


def arrow(point: Array, force: Array, weight: float, drawn: float) -> Array:
    """The arrow of a force.

    Args:
        point: (3,) where it acts [m].
        force: (3,) [N].
        weight: of the robot [N].
        drawn: size of the robot, see `models.arena.drawn_size`.

    Returns:
        (2, 3) tail and tip [m].
    """
    size = float(np.linalg.norm(force))
    length = drawn * max(size * _ARROW_PER_WEIGHT / weight, _LEAST_ARROW)
    return np.array([point - force / size * length, point])


def arc(centre: Array, torque: Array, weight: float, drawn: float) -> tuple[Array, Array]:
    """How a torque turns.

    Args:
        centre: (3,) about which it turns [m].
        torque: (3,) [N m].
        weight: of the robot [N].
        drawn: its size, as of `arrow`.

    Returns:
        (n, 3) points on the arc, and (2, 3) tail and tip of the arrow at its end [m].
    """
    size = float(np.linalg.norm(torque))
    axis = torque / size
    radius = min(max(size / weight * _ARC_PER_ARM, drawn * _ARCS[0]), drawn * _ARCS[1])
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    around = np.array([centre + radius * (math.cos(a) * first + math.sin(a) * second) for a in _ARC])
    head = around[-1] + drawn * _ARC_HEAD * (second * math.cos(_ARC[-1]) - first * math.sin(_ARC[-1]))
    return around, np.array([around[-1], head])
