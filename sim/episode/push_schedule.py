"""The wrench schedule of a scenario: which force or torque acts on which body in which physics step."""

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
        samples: (n, 3) force [N] or torque [N m] held in each step, world frame.
    """

    push: Push
    first: int
    samples: Array

    @property
    def beyond(self) -> int:
        """The first physics step after it."""
        return self.first + len(self.samples)


def start_of_step(step: int, dt: float) -> float:
    """When a physics step begins [s], as the decimal fraction that a scenario's file would have."""
    # 12 digits are found again as the same step, since steps are made whole to within 1e-9 of their number.
    return float(f"{step * dt:.12g}")


def schedule(pushes: Sequence[Push], dt: float, mass: float) -> tuple[ScheduledPush, ...]:
    """Cut pushes into physics steps of `dt` [s], for a robot of `mass` [kg]."""
    cut = []
    for push in pushes:
        first, samples = push.samples(dt, mass)
        samples.setflags(write=False)
        cut.append(ScheduledPush(push=push, first=first, samples=samples))
    return tuple(cut)


@dataclass
class ImpulseLog:
    """Walks through a schedule with the physics and keeps account of what was really delivered.

    Attributes:
        delivered: (n_pushes, 3) impulse so far [N s], summed from the forces that the physics was given; of a torque
            the angular impulse [N m s], likewise.
    """

    scheduled: tuple[ScheduledPush, ...]
    dt: float
    delivered: Array = field(init=False)
    _since: dict[int, Array] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.delivered = np.zeros((len(self.scheduled), 3))

    def insert(self, index: int, push: ScheduledPush) -> None:
        """Take in a push that begins later than those before `index`, and not later than the others."""
        self.scheduled = (*self.scheduled[:index], push, *self.scheduled[index:])
        self.delivered = np.insert(self.delivered, index, 0.0, axis=0)

    def active(self, first: int, beyond: int) -> tuple[int, ...]:
        """Indices of the pushes that act in any of the physics steps [first, beyond)."""
        return tuple(index for index, push in enumerate(self.scheduled) if push.first < beyond and first < push.beyond)

    def sample(self, index: int, step: int) -> Array | None:
        """(3,) force [N] or torque [N m] of a push in a physics step; None outside of it."""
        push = self.scheduled[index]
        return push.samples[step - push.first] if push.first <= step < push.beyond else None

    def book(self, index: int, sample: Array) -> None:
        """Account for a force or a torque that the physics held for one step."""
        impulse = sample * self.dt
        self.delivered[index] += impulse
        self._since[index] = self._since.get(index, 0.0) + impulse

    def take(self) -> dict[int, Array]:
        """The pushes that acted since the last call, and what each delivered since then: (3,) [N s] or [N m s]."""
        taken, self._since = self._since, {}
        return taken
