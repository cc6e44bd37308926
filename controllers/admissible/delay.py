"""MOA sets of the regulator (18) when the ZMP follows its command n samples late, by state augmentation.

The state is z = [xbar; ubar_1; ...; ubar_n] with the n commands under way, oldest first:

    xbar+ = A xbar + B ubar_1,   ubar_i+ = ubar_{i+1},   ubar_n+ = -F xbar,   M ubar_1 <= v - M u_C.

With 4 + 2n coordinates there is no hull to compute; linear programs tell when the next sample cuts nothing off.
Where both axes share one gain they are of one axis, 2 + n coordinates (1 + n for a DCM gain), as in `moa`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.constraint_programs import determined
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.moa import outputs, require_inside
from controllers.admissible.robust import ZmpError, require_room, taken, taken_at_last
from controllers.gains import Gain, UnstableGainError
from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class DelayedSet:
    """{z : S z <= a}: states and commands under way from which the late regulator keeps the ZMP inside for ever.

    Attributes:
        pendulum: model and period.
        gain: feedback of (18).
        polygon: support polygon, world frame.
        centre: (2,) point u_C that the regulator holds [m].
        delay: samples n >= 1 between a command and its ZMP.
        error: errors of the ZMP that the set withstands, or None.
        polytope: S (r, 4 + 2n), a (r,) in z, rows in metres of ZMP as in `MoaSet`.
        sample: (r,) ascending.
        edge: (r,).
    """

    pendulum: Pendulum
    gain: Gain
    polygon: SupportPolygon
    centre: np.ndarray
    delay: int
    error: ZmpError | None
    polytope: Polytope
    sample: np.ndarray
    edge: np.ndarray

    @property
    def t_star(self) -> int:
        """Last sample that a row looks at."""
        return int(self.sample[-1])

    @property
    def x_C(self) -> np.ndarray:
        """(4,) state at rest over the centre."""
        return self.pendulum.rest(self.centre)

    def augmented(self, x: ArrayLike, pending: ArrayLike | None = None) -> np.ndarray:
        """z (4 + 2n,) of a state x (4,) and the commands under way (n, 2) [m], oldest first.

        Without `pending`, the robot stood at rest over the centre, and every command under way is that point.
        """
        late = np.zeros((self.delay, 2)) if pending is None else np.asarray(pending, dtype=float) - self.centre
        if late.shape != (self.delay, 2):
            raise MoaError(f"the commands under way must be ({self.delay}, 2), got {late.shape}")
        return np.concatenate((np.asarray(x, dtype=float) - self.x_C, late.ravel()))

    def slack(self, x: ArrayLike, pending: ArrayLike | None = None) -> float:
        """Slack [m of ZMP] of the tightest row; negative outside the set, NaN for NaN."""
        return float(np.min(self.polytope.a - self.polytope.S @ self.augmented(x, pending)))

    def contains(self, x: ArrayLike, pending: ArrayLike | None = None) -> bool:
        """Whether state and commands under way are in the closed set."""
        return self.slack(x, pending) >= 0.0

    def after_rest(self) -> Polytope:
        """Slice of the states x, world frame, when all commands under way are those of rest."""
        S = np.ascontiguousarray(self.polytope.S[:, :4])
        return Polytope(S=S, a=self.polytope.a + S @ self.x_C)


def delayed_loop(pendulum: Pendulum, gain: Gain, delay: int) -> tuple[np.ndarray, np.ndarray]:
    """Closed loop (4 + 2n, 4 + 2n) of z, and (4 + 2n, 2) by which an error of the ZMP drives it."""
    return _augmented(pendulum.A, pendulum.B, -gain.F, delay)


def delayed_set(
    pendulum: Pendulum,
    gain: Gain,
    polygon: SupportPolygon,
    delay: int,
    centre: ArrayLike | None = None,
    error: ZmpError | None = None,
    max_samples: int = 2_000,
) -> DelayedSet:
    """MOA set of the regulator on a constant support polygon when the ZMP comes `delay` samples late.

    Args:
        pendulum: model and period.
        gain: feedback, designed without or with the delay in mind.
        polygon: support polygon, world frame.
        delay: whole number of samples, at least 1 (`regulator_set` is the set without delay).
        centre: (2,) point to hold [m]; the centroid of the polygon if None.
        error: errors of the ZMP to withstand.
        max_samples: where to give up.

    Raises:
        MoaError: the delay is not a whole number >= 1.
        UnstableGainError: the loop does not converge with this delay.
        CentreOutsideError: the centre is not inside the polygon.
        EmptySetError: no state withstands the error; it carries the largest that would do.
        NotDeterminedError: the recursion reached max_samples.
        UnobservableGainError: a gain that differs between the axes has a pole at -omega.
    """
    if delay != int(delay) or delay < 1:
        raise MoaError(f"the delay must be a whole number of samples, at least 1, got {delay!r}")
    delay = int(delay)
    centre = np.array(polygon.centre if centre is None else centre, dtype=float)
    _, d = outputs(pendulum, gain, polygon, centre, None)
    require_inside(polygon, centre, d)
    ratio, (loop, drive) = gain.dcm_ratio(pendulum), delayed_loop(pendulum, gain, delay)
    radius = float(np.abs(np.linalg.eigvals(loop)).max())
    if not radius < 1.0:
        raise UnstableGainError(
            f"gain {gain.name!r} is unstable with a delay of {delay} samples of {pendulum.dt:g} s (spectral radius "
            f"{radius:.4g}): choose a softer gain or a shorter delay"
        )
    C = np.zeros((len(d), len(loop)))
    C[:, 4:6] = polygon.M
    if error is not None:
        require_room(d, taken_at_last(C, loop, drive, polygon.M, error), error, f"the late regulator {gain.name!r}")
    if gain.axis is None:
        lost = None if error is None else partial(taken, B=drive, direct=polygon.M, error=error)
        count, stack = determined(C, d, loop, gain.name, max_samples, lost)
        last = np.full(len(d), count - 1)
    else:
        last, stack = _along_normals(pendulum, gain, ratio, polygon, centre, d, delay, error, max_samples)
    sample, edge = np.nonzero(np.arange(len(stack))[:, None] <= last)
    a = d[edge]
    if error is not None:
        a = a - taken(stack, drive, polygon.M, error)[sample, edge]
    for array in (centre, sample, edge):
        array.setflags(write=False)
    return DelayedSet(
        pendulum=pendulum, gain=gain, polygon=polygon, centre=centre, delay=delay, error=error,
        polytope=Polytope(S=stack[sample, edge], a=a), sample=sample, edge=edge,
    )  # fmt: skip


def _along_normals(
    pendulum: Pendulum,
    gain: Gain,
    ratio: float | None,
    polygon: SupportPolygon,
    centre: np.ndarray,
    d: np.ndarray,
    delay: int,
    error: ZmpError | None,
    max_samples: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Last sample (q,) at which each edge's row can cut, and the rows (T, q, 4 + 2n) up to the last of all."""
    assert gain.axis is not None
    a, b, row = pendulum.A[:2, :2], pendulum.B[:2, :1], -gain.axis[None, :]
    lift = np.eye(2)
    if ratio is not None:
        # The convergent component never reaches the ZMP: one coordinate fewer, and no unbounded direction.
        lift = np.array([[1.0, 1.0 / pendulum.omega]])
        a, b, row = lift @ a @ np.array([[1.0], [0.0]]), lift @ b, np.array([[ratio]])
    loop, drive = _augmented(a, b, row, delay)
    lift = np.block([[lift, np.zeros((len(lift), delay))], [np.zeros((delay, 2)), np.eye(delay)]])
    C = np.zeros((2, len(loop)))
    C[:, len(a)] = 1.0, -1.0
    lower = (polygon.M @ (polygon.vertices - centre).T).min(axis=1)
    off = np.zeros(len(d)) if error is None else error.support(polygon.M)
    cases = list(zip(np.round(lower / d, 12).tolist(), np.round(off / d, 12).tolist(), strict=True))
    column, sides = np.column_stack((drive, np.zeros(len(loop)))), np.array([[1.0, 0.0], [-1.0, 0.0]])
    last, rows = {}, np.empty((0, len(loop)))
    for least, share in set(cases):
        lost = None if error is None else partial(taken, B=column, direct=sides, error=ZmpError.box(share, 0.0))
        count, stack = determined(C, np.array([1.0, -least]), loop, gain.name, max_samples, lost)
        last[least, share] = count - 1
        if count > len(rows):
            rows = stack[:count, 0]
    rows = rows @ lift
    # One axis' [p, pd, u_1, ...] becomes both axes' [x, xd, y, yd, u_1x, u_1y, ...] times the normal.
    state = polygon.M[None, :, :, None] * rows[:, None, None, :2]
    commands = rows[:, None, 2:, None] * polygon.M[None, :, None, :]
    shape = len(rows), len(d), -1
    stack = np.concatenate((state.reshape(shape), commands.reshape(shape)), axis=2)
    return np.array([last[case] for case in cases]), stack


def _augmented(a: np.ndarray, b: np.ndarray, row: np.ndarray, delay: int) -> tuple[np.ndarray, np.ndarray]:
    n, inputs = b.shape
    size = n + inputs * delay
    loop = np.zeros((size, size))
    loop[:n, :n], loop[:n, n : n + inputs] = a, b
    loop[n : size - inputs, n + inputs :] = np.eye(size - n - inputs)
    loop[size - inputs :, :n] = row
    return loop, np.vstack((b, np.zeros((inputs * delay, inputs))))
