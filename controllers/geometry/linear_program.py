"""Linear functions maximised over {x : S x <= a}, by one HiGHS model that keeps its basis."""

from __future__ import annotations

import highspy
import numpy as np

from models.errors import OkiagariError

_Status = highspy.HighsModelStatus
_ANSWERS = (_Status.kOptimal, _Status.kUnbounded, _Status.kUnboundedOrInfeasible, _Status.kInfeasible)
# From nothing; by the primal simplex method; from a scaled problem; by an interior point and a crossover.
_OTHER_WAYS = (("solver", "simplex"), ("simplex_strategy", 4), ("simplex_scale_strategy", 4), ("solver", "ipm"))
# HiGHS' tightest; rows are normalised, so this is a distance in the space of x.
_TOLERANCE = 1e-10


class LinearProgramError(OkiagariError):
    """A linear program has no finite answer, or the solver failed."""


class UnboundedProgramError(LinearProgramError):
    """The set reaches infinity in the direction asked for."""


class InfeasibleProgramError(LinearProgramError):
    """The set is empty."""


class LinearProgram:
    """Support function of the polyhedron {x : S x <= a}.

    Consecutive questions start from the last basis, several times faster than from nothing.

    Args:
        S: (r, n) rows.
        a: (r,) right sides; infinite ones never bind.
    """

    def __init__(self, S: np.ndarray, a: np.ndarray) -> None:
        self._n = S.shape[1]
        self._columns = np.arange(self._n, dtype=np.int32)
        self._a = np.empty(0)
        self._highs = highspy.Highs()
        for option, value in (
            ("output_flag", False),
            ("threads", 1),
            ("presolve", "off"),
            ("solver", "simplex"),
            ("primal_feasibility_tolerance", _TOLERANCE),
            ("dual_feasibility_tolerance", _TOLERANCE),
        ):
            self._highs.setOptionValue(option, value)
        free = np.full(self._n, highspy.kHighsInf)
        self._highs.addVars(self._n, -free, free)
        self._highs.changeObjectiveSense(highspy.ObjSense.kMaximize)
        self.add(S, a)

    def add(self, S: np.ndarray, a: np.ndarray) -> None:
        """Append rows S (r, n), a (r,)."""
        rows = len(S)
        length = np.linalg.norm(S, axis=1)
        # A zero row stays as it is; scaling the others keeps late, small rows above HiGHS' cut-off of 1e-9.
        length[length == 0.0] = 1.0
        a = a / length
        self._a = np.concatenate((self._a, a))
        self._highs.addRows(
            rows,
            np.full(rows, -highspy.kHighsInf),
            a,
            rows * self._n,
            np.arange(rows, dtype=np.int32) * self._n,
            np.tile(self._columns, rows),
            np.ascontiguousarray(S / length[:, None]).ravel(),
        )

    def drop(self, row: int) -> None:
        """Let `row` no longer bind."""
        self._highs.changeRowBounds(row, -highspy.kHighsInf, highspy.kHighsInf)

    def restore(self, row: int) -> None:
        """Let a dropped `row` bind again."""
        self._highs.changeRowBounds(row, -highspy.kHighsInf, self._a[row])

    def maximise(self, direction: np.ndarray) -> np.ndarray:
        """A point (n,) of the set farthest in `direction` (n,).

        Raises:
            UnboundedProgramError: there is no farthest point.
            InfeasibleProgramError: the set is empty.
            LinearProgramError: HiGHS gave up.
        """
        scale = float(np.abs(direction).max()) or 1.0
        self._highs.changeColsCost(self._n, self._columns, np.asarray(direction, dtype=float) / scale)
        status = self._run()
        if status == _Status.kOptimal:
            return np.array(self._highs.getSolution().col_value)
        if status in (_Status.kUnbounded, _Status.kUnboundedOrInfeasible):
            # Without presolve the simplex method says "unbounded" only from a feasible point.
            raise UnboundedProgramError("the set is unbounded in the direction asked for")
        if status == _Status.kInfeasible:
            raise InfeasibleProgramError("the set is empty")
        raise LinearProgramError(f"HiGHS stopped without an answer: {self._highs.modelStatusToString(status)}")

    def _run(self) -> highspy.HighsModelStatus:
        """Solve; what the last basis leads to no answer from is tried from nothing, and then in other ways."""
        self._highs.run()
        status = self._highs.getModelStatus()
        for option, value in _OTHER_WAYS:
            if status in _ANSWERS:
                break
            before = self._highs.getOptionValue(option)[1]
            self._highs.clearSolver()
            self._highs.setOptionValue(option, value)
            self._highs.run()
            status = self._highs.getModelStatus()
            self._highs.setOptionValue(option, before)
        return status


def chebyshev_centre(S: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (n,) and radius (at most 1) of a largest ball in {x : S x <= a}.

    Raises:
        InfeasibleProgramError: the set is empty.
    """
    n = S.shape[1]
    radius_axis = np.eye(n + 1)[-1:]
    rows = np.vstack((np.column_stack((S, np.linalg.norm(S, axis=1))), radius_axis, -radius_axis))
    program = LinearProgram(rows, np.concatenate((a, [1.0, 0.0])))
    point = program.maximise(radius_axis[0])
    return point[:-1], float(point[-1])
