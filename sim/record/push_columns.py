"""Pushes one by one in a trace: columns of their own for torques and for those that overlap in time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from scenarios.push import Push

Array = NDArray[np.float64]

AXES = ("x", "y", "z")


def push_channels(number: int, push: Push) -> dict[str, str]:
    """The columns of a push.

    Args:
        number: of the push, from 1.
        push: as run.

    Returns:
        Name -> unit: `push_2_fx` and so on its force, or `push_2_tx` its torque, each the mean over the tick in the
        world frame, and `push_2_x` where it acts.
    """
    kind, unit = ("f", "N") if push.torque is None else ("t", "N m")
    return {f"push_{number}_{kind}{axis}": unit for axis in AXES} | {f"push_{number}_{axis}": "m" for axis in AXES}


class PushColumns:
    """Keeps what each push did, tick by tick, until it is known which pushes a trace tells one by one."""

    def __init__(self) -> None:
        self._acted: defaultdict[int, list[tuple[int, Array]]] = defaultdict(list)

    def add(self, tick: int, index: int, mean: Array, point: Array) -> None:
        """Take in what a push did in a tick: (3,) its mean force [N] or torque [N m], (3,) where it acted [m]."""
        self._acted[index].append((tick, np.concatenate([mean, point])))

    def columns(self, pushes: Sequence[Push], which: Sequence[int], rows: int) -> Mapping[str, tuple[str, Array]]:
        """The columns of some pushes, name -> unit and (rows,) values.

        Out of a push they are 0, and its point is NaN.

        Args:
            pushes: of the scenario.
            which: indices of those that are asked for.
            rows: of the trace.
        """
        found: dict[str, tuple[str, Array]] = {}
        for index in which:
            values = np.column_stack([np.zeros((rows, 3)), np.full((rows, 3), np.nan)])
            for tick, value in self._acted[index]:
                values[tick] = value
            channels = push_channels(index + 1, pushes[index])
            found |= {name: (unit, values[:, i]) for i, (name, unit) in enumerate(channels.items())}
        return found


def combined(means: Sequence[Array], points: Sequence[Array]) -> tuple[Array, Array]:
    """What forces (3,) [N] at points (3,) [m] are together: their sum, and the mean of the points by their sizes."""
    if len(means) == 1:
        return means[0], points[0]
    sizes = np.linalg.norm(means, axis=1)
    # The forces of a tick in which a half sine only just begins may be nothing.
    weights = sizes / sizes.sum() if sizes.any() else np.full(len(means), 1.0 / len(means))
    return np.sum(means, axis=0), weights @ np.array(points)
