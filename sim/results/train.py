"""A train of pushes: which of them were survived, as the columns of a table."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from scenarios.push import Push
from sim.record.outcome import Reason
from sim.results.prediction import prediction_columns
from sim.results.push_size import push_columns

# Who only reads tables needs no physics.
if TYPE_CHECKING:
    from sim.episode.episode import EpisodeResult
    from sim.episode.push_record import PushRecord

SURVIVED = "pushes_survived"
"""Column of the number of pushes that were survived; null in a row that is no train, or that crashed."""


def stood_until(result: EpisodeResult) -> float:
    """When an episode fell or its state was no longer finite [s]; infinite if neither happened."""
    outcome = result.outcome
    if outcome.time_of_fall is not None:
        return outcome.time_of_fall
    return float(result.trace.time[-1]) if outcome.reason is Reason.NOT_FINITE else math.inf


def train_columns(result: EpisodeResult) -> dict[str, Any]:
    """The columns that say how many pushes of a train were survived.

    A push is survived if it stood from there until the next one began; the last one, if it never fell.
    """
    end, pushes = stood_until(result), result.pushes
    nexts = [*(push.start for push in pushes[1:]), math.inf]
    # Whoever never fell stood until the end of time, and so after the last push, too.
    count = sum(end >= following for following in nexts)
    told = [
        _told(result, push, asked, survived=i < count, until=following)
        for i, (push, asked, following) in enumerate(zip(pushes, result.scenario.pushes, nexts, strict=True))
        if push.start < end
    ]
    return {
        SURVIVED: count,
        "total_impulse": sum(push.delivered_impulse for push in pushes[:count]),
        "delivered_impulse": sum(push.delivered_impulse for push in pushes),
        "pushes": json.dumps(told, allow_nan=False),
    }


def _told(result: EpisodeResult, push: PushRecord, asked: Push, *, survived: bool, until: float) -> dict[str, Any]:
    said = prediction_columns(push, result.decisions, until)
    # JSON knows no infinity; that no step was within reach is told by the membership.
    finite = {name: None if isinstance(value, float) and math.isinf(value) else value for name, value in said.items()}
    return {"start": push.start, "survived": survived, **push_columns(result.robot, asked), **finite}
