"""A saved trace as pictures need it: pushes, supports, DCM and standing or stepping, at any tick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import Phase
from models.arena import SIDES, Side, drawn_size
from scenarios.schema import Scenario
from sim.record.outcome import Outcome, judge
from sim.record.seen import seen_cog
from sim.record.trace import SEEN_CHANNELS, Trace

Array = NDArray[np.float64]

LOADED = 0.01
"""A sole that carries less than this fraction of the weight is being put down or lifted, not a support."""
_BOUNCE = 0.05  # [s] that a sole is up between two contacts of one landing, at most
# Times are sums of decimal fractions.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True)
class PushMark:
    """A push of the scenario.

    Attributes:
        number: from 1.
        axis: 0 for x, 1 for y: along which it pushes most.
        start, end: [s].
        words: its size: "0.55 N s, 0.10 m/s", or "torque 3 N m about y on trunk, 0.30 N m s".
        is_torque: whether it is a torque.
    """

    number: int
    axis: int
    start: float
    end: float
    words: str
    is_torque: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Seen:
    """What the controllers saw in place of the true state, where it was off relative to the loaded soles.

    Attributes:
        cog: (n, 3) [m].
        dcm: (n, 2) [m].
        dcm_error, velocity_error: (n, 2) of the DCM [m] and of the COG's velocity [m/s], seen less true.
    """

    cog: Array
    dcm: Array
    dcm_error: Array
    velocity_error: Array


class Playback:
    """Read-only view of a trace by control tick.

    Attributes:
        trace: the trace.
        scenario: the scenario as it was run.
        time: (n,) start of each tick [s].
        mass, omega, weight: of the robot [kg], [1/s], [N].
        cog: (n, 3) [m].
        zmp, zmp_command: (n, 2) measured (NaN in the air) and commanded ZMP [m].
        dcm: (n, 2) cog + cog velocity / omega [m].
        force, force_point: (n, 3) of all pushes during each tick [N], [m]; see `acted` for one.
        pushes: the pushes in order of time.
        supporting: side -> (n,) whether that sole carries weight.
    """

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.scenario = Scenario.model_validate(trace.metadata["scenario"])
        robot = trace.metadata["robot"]
        self.mass = float(robot["mass"])
        self.omega = float(robot["omega"])
        self.weight = self.mass * self.omega**2 * float(robot["cog_height"])
        self.size = drawn_size(float(robot["cog_height"]))
        self.time = trace.time
        self.cog = _columns(trace, "cog_{}", "xyz")
        self.zmp = _columns(trace, "zmp_{}", "xy")
        self.zmp_command = _columns(trace, "zmp_cmd_{}", "xy")
        self.dcm = self.cog[:, :2] + _columns(trace, "cog_v{}", "xy") / self.omega
        self.force = _columns(trace, "push_f{}", "xyz")
        self.force_point = _columns(trace, "push_{}", "xyz")
        self.pushes = tuple(self._marks())
        self.soles = {side: np.array(robot["sole_vertices"][side], dtype=np.float64) for side in SIDES}
        self.feet = {side: _columns(trace, side + "_{}", ("x", "y", "z", "yaw")) for side in SIDES}
        self.supporting = {side: trace[f"{side}_force"] > LOADED * self.weight for side in SIDES}

    @cached_property
    def seen(self) -> Seen | None:
        """What the controllers saw; None if that was the true state."""
        if "dcm_error_x" not in self.trace.channels:
            return None
        seen = np.column_stack([self.trace[name] for name in SEEN_CHANNELS])
        velocity = _columns(self.trace, "cog_v{}", "xy")
        return Seen(
            cog=seen_cog(self.cog, velocity, seen, self.omega),
            dcm=self.dcm + seen[:, 6:8],
            dcm_error=seen[:, 6:8],
            velocity_error=seen[:, 3:5] - velocity,
        )

    @cached_property
    def outcome(self) -> Outcome:
        """The verdict."""
        return judge(self.trace)

    @property
    def is_humanoid(self) -> bool:
        """Whether the trace holds the pose of a whole body."""
        return "root_x" in self.trace.channels

    def tick(self, time: float) -> int:
        """The tick that `time` [s] falls in."""
        return int(np.clip(np.searchsorted(self.time, time + 1e-9, side="right") - 1, 0, len(self.time) - 1))

    def phase(self, tick: int) -> Phase:
        """Whether a step is under way."""
        return Phase(int(self.trace["phase"][tick]))

    def foot(self, tick: int, side: Side) -> Foot:
        """The sole of `side`, as if flat."""
        x, y, _, yaw = self.feet[side][tick]
        return Foot(position=np.array([x, y]), yaw=float(yaw), sole=self.soles[side])

    def touchdowns(self) -> list[float]:
        """When a sole came down that had been up for longer than a bounce [s], in order."""
        found = []
        for on in self.supporting.values():
            up = np.inf  # a sole that is down at the start has not come down
            for before, now, time in zip(on[:-1], on[1:], self.time[1:], strict=True):
                if before and not now:
                    up = time
                elif now and not before and time - up > _BOUNCE:
                    found.append(float(time))
        return sorted(found)

    def support(self, tick: int) -> Array | None:
        """(n, 2) corners of the polygon of the soles that carry weight [m]; None if none does."""
        feet = [self.foot(tick, side) for side in SIDES if self.supporting[side][tick]]
        return support_polygon(feet).vertices if feet else None

    def support_extent(self, axis: int) -> Array:
        """(n, 2) lowest and highest coordinate of the support polygon along `axis` [m]; NaN without support."""
        low = np.full(len(self.time), np.inf)
        high = np.full(len(self.time), -np.inf)
        for side in SIDES:
            yaw = self.feet[side][:, 3, None]
            x, y = self.soles[side].T
            along = np.cos(yaw) * x - np.sin(yaw) * y if axis == 0 else np.sin(yaw) * x + np.cos(yaw) * y
            along = along + self.feet[side][:, axis, None]
            on = self.supporting[side]
            low = np.where(on, np.minimum(low, along.min(axis=1)), low)
            high = np.where(on, np.maximum(high, along.max(axis=1)), high)
        extent = np.column_stack([low, high])
        extent[~np.isfinite(extent).all(axis=1)] = np.nan
        return extent

    def acted(self, push: PushMark) -> tuple[Array, Array]:
        """A push by itself: (n, 3) its force [N] or torque [N m], and (n, 3) where it acts [m].

        They hold from its start to its end; those of a push that the trace does not tell apart are the shared ones.
        """
        own = f"push_{push.number}_"
        if f"{own}x" not in self.trace.channels:
            return self.force, self.force_point
        return (
            _columns(self.trace, own + ("t{}" if push.is_torque else "f{}"), "xyz"),
            _columns(self.trace, own + "{}", "xyz"),
        )

    def recent(self, now: float, after: float) -> list[PushMark]:
        """The pushes that act at `now` [s] or did until `after` [s] ago; one that is over gives way to the next."""
        begun = [push for push in self.pushes if push.start <= now <= push.end + after]
        latest = max((push.start for push in begun), default=0.0)
        return [push for push in begun if push.end > latest + _ROUNDING]

    def phases(self) -> list[tuple[float, float, Phase]]:
        """From when to when [s] it stood and stepped, without gaps."""
        codes = self.trace["phase"]
        starts = np.flatnonzero(np.diff(codes, prepend=np.nan) != 0)
        ends = [*self.time[starts[1:]], self.time[-1]]
        return [(float(self.time[i]), float(end), self.phase(int(i))) for i, end in zip(starts, ends, strict=True)]

    def _marks(self) -> Iterator[PushMark]:
        for number, push in enumerate(self.scenario.pushes, start=1):
            size = float(np.linalg.norm(push.asked(self.mass)))
            turns = push.torque is not None
            words = f"{push.torque_words}, {size:.2f} N m s" if turns else f"{size:.2f} N s, {size / self.mass:.2f} m/s"
            when = {"start": push.start, "end": push.end}
            yield PushMark(number=number, axis=push.axis, words=words, is_torque=turns, **when)


def _columns(trace: Trace, pattern: str, names: str | tuple[str, ...]) -> Array:
    return np.column_stack([trace[pattern.format(name)] for name in names])
