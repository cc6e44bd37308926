"""How an episode ended, judged from its trace alone."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Phase
from sim.record.trace import Trace

Array = NDArray[np.float64]

FALL_TILT = math.radians(75)
"""Tilt of the trunk beyond which it fell, at any moment [rad]."""
FALL_HEIGHT = 0.5
"""Height of the COG below which it fell, at any moment, as a fraction of nominal."""
END_TILT = math.radians(45)
"""The same at the end of the episode [rad]."""
END_HEIGHT = 0.7
"""The same at the end of the episode."""
REST_SPEED = 0.05
"""Speed of the COG below which it is at rest [m/s]."""
MARCH = 1.0
"""Time over which one who marches in place is looked at, longer than a gait cycle [s]."""
MARCH_WAY = 0.1
"""Way of the COG in that time below which it is on the whole in one place [m]."""
JUDGED_AFTER = 5.0
"""Time after the last push at which being at rest counts as recovered [s]."""
REST_HELD = 1.0
"""Time at rest after the last push that counts as recovered before that [s]."""

_STEPPING = Phase.STEPPING.value
# Times are sums of many periods: 1 s later is 1 s later to within the rounding of those sums.
_ROUNDING = 1e-9


class Result(StrEnum):
    """The three ways to end."""

    RECOVERED = "recovered"
    FELL = "fell"
    NOT_SETTLED = "not_settled"


class Reason(StrEnum):
    """Why it ended so, in words."""

    AT_REST = "at rest with no step under way"
    UPRIGHT = "upright, and on the whole in one place"
    TILT = "trunk tilted by more than 75 degrees"
    HEIGHT = "COG below 50 % of its nominal height"
    CONTACT = "something but the soles touched the floor"
    END_TILT = "trunk tilted by more than 45 degrees at the end"
    END_HEIGHT = "COG below 70 % of its nominal height at the end"
    STEPPING = "still stepping at the end"
    MOVING = "COG still faster than 0.05 m/s at the end"
    TRAVELLING = "COG moved by more than 0.1 m in the last second"
    TOO_SHORT = "at rest, but for less than 1 s and less than 5 s after the last push"
    NOT_FINITE = "the state is not finite"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The verdict.

    Attributes:
        result: which of the three ways.
        reason: why; of a fall, the first reason.
        time_of_fall: when the first reason came true [s]; None without a fall.
        settled_at: since when it is at rest [s]; None if it is not at the end.
        steps_taken: steps begun.
    """

    result: Result
    reason: Reason
    time_of_fall: float | None
    settled_at: float | None
    steps_taken: int


def falls(tilt: Any, height: Any, other_contact: Any) -> dict[Reason, Any]:
    """Whether a robot counts as fallen at a moment, for each reason; of numbers, or of arrays of many moments.

    Args:
        tilt: of the trunk [rad].
        height: of the COG, as a fraction of nominal.
        other_contact: above 0 if something but a sole touches the floor.
    """
    return {
        Reason.TILT: tilt > FALL_TILT,
        Reason.HEIGHT: height < FALL_HEIGHT,
        Reason.CONTACT: other_contact > 0,
    }


def judge(trace: Trace) -> Outcome:
    """Judge an episode.

    It *fell* if at any moment the trunk tilted by more than 75 degrees, the COG was below half its nominal height
    or something but the soles touched the floor; or if in the last row the tilt is above 45 degrees or the COG below
    70 % of nominal. It *recovered* if in the last row no step is under way and the COG is slower than 0.05 m/s,
    either 5 s or more after the last push, or having been so, and as upright as asked of the last row, for
    1 s after it. Else it is *not settled*. Under the scenario's rule "upright" it may step, and the COG must have
    moved by less than 0.1 m in the second before instead.

    Args:
        trace: at least one row; its metadata give the pushes and the nominal height.
    """
    time, steps = trace.time, int(trace["steps"][-1])
    nominal = float(trace.metadata["robot"]["cog_height"])

    def outcome(result: Result, reason: Reason, *, fell: float | None = None, settled: float | None = None) -> Outcome:
        return Outcome(result=result, reason=reason, time_of_fall=fell, settled_at=settled, steps_taken=steps)

    reasons = falls(trace["trunk_tilt"], trace["cog_z"] / nominal, trace["other_contact"])
    fallen = np.logical_or.reduce(list(reasons.values()))
    if fallen.any():
        first = int(fallen.argmax())
        why = next(reason for reason, when in reasons.items() if when[first])
        return outcome(Result.FELL, why, fell=float(time[first]))
    end = float(time[-1])
    if trace["trunk_tilt"][-1] > END_TILT:
        return outcome(Result.FELL, Reason.END_TILT, fell=end)
    if trace["cog_z"][-1] < END_HEIGHT * nominal:
        return outcome(Result.FELL, Reason.END_HEIGHT, fell=end)

    upright = rest_rule(trace.metadata["scenario"]) == "upright"
    speed = np.sqrt(trace["cog_vx"] ** 2 + trace["cog_vy"] ** 2 + trace["cog_vz"] ** 2)
    if not np.isfinite(speed[-1]):
        return outcome(Result.NOT_SETTLED, Reason.NOT_FINITE)
    if upright:
        quiet = _way(trace) < MARCH_WAY
        if not quiet[-1]:
            return outcome(Result.NOT_SETTLED, Reason.TRAVELLING)
    else:
        quiet = (speed < REST_SPEED) & (trace["phase"] != _STEPPING)
        if trace["phase"][-1] == _STEPPING:
            return outcome(Result.NOT_SETTLED, Reason.STEPPING)
        if not quiet[-1]:
            return outcome(Result.NOT_SETTLED, Reason.MOVING)
    last_push = last_push_end(trace.metadata["scenario"])
    resting = quiet & (time >= last_push - _ROUNDING)
    resting &= (trace["trunk_tilt"] <= END_TILT) & (trace["cog_z"] >= END_HEIGHT * nominal)
    if not resting[-1]:
        return outcome(Result.NOT_SETTLED, Reason.TOO_SHORT)
    restless = np.flatnonzero(~resting)
    since = float(time[restless[-1] + 1 if restless.size else 0])
    if end - last_push < JUDGED_AFTER - _ROUNDING and end - since < REST_HELD - _ROUNDING:
        return outcome(Result.NOT_SETTLED, Reason.TOO_SHORT)
    return outcome(Result.RECOVERED, Reason.UPRIGHT if upright else Reason.AT_REST, settled=since)


def rest_rule(scenario: Mapping[str, Any]) -> str:
    """What counts as rest in a scenario (as in a trace's metadata): "still" or "upright"."""
    rule: str = scenario.get("judge", {}).get("rest", "still")
    return rule


def _way(trace: Trace) -> Array:
    """(n,) how far the COG has moved horizontally in the `MARCH` before each row [m]; infinite in the first of it."""
    before = np.searchsorted(trace.time, trace.time - MARCH + _ROUNDING, side="right") - 1
    way = np.hypot(*(trace[axis] - trace[axis][np.maximum(before, 0)] for axis in ("cog_x", "cog_y")))
    return np.where(before >= 0, way, np.inf)


def last_push_end(scenario: Mapping[str, Any]) -> float:
    """When the last push of a scenario (as in a trace's metadata) ends [s]; 0 if there is none."""
    return max((push["start"] + push["duration"] for push in scenario["pushes"]), default=0.0)


class EarlyEnd:
    """Tells, row by row, when the verdict can no longer change for the better: it fell, or rested for 1 s.

    Without a push there is nothing to recover from, so only a fall ends the episode before its time.
    """

    def __init__(
        self, index: Mapping[str, int], *, cog_height: float, last_push: float | None, rest: str, period: float
    ) -> None:
        """Prepare.

        Args:
            index: channel -> column of the rows.
            cog_height: nominal height of the COG [m].
            last_push: when the last push ends [s]; None if there is none.
            rest: what counts as rest, as of `rest_rule`.
            period: time between two rows [s].
        """
        self._place = index["cog_x"]
        # The places of the last second, the oldest first; only one who may march in place is asked for them.
        self._places: deque[Array] | None = deque(maxlen=round(MARCH / period) + 1) if rest == "upright" else None
        self._time, self._tilt, self._height = index["time"], index["trunk_tilt"], index["cog_z"]
        self._contact, self._phase = index["other_contact"], index["phase"]
        self._velocity = (index["cog_vx"], index["cog_vy"], index["cog_vz"])
        self._nominal, self._low_at_end = cog_height, END_HEIGHT * cog_height
        self._last_push = math.inf if last_push is None else last_push
        self._since: float | None = None

    def postpone(self, last_push: float) -> None:
        """A push was added, after which the last one ends at `last_push` [s]; what rested until now does not count."""
        self._last_push, self._since = last_push, None

    def update(self, row: Array) -> bool:
        """Take the next row; True if the episode may end after it."""
        said = row.tolist()  # single numbers of a list are read in a tenth of the time
        tilt, height = said[self._tilt], said[self._height]
        if any(falls(tilt, height / self._nominal, said[self._contact]).values()):
            return True
        time = said[self._time]
        x, y, z = self._velocity
        squared = said[x] ** 2 + said[y] ** 2 + said[z] ** 2
        if not math.isfinite(squared):
            return True
        upright = tilt <= END_TILT and height >= self._low_at_end
        if self._places is None:
            slow = squared < REST_SPEED**2 and said[self._phase] != _STEPPING
        else:
            self._places.append(row[self._place : self._place + 2].copy())
            full = len(self._places) == self._places.maxlen
            slow = full and math.hypot(*(self._places[-1] - self._places[0])) < MARCH_WAY
        if not (upright and slow and time >= self._last_push - _ROUNDING):
            self._since = None
            return False
        if self._since is None:
            self._since = time
        return time - self._since >= REST_HELD - _ROUNDING
