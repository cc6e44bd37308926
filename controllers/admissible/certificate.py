"""What an MOA set promises, checked by linear programs that share nothing with the way it was computed.

Inner-ness: every state of the set keeps all constraints of this sample, M u <= v. Invariance: the closed loop leads
from the set into the set (of the next phase), whatever the error of the ZMP that it withstands. Both together, by
induction, are membership for ever; the worst row of each is reported in metres of ZMP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from controllers.admissible.moa import MoaSet, direct_rows, outputs
from controllers.admissible.tracking_sets import TrackingSets
from controllers.geometry.linear_program import InfeasibleProgramError, LinearProgram, UnboundedProgramError
from controllers.geometry.polytope import EmptyPolytopeError, Polytope, UnboundedPolytopeError, polygon_area

# Rows this alike [m of ZMP a m] are one row: no linear program is needed to see that one follows from the other.
_SAME = 1e-12
# Violations below this [m] are rounding: the solver's tolerance of 1e-10 on rows whose length is up to about 10.
TOLERANCE = 1e-8
_PLANES = {"x-xd": (0, 1), "y-yd": (2, 3), "x-y": (0, 2)}


@dataclass(frozen=True, kw_only=True, slots=True)
class PlaneArea:
    """Size of a set in a plane of the state space: m^2/s for a position and its velocity, m^2 for two positions.

    Attributes:
        plane: "x-xd", "y-yd" or "x-y".
        phase: of the tracking set; None for a regulator's.
        slice: area of the cut at rest over the centre, or at the referential state; inf if unbounded.
        projection: area of the shadow; inf if unbounded.
    """

    plane: str
    phase: int | None
    slice: float
    projection: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Certificate:
    """Facts about a set, and how far the worst row is from what it promises.

    Attributes:
        subject: what was certified.
        t_star: last sample that a row looks at, counted from the phase that looks farthest.
        dt: period [s].
        rows: number of rows of all phases.
        phases: number of sets.
        bounded: whether all of them are.
        w_bar: largest ZMP error [m] withstood; 0 if none was asked for.
        invariance: largest violation [m] of "x in the set implies its successor in the (next) set".
        inner: largest violation [m] of "x in the set implies the ZMP in the support polygon now".
        programs: linear programs solved; the other rows were there literally.
        areas: of the planes asked for.
    """

    subject: str
    t_star: int
    dt: float
    rows: int
    phases: int
    bounded: bool
    w_bar: float
    invariance: float
    inner: float
    programs: int
    areas: tuple[PlaneArea, ...]

    @property
    def holds(self) -> bool:
        """Whether both violations are rounding."""
        return max(self.invariance, self.inner) <= TOLERANCE

    def render(self) -> str:
        """The certificate as lines of plain text."""
        sets = f"{self.phases} sets, " if self.phases > 1 else ""
        lines = [
            f"{self.subject}: {'certified' if self.holds else 'NOT CERTIFIED'}",
            f"  t* = {self.t_star} samples ({self.t_star * self.dt:.3g} s), {sets}{self.rows} rows, "
            f"{'bounded' if self.bounded else 'unbounded'}",
            f"  invariance: worst row {1e3 * self.invariance:+.1e} mm, ZMP inside now: {1e3 * self.inner:+.1e} mm "
            f"({self.programs} linear programs)",
        ]
        if self.w_bar:
            lines.append(f"  withstands a ZMP error up to {1e3 * self.w_bar:.3g} mm")
        for area in self.areas:
            where = "" if area.phase is None else f", phase {area.phase}"
            unit = "m^2" if area.plane == "x-y" else "m^2/s"
            lines.append(
                f"  {area.plane}{where}: slice {area.slice:.4g} {unit}, projection {area.projection:.4g} {unit}"
            )
        return "\n".join(lines)


def certify(
    of: MoaSet | TrackingSets,
    planes: tuple[str, ...] = ("x-xd", "y-yd"),
    phases: tuple[int, ...] | None = None,
) -> Certificate:
    """Check a set (of tracking sets: all phases) and measure it.

    Args:
        of: regulator set or tracking sets.
        planes: of areas, out of "x-xd", "y-yd", "x-y".
        phases: of tracking sets whose areas are wanted; first, middle and last if None.
    """
    if isinstance(of, MoaSet):
        return _of_regulator(of, planes)
    return _of_tracking(of, planes, (0, of.m // 2, of.m) if phases is None else phases)


def _of_regulator(moa: MoaSet, planes: tuple[str, ...]) -> Certificate:
    C, d = outputs(moa.pendulum, moa.gain, moa.polygon, moa.centre, moa.bounds)
    now, after = d, moa.a
    if moa.error is not None:
        now = d - moa.error.support(direct_rows(moa.polygon, len(d)))
        after = moa.a - moa.error.support(moa.S @ moa.pendulum.B)
    own = moa.S, moa.a
    inner, asked = _implied(own, C, now)
    invariance, more = _implied(own, moa.S @ moa.gain.closed_loop(moa.pendulum), after)
    return Certificate(
        subject=f"regulator set, {moa.gain.name}",
        t_star=moa.t_star,
        dt=moa.pendulum.dt,
        rows=len(moa.a),
        phases=1,
        bounded=moa.polytope.bounded(),
        w_bar=0.0 if moa.error is None else moa.error.w_bar,
        invariance=invariance,
        inner=inner,
        programs=asked + more,
        areas=tuple(plane_area(moa.polytope, np.zeros(4), plane) for plane in planes),
    )


def _of_tracking(sets: TrackingSets, planes: tuple[str, ...], phases: tuple[int, ...]) -> Certificate:
    ref, error = sets.reference, sets.error
    loop, B = sets.gain.closed_loop(sets.pendulum), sets.pendulum.B
    terminal = _of_regulator(sets.terminal, ())
    invariance, inner, programs = terminal.invariance, terminal.inner, terminal.programs
    following = _error_set(sets, sets.m)
    # The last set must be the terminal one, in error coordinates of the end of the reference.
    at_end = sets.terminal.a - sets.terminal.S @ (ref.xi[-1] - sets.terminal.x_C)
    violation, solved = _implied(following, sets.terminal.S, at_end)
    invariance, programs = max(invariance, violation), programs + solved
    for k in range(sets.m - 1, -1, -1):
        here, polygon = _error_set(sets, k), ref.support(k)
        now, after = polygon.v - polygon.M @ ref.mu[k], following[1]
        if error is not None:
            now, after = now - error.support(polygon.M), after - error.support(following[0] @ B)
        violation, solved = _implied(here, -polygon.M @ sets.gain.F, now)
        inner, programs = max(inner, violation), programs + solved
        violation, solved = _implied(here, following[0] @ loop, after)
        invariance, programs = max(invariance, violation), programs + solved
        following = here
    spans = np.diff(sets.start)
    ahead = sets.sample - np.repeat(np.arange(sets.m + 1), spans)
    return Certificate(
        subject=f"tracking sets, {sets.gain.name}",
        t_star=int(ahead[np.isfinite(sets.a)].max()),
        dt=sets.pendulum.dt,
        rows=len(sets.a),
        phases=sets.m + 1,
        bounded=all(sets.polytope(k).bounded() for k in {0, sets.m}),
        w_bar=0.0 if error is None else error.w_bar,
        invariance=invariance,
        inner=inner,
        programs=programs,
        areas=tuple(plane_area(sets.polytope(k), ref.xi[k], plane, k) for k in phases for plane in planes),
    )


def plane_area(of: Polytope, at: np.ndarray, plane: str, phase: int | None = None) -> PlaneArea:
    """Area of a set of states in a plane, as the slice through the state `at` (4,) and as projection.

    Raises:
        KeyError: the plane is none of "x-xd", "y-yd", "x-y".
    """
    axes = _PLANES[plane]
    try:
        cut = of.slice(axes, at).area
    except UnboundedPolytopeError:
        cut = np.inf
    except EmptyPolytopeError:
        cut = 0.0
    try:
        shadow = polygon_area(of.project(axes))
    except UnboundedPolytopeError:
        shadow = np.inf
    except EmptyPolytopeError:
        shadow = 0.0
    return PlaneArea(plane=plane, phase=phase, slice=cut, projection=shadow)


def _error_set(sets: TrackingSets, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Finite rows of phase k in e = x - xi_k."""
    polytope = sets.polytope(k)
    finite = np.isfinite(polytope.a)
    S = polytope.S[finite]
    return S, polytope.a[finite] - S @ sets.reference.xi[k]


def _implied(of: tuple[np.ndarray, np.ndarray], S: np.ndarray, a: np.ndarray) -> tuple[float, int]:
    """Largest max of S x - a over the set `of`, and how many linear programs it took."""
    own, limits = of
    near = cKDTree(own).query_ball_point(S, _SAME, p=np.inf)
    literal = np.array([min(limits[rows], default=np.inf) for rows in near]) - a
    missing = ~(literal <= TOLERANCE / 2)
    worst = float(literal[~missing].max(initial=-np.inf))
    if missing.any():
        worst = max(worst, _worst(LinearProgram(own, limits), S[missing], a[missing]))
    return worst, int(missing.sum())


def _worst(program: LinearProgram, S: np.ndarray, a: np.ndarray) -> float:
    """Largest max of S x - a over the set of the program; inf where it has no bound, -inf if the set is empty."""
    worst = -np.inf
    for row, right in zip(S, a, strict=True):
        try:
            worst = max(worst, float(row @ program.maximise(row) - right))
        except UnboundedProgramError:
            return np.inf
        except InfeasibleProgramError:
            return -np.inf
    return worst
