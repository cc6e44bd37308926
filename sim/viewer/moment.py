"""What is to be seen at one moment of an episode, read off a row of its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import Phase
from models.arena import SIDES, Side, drawn_size
from scenarios.push import Push
from sim.record.seen import seen_cog
from sim.record.trace import ROOT_CHANNELS, SEEN_CHANNELS
from sim.viz.playback import LOADED
from sim.viz.push_shapes import FADE, arc, arrow

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Moment:
    """One moment; lengths in metres, in the world frame.

    Attributes:
        time: [s].
        cog: (3,) centre of gravity.
        dcm: (2,) cog + cog velocity / omega.
        seen_cog: (3,) COG as the controllers see it about the loaded soles; NaN where they see the true one.
        zmp, zmp_command: (2,) measured and commanded ZMP; NaN where there is none.
        support: (n, 2) corners of the polygon of the soles that carry weight; None if none does.
        feet: side -> (4,) x, y, z and yaw [rad] of the sole.
        pose: (7 + n,) position, quaternion (w x y z) and joint angles [rad]; None for the pendulum.
        phase: whether a step is under way.
        steps: begun so far.
        slacks: of the set of standing and of that of the steps under way; NaN for none.
        arrows: (k, 2, 3) tails and tips of the arrows of the pushes that act or have just acted.
        arcs: (m, 2, 3) pieces of the arcs of those that are torques, each of which has an arrow, too.
    """

    time: float
    cog: Array
    dcm: Array
    seen_cog: Array
    zmp: Array
    zmp_command: Array
    support: Array | None
    feet: Mapping[Side, Array]
    pose: Array | None
    phase: Phase
    steps: int
    slacks: tuple[float, float]
    arrows: Array
    arcs: Array

    @property
    def phase_words(self) -> str:
        """Whether a step is under way, and which."""
        return self.phase.name.lower() + (f": step {self.steps}" if self.phase is Phase.STEPPING else "")

    @property
    def words(self) -> str:
        """The time, and whether a step is under way."""
        return f"{self.time:.2f} s  {self.phase_words}"


class Observer:
    """Reads the rows of one episode, in order of time: of a trace, or while it is being recorded."""

    def __init__(self, channels: Sequence[str], robot: Mapping[str, Any]) -> None:
        """Prepare.

        Args:
            channels: names of the columns.
            robot: facts of the robot, as in the metadata of a trace.
        """
        at = {name: i for i, name in enumerate(channels)}
        self._time, self._phase, self._steps = at["time"], at["phase"], at["steps"]
        self._cog = [at[f"cog_{axis}"] for axis in "xyz"]
        self._velocity = [at[f"cog_v{axis}"] for axis in "xy"]
        self._seen = [at[name] for name in SEEN_CHANNELS] if "seen_cog_x" in at else None
        self._zmp = [at[f"zmp_{axis}"] for axis in "xy"]
        self._command = [at[f"zmp_cmd_{axis}"] for axis in "xy"]
        self._slacks = at["regulator_slack"], at["tracking_slack"]
        self._feet = {side: [at[f"{side}_{name}"] for name in ("x", "y", "z", "yaw")] for side in SIDES}
        self._load = {side: at[f"{side}_force"] for side in SIDES}
        joints = [i for name, i in at.items() if name.startswith("q_")]
        self._pose = [at[name] for name in ROOT_CHANNELS] + joints if "root_x" in at else None
        self._omega = float(robot["omega"])
        self._weight = float(robot["mass"]) * self._omega**2 * float(robot["cog_height"])
        self._size = drawn_size(float(robot["cog_height"]))
        self._soles = {side: np.array(robot["sole_vertices"][side], dtype=np.float64) for side in SIDES}
        self._recent: dict[int, _Recent] = {}

    def see(self, row: Array, acting: Mapping[int, tuple[Array, Array]], pushes: Sequence[Push]) -> None:
        """Take the next row into account; none may be left out, for a push may last one control period.

        Args:
            row: (c,) of the record.
            acting: which pushes act in it: index -> (3,) force [N] or torque [N m], and (3,) where [m].
            pushes: of the scenario.
        """
        now = float(row[self._time])
        if any(index not in self._recent for index in acting):
            # What is over gives way to the next.
            self._recent = {index: recent for index, recent in self._recent.items() if index in acting}
        for index, (value, point) in acting.items():
            known = self._recent.get(index)
            if known is None:
                known = self._recent[index] = _Recent(is_torque=pushes[index].torque is not None)
            if value.any():
                known.acted_at, known.value = now, value
                if known.largest @ known.largest <= value @ value:
                    known.largest, known.from_cog = value, point - row[self._cog]

    def moment(self, row: Array) -> Moment:
        """What is to be seen in a row (c,), the last one that `see` took."""
        cog = row[self._cog]
        arrows, arcs = self._pushes(float(row[self._time]), cog)
        feet = {side: row[columns] for side, columns in self._feet.items()}
        loaded = [
            Foot(position=feet[side][:2], yaw=float(feet[side][3]), sole=self._soles[side])
            for side in SIDES
            if row[self._load[side]] > LOADED * self._weight
        ]
        return Moment(
            time=float(row[self._time]),
            cog=cog,
            dcm=cog[:2] + row[self._velocity] / self._omega,
            seen_cog=np.full(3, np.nan)
            if self._seen is None
            else seen_cog(cog, row[self._velocity], row[self._seen], self._omega),
            zmp=row[self._zmp],
            zmp_command=row[self._command],
            support=support_polygon(loaded).vertices if loaded else None,
            feet=feet,
            pose=None if self._pose is None else row[self._pose],
            phase=Phase(int(row[self._phase])),
            steps=int(row[self._steps]),
            slacks=(float(row[self._slacks[0]]), float(row[self._slacks[1]])),
            arrows=arrows,
            arcs=arcs,
        )

    def _pushes(self, now: float, cog: Array) -> tuple[Array, Array]:
        arrows, arcs = [], []
        for push in self._recent.values():
            if not push.acted_at <= now <= push.acted_at + FADE:
                continue
            # Afterwards its largest force is what should be remembered, not the last of a half sine.
            value, point = push.value if push.acted_at == now else push.largest, cog + push.from_cog
            if push.is_torque:
                around, head = arc(point, value, self._weight, self._size)
                arcs.append(np.stack([around[:-1], around[1:]], axis=1))
                arrows.append(head)
            else:
                arrows.append(arrow(point, value, self._weight, self._size))
        return np.array(arrows).reshape(-1, 2, 3), np.concatenate([np.empty((0, 2, 3)), *arcs])


@dataclass(kw_only=True)
class _Recent:
    """A push of late: when it last acted [s], with what, its largest, and where that acted as seen from the COG."""

    is_torque: bool
    acted_at: float = -np.inf
    value: Array = field(default_factory=lambda: np.zeros(3))
    largest: Array = field(default_factory=lambda: np.zeros(3))
    from_cog: Array = field(default_factory=lambda: np.zeros(3))
