"""What is to be seen at one moment of an episode, read off a row of its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import Phase
from models.arena import SIDES, Side
from sim.record.trace import ROOT_CHANNELS
from sim.viz.overlay import ARROW_PER_WEIGHT, FADE, LEAST_ARROW
from sim.viz.playback import LOADED

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Moment:
    """One moment; lengths in metres, in the world frame.

    Attributes:
        time: [s].
        cog: (3,) centre of gravity.
        dcm: (2,) cog + cog velocity / omega.
        zmp, zmp_command: (2,) measured and commanded ZMP; NaN where there is none.
        support: (n, 2) corners of the polygon of the soles that carry weight; None if none does.
        feet: side -> (4,) x, y, z and yaw [rad] of the sole.
        pose: (7 + n,) position, quaternion (w x y z) and joint angles [rad]; None for the pendulum.
        phase: whether a step is under way.
        steps: begun so far.
        slacks: of the set of standing and of that of the steps under way; NaN for none.
        arrow: (2, 3) from where to where the arrow of a push goes; None if none acts or has just acted.
    """

    time: float
    cog: Array
    dcm: Array
    zmp: Array
    zmp_command: Array
    support: Array | None
    feet: Mapping[Side, Array]
    pose: Array | None
    phase: Phase
    steps: int
    slacks: tuple[float, float]
    arrow: Array | None

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
        self._zmp = [at[f"zmp_{axis}"] for axis in "xy"]
        self._command = [at[f"zmp_cmd_{axis}"] for axis in "xy"]
        self._slacks = at["regulator_slack"], at["tracking_slack"]
        self._force = [at[f"push_f{axis}"] for axis in "xyz"]
        self._point = [at[f"push_{axis}"] for axis in "xyz"]
        self._feet = {side: [at[f"{side}_{name}"] for name in ("x", "y", "z", "yaw")] for side in SIDES}
        self._load = {side: at[f"{side}_force"] for side in SIDES}
        joints = [i for name, i in at.items() if name.startswith("q_")]
        self._pose = [at[name] for name in ROOT_CHANNELS] + joints if "root_x" in at else None
        self._omega = float(robot["omega"])
        self._weight = float(robot["mass"]) * self._omega**2 * float(robot["cog_height"])
        self._soles = {side: np.array(robot["sole_vertices"][side], dtype=np.float64) for side in SIDES}
        # Of the latest push: when it last acted, its largest force, and where that acted as seen from the COG.
        self._pushed_at = -np.inf
        self._largest = self._from_cog = np.zeros(3)

    def see(self, row: Array) -> None:
        """Take the next row (c,) into account; none may be left out, for a push may last one control period."""
        if not row[self._force].any():
            return
        now, force = float(row[self._time]), row[self._force]
        if now > self._pushed_at + FADE or force @ force >= self._largest @ self._largest:
            self._largest, self._from_cog = force, row[self._point] - row[self._cog]
        self._pushed_at = now

    def moment(self, row: Array) -> Moment:
        """What is to be seen in a row (c,), the last one that `see` took."""
        cog = row[self._cog]
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
            zmp=row[self._zmp],
            zmp_command=row[self._command],
            support=support_polygon(loaded).vertices if loaded else None,
            feet=feet,
            pose=None if self._pose is None else row[self._pose],
            phase=Phase(int(row[self._phase])),
            steps=int(row[self._steps]),
            slacks=(float(row[self._slacks[0]]), float(row[self._slacks[1]])),
            arrow=self._arrow(float(row[self._time]), cog, row[self._force]),
        )

    def _arrow(self, now: float, cog: Array, force: Array) -> Array | None:
        if now > self._pushed_at + FADE:
            return None
        # Afterwards its largest force is what should be remembered, not the last of a half sine.
        shown = force if force.any() else self._largest
        size = float(np.linalg.norm(shown))
        tip = cog + self._from_cog
        return np.array([tip - shown / size * max(size * ARROW_PER_WEIGHT / self._weight, LEAST_ARROW), tip])
