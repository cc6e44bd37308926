"""The states from which a stepping plan exists, cut by a plane: the projection of every plan's variables.

A state is in the set if ZMP knots and footholds exist that keep every knot in its support and end at rest
(`gait.plan_steps`). All of this is one polytope in state, knots and footholds; its cut with a plane of states
is convex, and found corner by corner with linear programs that keep their basis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import highspy
import numpy as np
from numpy.typing import ArrayLike

from controllers.footholds import StepLimits
from controllers.gait_phases import StepPhases, step_phases
from controllers.gait_program import PlanningError, end_modes
from controllers.parametric_outline import outline
from controllers.pendulum import Pendulum
from controllers.support import Foot, Point
from models.arena import Side

# HiGHS' tightest: with coefficients of one it is a distance in metres.
_TOLERANCE = 1e-10
# In shares of the box: a tenth of what a picture a thousand pixels wide can show.
_ACCURACY = 1e-4
# A row whose entries besides one are below this is a bound of one variable.
_ALIGNED = 1e-12


def admissible_slice(
    pendulum: Pendulum,
    feet: Mapping[Side, Foot],
    swing: Sequence[Side],
    step_time: float,
    limits: StepLimits,
    axes: tuple[int, int],
    at: ArrayLike,
    box: tuple[float, float],
    *,
    swing_time_left: float | None = None,
    swing_position: Point | None = None,
    zmp_margin: float = 0.0,
    settle_time: float = 0.6,
    accuracy: float = _ACCURACY,
) -> np.ndarray:
    """Cut of the set {x : plan_steps(x, ...).slack >= zmp_margin} with a plane of states.

    In the last double support, plans and this set keep the ZMP in a Minkowski combination of both feet.

    Args:
        pendulum, feet, swing, step_time, limits: as for `gait.plan_steps`.
        swing_time_left, swing_position, settle_time: likewise.
        axes: the two coordinates of the state that stay free, e.g. (0, 1).
        at: (4,) state that the plane goes through; its entries at `axes` are not used.
        box: (position [m], velocity [m/s]) to draw, on each side of rest over the middle of the feet.
        zmp_margin: margin that a plan must keep [m].
        accuracy: how far the set may reach beyond its outline, in shares of the box.

    Returns:
        (n, 2) vertices of states of the set, counter-clockwise; n = 0 if there is none in the box.

    Raises:
        PlanningError: the arguments do not fit.
    """
    at, (first, second) = np.array(at, dtype=float), axes
    if at.shape != (4,) or not np.isfinite(np.delete(at, [first, second])).all() or first == second:
        raise PlanningError(f"a slice needs two different axes and a finite state (4,), got {axes} at {at.tolist()}")
    if not (np.isfinite(box).all() and min(box) > 0.0 and np.isfinite(zmp_margin) and accuracy > 0.0):
        raise PlanningError(f"a slice needs a positive box and accuracy and a finite margin, got {box}, {accuracy}")
    shape = step_phases(
        pendulum, feet, swing, step_time, limits,
        swing_time_left=swing_time_left, swing_position=swing_position, settle_time=settle_time,
    )  # fmt: skip
    middle = pendulum.rest(0.5 * (feet["left"].position + feet["right"].position))
    scale = np.array([box[i % 2] for i in axes])
    program = _Program(pendulum, shape, axes, at, middle[list(axes)], scale, zmp_margin)
    if not program.feasible():
        return np.empty((0, 2))
    return outline(program.farthest, scale, accuracy)


class _Program:
    """Columns: the free coordinates in shares of the box, two of each knot along edge normals, the footholds."""

    def __init__(
        self,
        pendulum: Pendulum,
        shape: StepPhases,
        axes: tuple[int, int],
        at: np.ndarray,
        middle: np.ndarray,
        scale: np.ndarray,
        margin: float,
    ) -> None:
        modes, decay = end_modes(pendulum, shape.knots)
        count, steps = len(shape.knots), shape.steps
        foot = 2 + 2 * count
        size = foot + 2 * steps
        lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
        lower[:2], upper[:2] = middle / scale - 1.0, middle / scale + 1.0
        # Both modes at the end, of one axis after the other: state + knots + footholds = point of rest.
        ends = np.zeros((4, size))
        right = np.zeros(4)
        rows: list[np.ndarray] = []
        most: list[np.ndarray] = []
        knot = 0
        for phase in shape.phases:
            k = len(phase.ticks)
            own = slice(knot, knot + k)
            base, share = np.broadcast_to(phase.base, (k, 2)), np.broadcast_to(phase.share, (k, steps))
            h = np.broadcast_to(phase.h, (k, len(phase.M))) - margin
            # A knot's coordinates are its offsets along two normals: for a rectangle, all rows become bounds.
            back = np.linalg.inv(phase.M[:2])
            seen = phase.M @ back
            columns = 2 + 2 * np.arange(knot, knot + k)
            for normal, limit in zip(seen, h.T, strict=True):
                along = int(np.abs(normal).argmax())
                if abs(normal[1 - along]) > _ALIGNED:
                    row = np.zeros((k, size))
                    row[np.arange(k)[:, None], columns[:, None] + [0, 1]] = normal
                    rows.append(row)
                    most.append(limit)
                elif normal[along] > 0.0:
                    upper[columns + along] = np.minimum(upper[columns + along], limit / normal[along])
                else:
                    lower[columns + along] = np.maximum(lower[columns + along], limit / normal[along])
            for axis in (0, 1):
                line = slice(2 * axis, 2 * axis + 2)
                for along in (0, 1):
                    ends[line, columns + along] = modes[:, own] * back[axis, along]
                ends[line, foot + axis :: 2] += modes[:, own] @ share
                right[line] -= modes[:, own] @ base[:, axis]
            knot += k
        to_end = np.array([[1.0, 1.0 / pendulum.omega], [decay, -decay / pendulum.omega]])
        whole, rest = np.array([decay, 1.0]), at.copy()
        rest[list(axes)] = 0.0
        for axis in (0, 1):
            line = slice(2 * axis, 2 * axis + 2)
            ends[line, foot + axis :: 2] -= np.outer(whole, shape.end_share)
            right[line] += whole * shape.end_base[axis] - to_end @ rest[line]
            for column, coordinate in enumerate(axes):
                if coordinate // 2 == axis:
                    ends[line, column] = to_end[:, coordinate % 2] * scale[column]
        matrix, low, high = ends, right, right
        if shape.reach is not None:
            reach = np.zeros((len(shape.reach.G), size))
            reach[:, foot:] = shape.reach.G
            matrix = np.vstack([matrix, reach])
            low, high = np.concatenate([low, shape.reach.lower]), np.concatenate([high, shape.reach.upper])
        if rows:
            matrix = np.vstack([matrix, *rows])
            high = np.concatenate([high, *most])
            low = np.concatenate([low, np.full(len(high) - len(low), -np.inf)])
        self._scale = scale
        self._crossed = bool((lower > upper).any())
        self._highs = _model(matrix, low, high, lower, upper)

    def feasible(self) -> bool:
        """Whether any state of the box and plane is in the set."""
        if self._crossed:
            return False
        return self._run() != highspy.HighsModelStatus.kInfeasible

    def farthest(self, direction: np.ndarray) -> np.ndarray:
        """Coordinates (2,) of a state of the set farthest along `direction` (2,)."""
        cost = direction * self._scale
        self._highs.changeColsCost(2, np.array([0, 1], dtype=np.int32), cost / np.abs(cost).max())
        self._run()
        return np.array(self._highs.getSolution().col_value[:2]) * self._scale

    def _run(self) -> highspy.HighsModelStatus:
        self._highs.run()
        status = self._highs.getModelStatus()
        if status not in (highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kInfeasible):
            raise PlanningError(f"HiGHS stopped without an answer: {self._highs.modelStatusToString(status)}")
        return status


def _model(
    matrix: np.ndarray, low: np.ndarray, high: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> highspy.Highs:
    highs = highspy.Highs()
    for option, value in (
        ("output_flag", False),
        ("threads", 1),
        ("presolve", "off"),
        ("solver", "simplex"),
        ("primal_feasibility_tolerance", _TOLERANCE),
        ("dual_feasibility_tolerance", _TOLERANCE),
    ):
        highs.setOptionValue(option, value)
    highs.addVars(len(lower), lower, upper)
    row, column = np.nonzero(matrix)
    starts = np.searchsorted(row, np.arange(len(matrix))).astype(np.int32)
    highs.addRows(len(matrix), low, high, len(row), starts, column.astype(np.int32), matrix[row, column])
    highs.changeObjectiveSense(highspy.ObjSense.kMaximize)
    return highs
