"""Pushes that a suite draws: alone, in growing trains, or before the push that is asked for."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from controllers.fields import Strict
from scenarios.push import LONGEST, DeltaV, Direction, Duration, Impulse, Offset, Start


def _ordered(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError("must be [lowest, highest]")
    return span


_SPAN = (Field(strict=False), AfterValidator(_ordered))
Directions = Annotated[tuple[Direction, Direction], *_SPAN]
Relative = Annotated[float, Field(ge=1e-3, le=50)]
"""Size of a push [omega d]: from nothing that is felt to far more than any steps answer."""
ALL_AROUND = (0.0, 360.0)
"""Every direction [deg]."""


class Random(Strict):
    """Pushes drawn evenly from ranges [lowest, highest].

    Attributes:
        count: how many, at most 1e9; more of them change none of the former.
        direction, delta_v, impulse, duration, start, height: as of a push.
    """

    count: int = Field(ge=1, le=1_000_000_000)
    direction: Directions | None = None
    delta_v: Annotated[tuple[DeltaV, DeltaV], *_SPAN] | None = None
    impulse: Annotated[tuple[Impulse, Impulse], *_SPAN] | None = None
    duration: Annotated[tuple[Duration, Duration], *_SPAN] | None = None
    start: Annotated[tuple[Start, Start], *_SPAN] | None = None
    height: Annotated[tuple[Offset, Offset], *_SPAN] | None = None

    def given(self) -> dict[str, tuple[float, float]]:
        """The ranges that the suite has."""
        names = (name for name in Random.model_fields if name != "count")
        return {name: span for name in names if (span := getattr(self, name)) is not None}


class Train(Strict):
    """Pushes one after another, each larger than the one before, until one fells.

    Sizes are multiples of omega d, the most that a pendulum takes without a step, d being the distance from the middle
    of the feet of the standing robot to their edge in the push's own direction: so robots can be compared. The axes
    give what all pushes share (body, duration, height) and the start of the first.

    Attributes:
        count: pushes at most, 2 to 1000.
        interval: from the start of one to the start of the next [s], at most 3600.
        first: size of the first [omega d], from 1e-3 to 50.
        growth: by how much each is larger than the one before [omega d], at most 50.
        direction: [lowest, highest] that each one's direction is drawn from, evenly, by the suite's seed and the
            replica; the same for all who are compared [deg].
    """

    count: int = Field(ge=2, le=1000)
    interval: Annotated[float, Field(gt=0, le=LONGEST)]
    first: Relative
    growth: Annotated[float, Field(ge=0, le=50)]
    direction: Directions = ALL_AROUND

    def size(self, number: int) -> float:
        """Size of push `number`, counted from 0 [omega d]."""
        return self.first + self.growth * number


class First(Strict):
    """A push before the one that is asked for, which so disturbs the recovery from it.

    It acts on the same body at the same height as the push that is asked for.

    Attributes:
        size: [omega d] of its own direction, as of a train.
        gap: from its end to the start of the push that is asked for [s], at most 3600.
        duration: [s].
        direction: [lowest, highest] of its direction: the suite's seed draws that of the first replica, and the others
            are spread over the range; the same whatever push follows, and for all who are compared [deg].
    """

    size: Relative
    gap: Annotated[float, Field(gt=0, le=LONGEST)]
    duration: Duration = 0.1
    direction: Directions = ALL_AROUND
