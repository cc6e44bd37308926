"""One polytope of all stepping references at once: in (x_0, xi_0, footholds), for a swing sequence and a step time.

A member says: track the reference that starts at xi_0 and steps on these footholds, and the ZMP never leaves the
support. So whether *any* reference catches the robot, which one does best, and where it has to step is one tiny
quadratic program. Supports are those of `gait.plan_steps`: in the last double support a Minkowski combination of
the feet, inside their hull and affine in the footholds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import daqp
import numpy as np
from numpy.typing import ArrayLike

from controllers.gains import Gain
from controllers.gait import StepPlan, true_supports
from controllers.gait_phases import StepPhases
from controllers.linear_program import LinearProgram
from controllers.moa import MoaSet
from controllers.outline import outline
from controllers.parametric_rows import Rows, ZmpLaw
from controllers.parametric_shadow import shadow
from controllers.pendulum import Pendulum
from controllers.polytope import EmptyPolytopeError, Polytope, projection
from controllers.reference import Reference
from controllers.support import Foot
from models.arena import Side
from models.errors import OkiagariError

# Against a metre of slack: so small that it only decides among references that are equally good.
_NEARNESS = 1e-8
_OPTIMAL = 1
_FARTHEST = 1e4
_ACCURACY = 1e-4


class ParametricError(OkiagariError):
    """A parametric set cannot be built or cut as asked."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BestReference:
    """The reference that leaves most slack to a state.

    Attributes:
        slack: of its tracking set [m of ZMP]; negative if no reference catches the state.
        xi_0: (4,) where it starts.
        footholds: (N, 2) [m].
    """

    slack: float
    xi_0: np.ndarray
    footholds: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class ParametricSet:
    """{(x_0, xi_0, p)}: tracking from x_0 the reference of (xi_0, p) keeps the ZMP inside for ever.

    A DCM gain feeds back the divergent component alone, so xi_0 need share only that with the robot: the COG of
    the best reference may then start far from the robot's, to which it converges with e^{-wt}.

    Attributes:
        pendulum: model and period.
        gain: feedback of (27).
        terminal: set of the regulator at the end, relative to the point of rest.
        feet: where the feet stand before the first step.
        swing: feet in the order they step.
        step_time: duration of a step [s].
        margin: what every reference keeps to the edges of its supports [m].
        shape: the supports, affine in the footholds.
        law: the ZMP of the reference, affine in (xi_0, p).
        rows: the rows, irredundant for DCM gains.
    """

    pendulum: Pendulum
    gain: Gain
    terminal: MoaSet
    feet: Mapping[Side, Foot]
    swing: tuple[Side, ...]
    step_time: float
    margin: float
    shape: StepPhases
    law: ZmpLaw
    rows: Rows
    _model: daqp.Model = field(init=False, repr=False)
    _matrix: np.ndarray = field(init=False, repr=False)
    _of_state: np.ndarray = field(init=False, repr=False)
    _a: np.ndarray = field(init=False, repr=False)
    _nominal: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        # Unknowns: s, e_0 with velocities in metres (over omega), and the footholds from where the feet are now.
        nominal = np.array([self.feet[side].position for side in self.swing]).reshape(-1)
        of_error = (self.rows.of_error - self.rows.of_start) * self._unit
        matrix = np.ascontiguousarray(np.column_stack((self.rows.of_slack, of_error, self.rows.of_feet)))
        a = self.rows.a - self.rows.of_margin * self.margin - self.rows.of_feet @ nominal
        size, count = matrix.shape[1], len(a)
        linear = np.zeros(size)
        linear[0] = -1.0
        model = daqp.Model()
        model.settings = {"primal_tol": 1e-9}
        model.setup(
            _NEARNESS * np.eye(size), linear, matrix, a.copy(),
            np.full(count, -np.inf), np.zeros(count, dtype=np.int32),
        )  # fmt: skip
        for name, value in (
            ("_model", model), ("_matrix", matrix), ("_a", a), ("_nominal", nominal),
            ("_of_state", self.rows.of_start.copy()),
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    @property
    def _unit(self) -> np.ndarray:
        return np.array([1.0, self.pendulum.omega, 1.0, self.pendulum.omega])

    def slack(self, x: np.ndarray) -> float:
        """Largest slack [m of ZMP] that any reference leaves to state x (4,) of floats; NaN for NaN."""
        optimum = self._optimum(x)
        return math.nan if optimum is None else float(optimum[0])

    def contains(self, x: np.ndarray) -> bool:
        """Whether some reference catches state x (4,)."""
        return self.slack(x) >= 0.0

    def best(self, x: ArrayLike) -> BestReference:
        """The reference with the largest slack; among equals, the one that starts nearest to x and steps least.

        Raises:
            ParametricError: x is not a state of a robot in sight.
        """
        x = np.array(x, dtype=float)
        optimum = self._optimum(x) if x.shape == (4,) else None
        if optimum is None:
            raise ParametricError(f"a reference is chosen for a finite state (4,) within 10 km, got {x!r}")
        return BestReference(
            slack=float(optimum[0]),
            xi_0=x - optimum[1:5] * self._unit,
            footholds=(self._nominal + optimum[5:]).reshape(-1, 2),
        )

    def _optimum(self, x: np.ndarray) -> np.ndarray | None:
        if not x.dot(x) < _FARTHEST**2:
            return None
        bound = self._a - self._of_state.dot(x)
        self._model.update(bupper=bound)
        optimum, _, flag, _ = self._model.solve()
        if flag == _OPTIMAL:
            return np.asarray(optimum)
        # DAQP gives up on one state in thousands for gains with a thousand rows; the simplex method does not.
        return LinearProgram(self._matrix, bound).maximise(np.eye(self._matrix.shape[1])[0])

    def plan(self, best: BestReference) -> StepPlan:
        """The reference itself, on the true supports.

        Raises:
            ReferenceViolation: xi_0 and the footholds are not those of a reference of this set.
        """
        modes = np.array([[1.0, 1.0 / self.pendulum.omega], [1.0, -1.0 / self.pendulum.omega]])
        start = modes @ np.asarray(best.xi_0).reshape(2, 2).T
        zmp = self.law.constant + self.law.by_state @ start + self.law.by_foothold @ best.footholds
        mu = np.repeat(zmp, self.shape.knots, axis=0)
        footholds = tuple(self.feet[side].moved(p) for side, p in zip(self.swing, best.footholds, strict=True))
        supports = true_supports(self.shape, self.feet, self.swing, footholds)
        reference = Reference(
            pendulum=self.pendulum,
            xi=self.pendulum.rollout(best.xi_0, mu),
            mu=mu,
            supports=supports,
            support_of=np.repeat(np.arange(len(supports)), [*self.shape.ticks, self.shape.settle]),
            final=supports[-1],
        )
        return StepPlan(
            reference=reference,
            slack=float(reference.margins().min()),
            footholds=footholds,
            swing=self.swing,
            landings=tuple(int(k) for k in np.cumsum(self.shape.ticks)),
            step_time=self.step_time,
        )

    def lifted(self) -> Polytope:
        """The set with slack s >= 0, in (x_0, xi_0, p, s)."""
        rows = self.rows
        S = np.column_stack((rows.of_error, rows.of_start - rows.of_error, rows.of_feet, rows.of_slack))
        return Polytope(
            S=np.vstack((S, -np.eye(S.shape[1])[-1:])), a=np.append(rows.a - rows.of_margin * self.margin, 0.0)
        )

    @cached_property
    def explicit(self) -> Polytope:
        """The states {x_0 : slack >= 0} by plain rows (r, 4), for a million states a second and more.

        As far as it is not negative, the slack of these rows is that of the set [m of ZMP].

        Raises:
            ParametricError: a gain is not a DCM gain; the set then has four dimensions and thousands of facets.
            EmptyPolytopeError: no state has slack.
        """
        if self.gain.dcm_ratio(self.pendulum) is None or self.terminal.gain.dcm_ratio(self.pendulum) is None:
            raise ParametricError(
                f"only with DCM gains is the set a few plain rows, not with {self.gain.name!r} and "
                f"{self.terminal.gain.name!r}: ask slack() for states and slice_polygon() for pictures"
            )
        return shadow(self.lifted(), np.kron(np.eye(2), [[1.0, 1.0 / self.pendulum.omega]]))

    def slice_polygon(
        self, axes: tuple[int, int], at: ArrayLike, box: tuple[float, float], accuracy: float = _ACCURACY
    ) -> np.ndarray:
        """Vertices (n, 2), counter-clockwise, of the cut of {x_0 : slack >= 0} with a plane; n = 0 if it is empty.

        Args:
            axes: the two coordinates of the state that stay free.
            at: (4,) state that the plane goes through; its entries at `axes` are not used.
            box: (position [m], velocity [m/s]) to draw, on each side of rest over the middle of the feet.
            accuracy: how far the set may reach beyond its outline, in shares of the box.

        Raises:
            ParametricError: the axes, the state or the box are not such.
        """
        at, free = np.array(at, dtype=float), list(axes)
        fixed = [i for i in range(4) if i not in free]
        if at.shape != (4,) or len(fixed) != 2 or not np.isfinite(at[fixed]).all():
            raise ParametricError(f"a slice needs two different axes and a finite state (4,), got {axes}, {at!r}")
        if not (np.isfinite(box).all() and min(box) > 0.0 and accuracy > 0.0):
            raise ParametricError(f"a slice needs a positive box and accuracy, got {box!r}, {accuracy!r}")
        middle = self.pendulum.rest(0.5 * (self.feet["left"].position + self.feet["right"].position))[free]
        scale = np.array([box[i % 2] for i in free])
        lifted = self.lifted()
        # Columns: the free coordinates in shares of the box, xi_0 in metres, p, s.
        S = np.column_stack((lifted.S[:, free] * scale, lifted.S[:, 4:8] * self._unit, lifted.S[:, 8:]))
        sides = np.zeros((4, S.shape[1]))
        sides[:2, :2], sides[2:, :2] = np.eye(2), -np.eye(2)
        limits = np.concatenate((middle / scale + 1.0, 1.0 - middle / scale))
        a = np.concatenate((lifted.a - lifted.S[:, fixed] @ at[fixed], limits))
        cut = projection(np.vstack((S, sides)), a, (0, 1))
        try:
            return outline(cut, accuracy=accuracy) * scale
        except EmptyPolytopeError:
            return np.empty((0, 2))
