"""N-step MOA sets of a stepper that chooses ZMP and footholds anew every tick, in the plane of the DCM.

N-O_inf holds the DCMs, seen from the stance foot, from which *some* N footholds within reach and *some* ZMPs in the
soles lead into the set of the regulator on both feet. See `build` for how, `foothold` for which.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.robust import ZmpError
from controllers.gains import UnstableGainError, dcm
from controllers.geometry.planar import edge_lengths, fan, supports
from controllers.geometry.planar_kernel import SHORT
from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import SupportError, SupportPolygon
from controllers.nstep.box import Box, box_supports, flat, union_offsets, within
from controllers.nstep.build import SetTables, StanceTable, StepModel, build
from controllers.nstep.step_kernel import step_slacks, tangents_of
from controllers.nstep.step_limits import StepLimits
from controllers.pendulum import Pendulum
from models.arena import SIDES
from models.errors import InputError
from models.robot import Side

# Ticks: a step or a remaining time this near to a whole number of them is one.
_WHOLE = 1e-6


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepSets:
    """The sets for every number of steps, stance side, step time and tick.

    All states are DCMs [m] seen from the stance foot (its middle the origin, its heading the x axis), and so are swing
    feet and footholds. All feet keep one heading. "Exactly N steps" means N landings, the last of them in the
    regulator's set; a set of N steps need not hold that of fewer. A swing foot that cannot get into its reach in time
    lands at the nearest point; that further steps follow is then promised only if it can swing on from there in time.
    With a `swing_acceleration` in the limits a swing foot is taken to be at rest where it is: ask at lift-off only.

    Attributes:
        pendulum: model and period.
        gain_k: DCM gain of the regulator at the end.
        sole: S, the outline of either sole shrunk by the margin `edge`, in the foot frame.
        limits: reach of the feet.
        step_times: durations of a step [s].
        max_steps: most steps.
        error: W, errors of the ZMP that the sets withstand, new ones every tick.
        tables: offsets of all sets.
    """

    pendulum: Pendulum
    gain_k: float
    sole: SupportPolygon
    limits: StepLimits
    step_times: tuple[float, ...]
    max_steps: int
    error: ZmpError
    tables: SetTables = field(repr=False)
    _tables: dict[tuple[Side, float], StanceTable] = field(init=False, repr=False)
    _reach: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        stances = self.tables.stances
        by_time = {(s, t): stances[s, round(t / self.pendulum.dt)] for s in SIDES for t in self.step_times}
        object.__setattr__(self, "_tables", by_time)
        # How far the foot in the air gets, by the ticks that are left.
        reach = [self.limits.swing_reach(self.pendulum.dt * ticks) for ticks in range(len(self.tables.decay))]
        object.__setattr__(self, "_reach", np.array(reach))

    def tick(self, time_left: float) -> int:
        """Whole ticks in a remaining time [s].

        Raises:
            InputError: it is not a whole number of ticks from 0 to those of the longest step.
        """
        ticks = time_left / self.pendulum.dt
        whole = round(ticks) if math.isfinite(ticks) else -1
        if abs(ticks - whole) > _WHOLE or not 0 <= whole < len(self.tables.decay):
            raise InputError(
                f"time_left: must be whole ticks of {self.pendulum.dt:g} s up to {max(self.step_times):g} s, "
                f"got {time_left!r}"
            )
        return whole

    def table(self, stance: Side, step_time: float) -> StanceTable:
        """Sets on a stance foot when later steps take `step_time` [s].

        Raises:
            InputError: there is no such side or step time.
        """
        try:
            return self._tables[stance, step_time]
        except KeyError:
            raise InputError(
                f"stance, step_time: must be a side and one of {self.step_times} s, got {stance!r}, {step_time!r}"
            ) from None

    def boxes(self, stance: Side, ticks: int, swing: np.ndarray | None, step_time: float) -> tuple[Box, Box]:
        """Where the foot in the air can land `ticks` from now: if that is the last step, and if more follow."""
        last, more = self.tables.boxes[stance], self.table(stance, step_time).box
        if swing is None:
            return last, more
        x, y, radius = float(swing[0]), float(swing[1]), float(self._reach[ticks])
        reach = within(last, x, y, radius)
        return reach, reach if last == more else within(more, x, y, radius)

    def slacks(
        self, dcm: np.ndarray, stance: Side, time_left: float, swing: np.ndarray | None, step_time: float
    ) -> np.ndarray:
        """Slack [m of DCM] of a state in the sets of exactly 1, ..., max_steps steps.

        Args:
            dcm: (2,) seen from the stance foot.
            stance: the foot on the floor.
            time_left: until the other lands [s], whole ticks.
            swing: (2,) where that one is; None if only the rectangle limits where it may land.
            step_time: of all later steps [s].

        Returns:
            (max_steps,) distance to the nearest edge line, negative outside; NaN for NaN.

        Raises:
            InputError: stance, time_left or step_time are none of this set's.
        """
        k = self.tick(time_left)
        table = self.table(stance, step_time)
        last, more = self.boxes(stance, k, swing, step_time)
        x, y = float(dcm[0]), float(dcm[1])
        decay = float(self.tables.decay[k])
        tables, (near, far) = self.tables, self.tables.weights
        boxes = np.array(last[0] + last[1] + more[0] + more[1])
        return step_slacks(
            tables.normals, tables.last, tables.outlines, table.row, table.ahead, k, decay, near, far, boxes, x, y
        )

    def polygon(
        self, steps: int, stance: Side, time_left: float, swing: np.ndarray | None = None, *, step_time: float
    ) -> Polytope:
        """The set of exactly `steps` steps by its irredundant rows: unit normals (r, 2), by angle, and offsets [m].

        Raises:
            InputError: an argument is none of this set's.
        """
        self.require_steps(steps)
        k, table = self.tick(time_left), self.table(stance, step_time)
        last, more = self.boxes(stance, k, swing, step_time)
        decay = self.tables.decay[k]
        if steps > 1:
            normals = table.normals
            offsets = decay * box_supports(more, normals) + table.ahead[:, steps - 2, k]
        else:
            normals = fan(self.tables.normals, tangents_of(flat(last)))
            offsets = decay * union_offsets(last, self.tables.weights, normals)
            offsets = offsets + supports(self.tables.outlines[:, :, k].T, normals)
        edges = edge_lengths(normals, offsets) > SHORT
        return Polytope(S=normals[edges], a=offsets[edges])

    def require_steps(self, steps: int) -> None:
        """Raise InputError unless there are sets of so many steps."""
        if not 1 <= steps <= self.max_steps:
            raise InputError(f"steps: must be 1 to {self.max_steps}, got {steps!r}")


def step_sets(
    pendulum: Pendulum,
    gain_k: float,
    sole: ArrayLike,
    limits: StepLimits,
    step_times: Sequence[float],
    max_steps: int,
    *,
    edge: float = 0.0,
    zmp_error: float = 0.0,
) -> StepSets:
    """Precompute the sets.

    Args:
        pendulum: model and period.
        gain_k: of the regulator on both feet at the end, u = c + k (xi - c) about the middle c of the feet.
        sole: (n, 2) convex outline of either sole, counter-clockwise, in the foot frame [m].
        limits: reach of the feet.
        step_times: durations of a step that may be asked for [s], whole ticks.
        max_steps: most steps, at least 1.
        edge: distance that the ZMP keeps to the edges of the soles [m].
        zmp_error: largest error of the ZMP along each axis, a new one every tick [m].

    Raises:
        InputError: an argument is out of its range.
        EmptySetError: no state withstands the error; it carries the largest that would do.
    """
    times = tuple(float(time) for time in step_times)
    for name, value in (("edge", edge), ("zmp_error", zmp_error)):
        if not (math.isfinite(value) and value >= 0.0):
            raise InputError(f"{name}: must be a finite number of metres, not negative, got {value!r}")
    if not times:
        raise InputError("step_times: must hold at least one duration, got none")
    for time in times:
        ticks = time / pendulum.dt
        if not (math.isfinite(time) and time > 0.0 and abs(ticks - round(ticks)) <= _WHOLE and round(ticks) >= 1):
            raise InputError(f"step_times: must be whole ticks of {pendulum.dt:g} s, got {time!r}")
    if isinstance(max_steps, bool) or not isinstance(max_steps, int | np.integer) or max_steps < 1:
        raise InputError(f"max_steps: must be a whole number, at least 1, got {max_steps!r}")
    try:
        dcm(pendulum, gain_k)
        outline = SupportPolygon(np.asarray(sole, dtype=float)).shrunk(float(edge))
    except UnstableGainError as error:
        raise InputError(f"gain_k: {error}") from None
    except (SupportError, ValueError) as error:
        raise InputError(f"sole, edge: {error}") from None
    withstood = ZmpError.box(zmp_error)
    step_ticks = tuple(dict.fromkeys(round(time / pendulum.dt) for time in times))
    model = StepModel(
        pendulum=pendulum, gain_k=float(gain_k), sole=outline, limits=limits, step_ticks=step_ticks,
        max_steps=int(max_steps), error=withstood,
    )  # fmt: skip
    return StepSets(
        pendulum=pendulum, gain_k=float(gain_k), sole=outline, limits=limits, step_times=times,
        max_steps=int(max_steps), error=withstood,
        tables=build(model),
    )  # fmt: skip
