"""Every rule of the verdict on small traces that break just that rule."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sim.record.outcome import EarlyEnd, Outcome, Reason, Result, judge
from sim.record.trace import TRACE_CHANNELS, Trace

HEIGHT = 0.26
PERIOD = 0.002
PUSHED_UNTIL = 1.1


def episode(
    duration: float, *, push_end: float | None = PUSHED_UNTIL, rest: str = "still", **changes: tuple[float, float, Any]
) -> Trace:
    """A robot that stands still; `changes` are channel=(from [s], to [s], value)."""
    time = np.arange(round(duration / PERIOD)) * PERIOD
    values = dict.fromkeys(TRACE_CHANNELS, 0.0) | {"time": time, "cog_z": HEIGHT}
    for channel, (start, end, value) in changes.items():
        values[channel] = np.where((start <= time) & (time < end), value, values[channel])
    pushes = [] if push_end is None else [{"start": push_end - 0.1, "duration": 0.1}]
    return Trace(
        values=np.column_stack([np.broadcast_to(column, time.shape) for column in values.values()]),
        units=TRACE_CHANNELS,
        metadata={"scenario": {"pushes": pushes, "judge": {"rest": rest}}, "robot": {"cog_height": HEIGHT}},
    )


def verdict(trace: Trace) -> tuple[Result, Reason]:
    outcome = judge(trace)
    return outcome.result, outcome.reason


def test_standing_still_is_recovered() -> None:
    assert judge(episode(7)) == Outcome(
        result=Result.RECOVERED, reason=Reason.AT_REST, time_of_fall=None, settled_at=PUSHED_UNTIL, steps_taken=0
    )


@pytest.mark.parametrize(
    ("channel", "beyond", "within", "reason"),
    [
        ("trunk_tilt", math.radians(75.01), math.radians(74.99), Reason.TILT),
        ("cog_z", 0.499 * HEIGHT, 0.501 * HEIGHT, Reason.HEIGHT),
        ("other_contact", 1.0, 0.0, Reason.CONTACT),
    ],
)
def test_a_fall_at_any_moment_counts(channel: str, beyond: float, within: float, reason: Reason) -> None:
    # A single row, long before the end, and the robot stands again afterwards.
    outcome = judge(episode(7, **{channel: (2.0, 2.001, beyond)}))
    assert (outcome.result, outcome.reason, outcome.time_of_fall) == (Result.FELL, reason, 2.0)
    assert outcome.settled_at is None
    assert judge(episode(7, **{channel: (2.0, 2.001, within)})).result is Result.RECOVERED


@pytest.mark.parametrize(
    ("channel", "beyond", "within", "reason"),
    [
        ("trunk_tilt", math.radians(45.01), math.radians(44.99), Reason.END_TILT),
        ("cog_z", 0.699 * HEIGHT, 0.701 * HEIGHT, Reason.END_HEIGHT),
    ],
)
def test_the_end_is_judged_more_strictly(channel: str, beyond: float, within: float, reason: Reason) -> None:
    outcome = judge(episode(7, **{channel: (6.998, 9.0, beyond)}))
    assert (outcome.result, outcome.reason) == (Result.FELL, reason)
    assert outcome.time_of_fall == pytest.approx(6.998)
    assert judge(episode(7, **{channel: (6.998, 9.0, within)})).result is Result.RECOVERED
    # The same in the middle of the episode is no fall.
    assert judge(episode(7, **{channel: (2.0, 3.0, beyond)})).result is Result.RECOVERED


def test_the_first_of_several_reasons_counts() -> None:
    outcome = judge(
        episode(7, other_contact=(2.5, 9, 1.0), cog_z=(2.4, 9, 0.05), trunk_tilt=(2.6, 9, math.radians(80)))
    )
    assert (outcome.reason, outcome.time_of_fall) == (Reason.HEIGHT, 2.4)


def test_a_fall_that_begins_before_the_push_is_a_fall() -> None:
    assert judge(episode(7, trunk_tilt=(0.0, 0.001, 2.0))).time_of_fall == 0.0


@pytest.mark.parametrize("channel", ["cog_vx", "cog_vy", "cog_vz"])
def test_a_moving_cog_is_not_settled(channel: str) -> None:
    assert verdict(episode(7, **{channel: (0.0, 9.0, -0.0501)})) == (Result.NOT_SETTLED, Reason.MOVING)
    assert verdict(episode(7, **{channel: (0.0, 9.0, -0.0499)})) == (Result.RECOVERED, Reason.AT_REST)


def test_the_speed_is_that_of_all_directions_together() -> None:
    assert verdict(episode(7, cog_vx=(0, 9, 0.04), cog_vy=(0, 9, 0.04))) == (Result.NOT_SETTLED, Reason.MOVING)


def test_stepping_at_the_end_is_not_settled() -> None:
    assert verdict(episode(7, phase=(6.0, 9.0, 1.0))) == (Result.NOT_SETTLED, Reason.STEPPING)


def test_the_statue_can_recover_too() -> None:
    assert judge(episode(7, phase=(0.0, 9.0, 0.0))).result is Result.RECOVERED


def test_rest_for_a_second_is_enough_to_stop_early() -> None:
    # At rest from 1.5 s on; the last row is one period before the duration.
    moving = {"cog_vx": (0.0, 1.5, 0.1)}
    assert verdict(episode(2.5 + PERIOD, **moving)) == (Result.RECOVERED, Reason.AT_REST)
    assert verdict(episode(2.5, **moving)) == (Result.NOT_SETTLED, Reason.TOO_SHORT)
    assert judge(episode(2.5 + PERIOD, **moving)).settled_at == pytest.approx(1.5)


def test_rest_before_the_last_push_does_not_count() -> None:
    assert verdict(episode(PUSHED_UNTIL + 0.5)) == (Result.NOT_SETTLED, Reason.TOO_SHORT)
    assert verdict(episode(PUSHED_UNTIL - 0.05)) == (Result.NOT_SETTLED, Reason.TOO_SHORT)


def test_rest_at_five_seconds_is_enough_however_short() -> None:
    moving = {"cog_vx": (0.0, PUSHED_UNTIL + 4.9, 0.1)}
    assert verdict(episode(PUSHED_UNTIL + 5.0 + PERIOD, **moving)) == (Result.RECOVERED, Reason.AT_REST)
    assert verdict(episode(PUSHED_UNTIL + 5.0 - PERIOD, **moving)) == (Result.NOT_SETTLED, Reason.TOO_SHORT)


def test_without_a_push_standing_is_recovered() -> None:
    assert judge(episode(2, push_end=None)).result is Result.RECOVERED
    assert judge(episode(0.5, push_end=None)).reason is Reason.TOO_SHORT


def test_the_last_of_several_pushes_counts() -> None:
    trace = episode(3)
    metadata = {
        "scenario": {"pushes": [{"start": 2.0, "duration": 0.5}, {"start": 0.5, "duration": 0.1}]},
        "robot": {"cog_height": HEIGHT},
    }
    outcome = judge(Trace(values=trace.values, units=trace.units, metadata=metadata))
    assert outcome.reason is Reason.TOO_SHORT


def test_a_state_that_is_not_finite_is_never_recovered() -> None:
    assert verdict(episode(7, cog_vx=(6.0, 9.0, np.nan))) == (Result.NOT_SETTLED, Reason.NOT_FINITE)


def test_steps_are_counted() -> None:
    assert judge(episode(7, steps=(3.0, 9.0, 2.0))).steps_taken == 2


def test_who_marches_in_place_is_recovered_if_that_is_the_rule() -> None:
    marching = {"phase": (0.0, 9.0, 1.0), "cog_vy": (0.0, 9.0, 0.2)}
    assert verdict(episode(7, **marching)) == (Result.NOT_SETTLED, Reason.STEPPING)
    outcome = judge(episode(7, rest="upright", **marching))
    assert (outcome.result, outcome.reason, outcome.settled_at) == (Result.RECOVERED, Reason.UPRIGHT, PUSHED_UNTIL)


@pytest.mark.parametrize(("speed", "result"), [(0.09, Result.RECOVERED), (0.11, Result.NOT_SETTLED)])
def test_who_marches_away_is_not(speed: float, result: Result) -> None:
    time = np.arange(round(7 / PERIOD)) * PERIOD
    trace = episode(7, rest="upright", cog_x=(0.0, 9.0, speed * time))
    assert judge(trace).result is result
    assert early_end(trace) == (None if result is Result.NOT_SETTLED else round((PUSHED_UNTIL + 1.0) / PERIOD) + 1)


def early_end(trace: Trace) -> int | None:
    """Rows until the episode may end."""
    pushes = trace.metadata["scenario"]["pushes"]
    index = {name: i for i, name in enumerate(trace.channels)}
    last = pushes[-1]["start"] + pushes[-1]["duration"] if pushes else None
    watch = EarlyEnd(
        index, cog_height=HEIGHT, last_push=last, rest=trace.metadata["scenario"]["judge"]["rest"], period=PERIOD
    )
    return next((i + 1 for i, row in enumerate(trace.values) if watch.update(row)), None)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"cog_vx": (0.0, 2.0, 0.1)},
        {"phase": (1.05, 2.3, 1.0)},
        {"cog_vy": (1.9, 1.95, 0.06), "phase": (1.05, 1.3, 1.0)},
        {"trunk_tilt": (1.5, 1.9, math.radians(46))},
        {"cog_z": (1.5, 1.9, 0.69 * HEIGHT)},
        {"trunk_tilt": (2.0, 9.0, 1.4)},
        {"cog_z": (1.5, 9.0, 0.1)},
        {"other_contact": (0.5, 0.501, 1.0)},
        {"rest": "upright", "phase": (0.0, 9.0, 1.0)},
        {"rest": "upright", "cog_x": (1.5, 9.0, 0.15)},
        {"rest": "upright", "trunk_tilt": (1.5, 1.9, math.radians(46))},
    ],
)
def test_ending_early_does_not_change_the_verdict(changes: dict[str, Any]) -> None:
    trace = episode(7, **changes)
    rows = early_end(trace)
    assert rows is not None
    short = Trace(values=trace.values[:rows], units=trace.units, metadata=trace.metadata)
    assert judge(short) == judge(trace)
    # Not one row sooner: then it is not yet known.
    before = Trace(values=trace.values[: rows - 1], units=trace.units, metadata=trace.metadata)
    assert judge(before).result is Result.NOT_SETTLED


@pytest.mark.parametrize(
    "changes",
    [
        {"cog_vx": (0.0, 9.0, 0.06)},
        {"phase": (1.0, 9.0, 1.0)},
        {"trunk_tilt": (0.0, 9.0, math.radians(46))},
        {"cog_z": (0.0, 9.0, 0.69 * HEIGHT)},
    ],
)
def test_an_open_end_is_waited_for(changes: dict[str, tuple[float, float, float]]) -> None:
    assert early_end(episode(7, **changes)) is None


def test_without_a_push_only_a_fall_ends_early() -> None:
    assert early_end(episode(3, push_end=None)) is None
    assert early_end(episode(3, push_end=None, other_contact=(2.0, 3.0, 1.0))) == 1001


def test_a_state_that_is_not_finite_ends_at_once() -> None:
    assert early_end(episode(3, cog_vx=(1.0, 3.0, np.nan))) == 501
