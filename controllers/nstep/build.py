"""Offsets of all sets of a stepper that re-plans, for every number of steps, side, step time and tick.

Sets are convex polygons in the plane of the DCM xi = c + cdot / omega, seen from the stance foot, and tracked by
their support functions. With z in the sole S, xi+ = a xi + (1 - a) z, a = e^{omega dt}, so a target X at landing is
reached k ticks before from a^{-k} X + (1 - a^{-k}) S; that z is held for a step loses nothing, S being convex.

At a landing on p without further steps the regulator u = p/2 + k (xi - p/2) must keep u in hull(S, p + S), which is
{al p + s}: xi = lam p + s / k with |lam - 1/2| <= 1/(2 k), s in S. With more steps xi - p must be in the set of the
next stance. Over a box P of footholds that is conv(lam_0 P, lam_1 P) + S / k, and P + the set of the next stance.

With the ZMP off by w in a box W each tick, the commanded z stays in S - W (Pontryagin) and a tick back is
X(k + 1) = a^{-1} [(X(k) - (a - 1) W) + (a - 1) (S - W)]. X is then seen from the foothold, which is taken as chosen: a
foothold that may still follow the errors would at most do better.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.geometry.planar import EmptyPlanarError, corners, edge_lengths, fan, supports, tightened
from controllers.geometry.support_polygon import SupportPolygon
from controllers.nstep.box import AXES, Box, box_of, box_supports, flat, union_offsets
from controllers.nstep.step_kernel import tangents_of
from controllers.nstep.step_limits import StepLimits
from controllers.pendulum import Pendulum
from models.arena import SIDES
from models.robot import Side, other

# Halvings of the search for the largest error: a millionth of the one asked for.
_HALVINGS = 20
# Relative: offsets of an erosion by nothing but rounding must not count as cut off.
_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepModel:
    """Whose sets to build.

    Attributes:
        pendulum: model and period.
        gain_k: DCM gain of the regulator at the end.
        sole: S, for both feet.
        limits: reach of the feet.
        step_ticks: durations of a step.
        max_steps: most steps.
        error: W.
    """

    pendulum: Pendulum
    gain_k: float
    sole: SupportPolygon
    limits: StepLimits
    step_ticks: tuple[int, ...]
    max_steps: int
    error: ZmpError


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StanceTable:
    """Sets from which to reach the next stance's, for one stance side and step time.

    Attributes:
        normals: (J, 2) unit, by angle.
        ahead: (J, N - 1, K + 1) offsets [m] of the states that reach, in k ticks, the set of 1 .. N - 1 steps of the
            next stance, seen from a foothold p at a^{-k} p.
        row: (J, 6) so that row @ [e hi, e lo, xi] is e h_P(n) - n . xi, P the box from lo to hi.
        program: (., 5) rows of the choice of a foothold, see `foothold`; writable, the solver insists.
        box: reach of a foothold that another one follows.
    """

    normals: np.ndarray
    ahead: np.ndarray
    row: np.ndarray
    program: np.ndarray
    box: Box


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SetTables:
    """Everything that queries need.

    Attributes:
        usable: S - W, where the commanded ZMP may be.
        weights: lam_0, lam_1.
        decay: (K + 1,) a^{-k}.
        normals: (J, 2) those of S and of the axes.
        row: (J, 6), as of a `StanceTable`.
        program: the same, with two rows left zero for what depends on the box of footholds.
        last: (J, K + 1) offsets [m] k ticks before the last landing, seen from a^{-k} lam p.
        outlines: (2, n, K + 1) vertices of these sets, the last one of each repeated to fill.
        boxes: stance side -> reach of the last foothold.
        stances: (stance side, ticks of a step) -> table.
    """

    usable: SupportPolygon
    weights: tuple[float, float]
    decay: np.ndarray
    normals: np.ndarray
    row: np.ndarray
    program: np.ndarray
    last: np.ndarray
    outlines: np.ndarray
    boxes: Mapping[Side, Box]
    stances: Mapping[tuple[Side, int], StanceTable]


def program_rows(sole: np.ndarray, feet: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Rows on (z', p, s): sole z' and feet p bounded, s under what the DCM at landing, less z' + p, leaves of a set."""
    own, reach = len(sole), len(feet)
    rows = np.zeros((own + reach + len(normals) + 1, 5))
    rows[:own, :2], rows[own : own + reach, 2:4] = sole, feet
    rows[own + reach : -1, :2] = rows[own + reach : -1, 2:4] = -normals
    rows[own + reach :, 4] = 1.0
    return rows


def build(model: StepModel) -> SetTables:
    """All tables.

    Raises:
        EmptySetError: no state withstands the error; it carries the largest that would do.
    """
    try:
        return _Builder(model).tables()
    except EmptyPlanarError:
        error = model.error
        fits, fails = 0.0, 1.0
        for _ in range(_HALVINGS):
            share = 0.5 * (fits + fails)
            try:
                _Builder(replace(model, error=error.scaled(share))).tables()
                fits = share
            except EmptyPlanarError:
                fails = share
        largest = error.scaled(fits)
        raise EmptySetError(
            f"stepping on these soles withstands no ZMP error of {1e3 * error.w_bar:.3g} mm, only below "
            f"{1e3 * largest.w_bar:.3g} mm: use a larger gain or a smaller margin to the edges",
            largest,
        ) from None


class _Builder:
    def __init__(self, model: StepModel) -> None:
        pendulum, gain_k, error, sole = model.pendulum, model.gain_k, model.error, model.sole
        self._model, self._limits, self._gain_k, self._error = model, model.limits, gain_k, error
        self._growth = math.exp(pendulum.omega * pendulum.dt)
        self._decay = self._growth ** -np.arange(max(model.step_ticks) + 1.0)
        self._weights = 0.5 - 0.5 / gain_k, 0.5 + 0.5 / gain_k
        # The axes are the normals of W and of the boxes of footholds.
        self._normals = fan(sole.M, AXES)
        outline = sole.vertices
        if error.w_bar > 0.0:
            room = supports(sole.vertices, self._normals) - error.support(self._normals)
            outline = corners(self._normals, room)
        self._usable = SupportPolygon(outline)

    def tables(self) -> SetTables:
        """Run the recursions."""
        self._require_regulator()
        last = self._back(self._normals, self._usable.vertices / self._gain_k, None)
        if self._error.w_bar > 0.0:
            outlines = [corners(self._normals, offsets) for offsets in last]
        else:
            # Sums of multiples of one sole.
            sizes = self._decay / self._gain_k + (1.0 - self._decay)
            outlines = [size * self._usable.vertices for size in sizes]
        limits, most = self._limits, max(map(len, outlines))
        return SetTables(
            usable=self._usable,
            weights=self._weights,
            decay=_sealed(self._decay),
            normals=_sealed(self._normals),
            row=_sealed(_row(self._normals)),
            program=_sealed(program_rows(self._usable.M, np.vstack((AXES, np.zeros((2, 2)))), self._normals)),
            last=_sealed(last.T.copy()),
            outlines=_sealed(
                np.array([o[np.minimum(np.arange(most), len(o) - 1)].T for o in outlines]).transpose(1, 2, 0).copy()
            ),
            boxes={side: box_of(side, limits.max_stride, limits.min_width, limits.max_width) for side in SIDES},
            stances={
                key: table for ticks in self._model.step_ticks for key, table in self._stances(ticks, outlines[ticks])
            },
        )

    def _stances(self, ticks: int, landing: np.ndarray) -> list[tuple[tuple[Side, int], StanceTable]]:
        steps, limits = self._model.max_steps, self._limits
        reach = limits.swing_reach(self._model.pendulum.dt * ticks)
        # Any of these footholds can follow any of them: the foot swings from one stance to the next but one.
        stride, wide = min(limits.max_stride, 0.5 * reach), min(limits.max_width, limits.min_width + reach)
        boxes = {side: box_of(side, stride, limits.min_width, wide) for side in SIDES}
        slants = [tangents_of(flat(box)) for box in boxes.values()]
        normals = fan(self._normals, *slants)
        decay = self._decay[ticks]
        # Sets at the start of a step, of 1, 2, ... steps.
        whole = {side: [decay * union_offsets(boxes[side], self._weights, normals)] for side in SIDES}
        ahead: dict[Side, list[np.ndarray]] = {side: [] for side in SIDES}
        for side in SIDES:
            whole[side][0] += supports(landing, normals)
        for count in range(steps - 1):
            for side in SIDES:
                ahead[side].append(self._back(normals, None, whole[other(side)][count]))
                whole[side].append(decay * box_supports(boxes[side], normals) + ahead[side][count][ticks])
        program = program_rows(self._usable.M, AXES, normals)
        shape = (steps - 1, len(self._decay), len(normals))
        return [
            (
                (side, ticks),
                StanceTable(
                    normals=_sealed(normals),
                    ahead=_sealed(np.array(ahead[side]).reshape(shape).transpose(2, 0, 1).copy()),
                    row=_sealed(_row(normals)),
                    program=program,
                    box=boxes[side],
                ),
            )
            for side in SIDES
        ]

    def _back(self, normals: np.ndarray, target: np.ndarray | None, offsets: np.ndarray | None) -> np.ndarray:
        """Offsets (K + 1, J) of the states that reach a target (its vertices, or its offsets) in k ticks."""
        if offsets is None:
            assert target is not None
            offsets = supports(target, normals)
        decay = self._decay[:, None]
        sole = supports(self._usable.vertices, normals)
        if self._error.w_bar == 0.0:
            return np.asarray(decay * offsets + (1.0 - decay) * sole)
        loss, growth = (self._growth - 1.0) * self._error.support(normals), self._growth
        gain = (growth - 1.0) * sole
        # While no edge is cut off, erosions are plain differences too.
        plain = decay * offsets + (1.0 - decay) * (sole - loss / (growth - 1.0))
        slack = edge_lengths(normals, plain - loss).min()
        wide = (plain - loss + (plain - loss)[:, np.argmin(normals @ normals.T, axis=1)]).min()
        if slack >= -_ROUNDING and wide > 0.0:
            return np.asarray(plain)
        rows = [offsets]
        for _ in range(len(decay) - 1):
            rows.append((tightened(normals, rows[-1] - loss) + gain) / growth)
        return np.array(rows)

    def _require_regulator(self) -> None:
        """Raise EmptyPlanarError unless the regulator keeps to its set in spite of the errors, wherever it ends.

        About a landing on p its set is {mu p + s / k : |mu| <= 1/(2 k), s in S - W}; an error moves the DCM by
        (a - 1) w while the set shrinks by (a - 1)(k - 1) of itself. Its edges face along those of S, which are
        |n . p| / (2 k) farther for p, and across p.
        """
        limits, needed = self._limits, 1.0 / (self._gain_k - 1.0)
        (_, low), (stride, _) = box_of("right", limits.max_stride, limits.min_width, limits.max_width)
        normals = self._normals
        slants = tangents_of(flat(((-stride, low), (stride, limits.max_width))))
        across = fan(normals, slants, -slants)
        across = across[np.abs(across[:, 0]) * stride + 1e-12 >= np.abs(across[:, 1]) * low]
        room = supports(self._usable.vertices, across) / self._gain_k
        farther = np.abs(normals[:, 1]) * low - np.abs(normals[:, 0]) * stride
        own = (supports(self._usable.vertices, normals) + 0.5 * np.maximum(farther, 0.0)) / self._gain_k
        least = min(
            float((room - needed * self._error.support(across)).min()),
            float((own - needed * self._error.support(normals)).min()),
        )
        if least < 0.0:
            raise EmptyPlanarError("the regulator does not withstand the error")


def _row(normals: np.ndarray) -> np.ndarray:
    return np.hstack((np.maximum(normals, 0.0), np.minimum(normals, 0.0), -normals))


def _sealed(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array
