"""The wrench schedule of a scenario: which force acts on which body in which physics step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenarios.push import Push

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ScheduledPush:
    """A push cut into physics steps.

    Attributes:
        push: what was asked.
        first: the first physics step it acts in.
        forces: (n, 3) force held in each step, world frame [N].
    """

    push: Push
    first: int
    forces: Array

    @property
    def beyond(self) -> int:
        """The first physics step after it."""
        return self.first + len(self.forces)


def start_of_step(step: int, dt: float) -> float:
    """When a physics step begins [s], as the decimal fraction that a scenario's file would have."""
    # 12 digits are found again as the same step, since steps are made whole to within 1e-9 of their number.
    return float(f"{step * dt:.12g}")


def schedule(pushes: Sequence[Push], dt: float, mass: float) -> tuple[ScheduledPush, ...]:
    """Cut pushes into physics steps of `dt` [s], for a robot of `mass` [kg]."""
    cut = []
    for push in pushes:
        first, forces = push.force_samples(dt, mass)
        forces.setflags(write=False)
        cut.append(ScheduledPush(push=push, first=first, forces=forces))
    return tuple(cut)


@dataclass
class ImpulseLog:
    """Walks through a schedule with the physics and keeps account of what was really delivered.

    Attributes:
        delivered: (n_pushes, 3) impulse so far [N s], summed from the forces that the physics was given.
        acting: the push that was last booked since `take`, or None.
    """

    scheduled: tuple[ScheduledPush, ...]
    dt: float
    delivered: Array = field(init=False)
    acting: int | None = field(init=False, default=None)
    _since: Array = field(init=False)

    def __post_init__(self) -> None:
        self.delivered = np.zeros((len(self.scheduled), 3))
        self._since = np.zeros(3)

    def insert(self, index: int, push: ScheduledPush) -> None:
        """Take in a push that begins later than those before `index`, and not later than the others."""
        self.scheduled = (*self.scheduled[:index], push, *self.scheduled[index:])
        self.delivered = np.insert(self.delivered, index, 0.0, axis=0)

    def active(self, first: int, beyond: int) -> int | None:
        """Index of the push that acts in any of the physics steps [first, beyond), or None."""
        for index, push in enumerate(self.scheduled):
            if push.first < beyond and first < push.beyond:
                return index
        return None

    def force(self, index: int, step: int) -> Array | None:
        """(3,) force of a push in a physics step [N]; None outside of it."""
        push = self.scheduled[index]
        return push.forces[step - push.first] if push.first <= step < push.beyond else None

    def book(self, index: int, force: Array) -> None:
        """Account for a force that the physics held for one step."""
        impulse = force * self.dt
        self.delivered[index] += impulse
        self._since += impulse
        self.acting = index

    def take(self) -> tuple[int, Array] | None:
        """Which push acted since the last call, and its impulse (3,) since then [N s]; None if none did."""
        if self.acting is None:
            return None
        taken = self.acting, self._since
        self.acting, self._since = None, np.zeros(3)
        return taken
