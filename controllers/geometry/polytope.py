"""Half-space sets {x : S x <= a}: membership, pruning, slices, projections, areas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from controllers.geometry.linear_program import (
    InfeasibleProgramError,
    LinearProgram,
    UnboundedProgramError,
    chebyshev_centre,
)
from controllers.geometry.outline import outline
from controllers.geometry.slack_kernel import least_slacks
from models.errors import OkiagariError

# A set thinner than this [m] has no inside that double precision can work with.
_FLAT = 1e-10
# A row counts as redundant when it cuts less than this off (relative to its right side), far below a rounding
# of the state estimate and above the tolerance of the solvers.
_REDUNDANT = 1e-9

MANY = 2_000
"""Rows of a set whose shadow is not found to the last corner: each costs milliseconds, and there are thousands."""


class PolytopeError(OkiagariError):
    """A half-space set is malformed, or has no answer to the question asked."""


class EmptyPolytopeError(PolytopeError):
    """The set has no inside."""


class UnboundedPolytopeError(PolytopeError):
    """The set reaches infinity where a bounded one is needed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Polytope:
    """Convex set {x : S x <= a}, possibly unbounded.

    Attributes:
        S: (r, n) rows, kept unnormalised: the slack has the unit of a.
        a: (r,) right sides; +inf is a row that never binds.

    Raises:
        PolytopeError: shapes do not fit, or an entry is NaN.
    """

    S: np.ndarray
    a: np.ndarray

    def __post_init__(self) -> None:
        # Not copied when nothing has to be converted: sets of 10 000 rows are built online.
        S, a = np.asarray(self.S, dtype=float), np.asarray(self.a, dtype=float)
        if S.ndim != 2 or a.shape != (len(S),):
            raise PolytopeError(f"S must be (r, n) and a (r,), got {S.shape} and {a.shape}")
        if not np.isfinite(S).all() or np.isnan(a).any():
            raise PolytopeError("S must be finite and a free of NaN")
        for name, value in (("S", S), ("a", a)):
            value = value.view()
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Polytope:
        """{x : lower <= x <= upper}, with lower and upper (n,)."""
        lower, upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        eye = np.eye(len(lower))
        return cls(S=np.vstack((eye, -eye)), a=np.concatenate((upper, -lower)))

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.S.shape[1])

    def slack(self, x: ArrayLike) -> np.ndarray:
        """min(a - S x) of each point of x (..., n), as (...,): negative outside, in the unit of a."""
        x = np.asarray(x, dtype=float)
        points = np.ascontiguousarray(x.reshape(-1, self.n))
        out = np.empty(len(points))
        least_slacks(np.ascontiguousarray(self.S), np.ascontiguousarray(self.a), points, out)
        return out.reshape(x.shape[:-1])

    def contains(self, x: ArrayLike) -> np.ndarray:
        """Whether each point of x (..., n) is in the closed set, as (...,) of bool; False for NaN."""
        return self.slack(x) >= 0.0

    def intersect(self, other: Polytope) -> Polytope:
        """The points in both sets."""
        return Polytope(S=np.vstack((self.S, other.S)), a=np.concatenate((self.a, other.a)))

    def bounded(self) -> bool:
        """Whether the set is bounded (an empty one is)."""
        program = LinearProgram(self.S, self.a)
        try:
            for direction in np.vstack((np.eye(self.n), -np.eye(self.n))):
                program.maximise(direction)
        except UnboundedProgramError:
            return False
        except InfeasibleProgramError:
            return True
        return True

    def irredundant(self) -> np.ndarray:
        """Ascending indices of rows that alone describe the set.

        By the hull of the dual points where the set is bounded (milliseconds for hundreds of rows in 4-D),
        row by row with linear programs where it is not.

        Raises:
            EmptyPolytopeError: the set has no inside.
        """
        rows = np.flatnonzero(np.isfinite(self.a))
        S, a = self.S[rows], self.a[rows]
        a = a - S @ _inside(S, a)
        try:
            hull = ConvexHull(S / a[:, None])
        except (QhullError, ValueError):
            return rows[_irredundant_by_programs(S, a)]
        # The origin outside the dual hull or on its surface: the set is unbounded, and the hull not its dual.
        if hull.equations[:, -1].max() > -1e-12:
            return rows[_irredundant_by_programs(S, a)]
        return rows[np.sort(hull.vertices)]

    def slice(self, axes: Sequence[int], at: ArrayLike) -> Polytope:
        """The cut {y : x in the set, x[axes] = y, the other coordinates as in `at`}.

        Args:
            axes: coordinates that stay free, in the order of the result.
            at: (n,) point the cut goes through; its entries at `axes` are not used.
        """
        free = list(axes)
        fixed = [i for i in range(self.n) if i not in free]
        at = np.asarray(at, dtype=float)
        return Polytope(S=self.S[:, free], a=self.a - self.S[:, fixed] @ at[fixed])

    def vertices(self) -> np.ndarray:
        """Vertices (p, n) of a bounded set; counter-clockwise in the plane.

        Raises:
            EmptyPolytopeError: the set has no inside.
            UnboundedPolytopeError: the set is unbounded (cut it with `intersect(Polytope.box(...))`).
        """
        rows = np.isfinite(self.a)
        S, a = self.S[rows], self.a[rows]
        inside = _inside(S, a)
        if not self.bounded():
            raise UnboundedPolytopeError("an unbounded set has rays: intersect it with a Polytope.box first")
        corners = HalfspaceIntersection(np.column_stack((S, -a)), inside).intersections
        return np.asarray(corners[ConvexHull(corners).vertices])

    def project(self, axes: tuple[int, int]) -> np.ndarray:
        """Vertices (p, 2), counter-clockwise, of the shadow of the set on the plane of two coordinates.

        Where no row ties these coordinates to the others, their rows alone describe it. Else by its support function:
        unlike the hull of the vertices, whose number is the product over the axes, this stays cheap in 4-D. Of more
        rows than `MANY` the outline is found within a ten-thousandth of its size, and inside of it.

        Raises:
            EmptyPolytopeError: the set is empty.
            UnboundedPolytopeError: the shadow is unbounded.
        """
        others = [i for i in range(self.n) if i not in axes]
        own, rest = self.S[:, list(axes)].any(axis=1), self.S[:, others].any(axis=1)
        if not (own & rest).any() and (self.a[~own] >= 0.0).all():
            return Polytope(S=self.S[own][:, list(axes)], a=self.a[own]).vertices()
        farthest, accuracy = projection(self.S, self.a, axes), 0.0
        if len(self.a) > MANY:
            accuracy = 1e-4 * min(float((farthest(way) - farthest(-way)) @ way) for way in np.eye(2))
        return outline(farthest, accuracy)

    @property
    def area(self) -> float:
        """Area of a bounded set of the plane."""
        if self.n != 2:
            raise PolytopeError(f"area is of a set of the plane, this one has {self.n} dimensions: slice or project it")
        return polygon_area(self.vertices())


def projection(S: np.ndarray, a: np.ndarray, keep: Sequence[int]) -> Callable[[np.ndarray], np.ndarray]:
    """Support function of the shadow of {x : S x <= a} on some coordinates.

    Args:
        S: (r, n) rows.
        a: (r,) right sides.
        keep: the d coordinates, in the order of the shadow's.

    Returns:
        gives a point (d,) of the shadow farthest along a direction (d,); raises `EmptyPolytopeError` if there is
        no point at all, and `UnboundedPolytopeError` if there is no farthest one.
    """
    program, kept = LinearProgram(S, a), list(keep)
    cost = np.zeros(S.shape[1])

    def farthest(direction: np.ndarray) -> np.ndarray:
        cost[kept] = direction
        try:
            return program.maximise(cost)[kept]
        except UnboundedProgramError:
            raise UnboundedPolytopeError("the projection is unbounded: intersect the set with a box") from None
        except InfeasibleProgramError:
            raise EmptyPolytopeError("the projection of an empty set") from None

    return farthest


def polygon_area(vertices: np.ndarray) -> float:
    """Area enclosed by vertices (p, 2) in counter-clockwise order."""
    x, y = (vertices - vertices[:1]).T if len(vertices) else np.zeros((2, 0))
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _inside(S: np.ndarray, a: np.ndarray) -> np.ndarray:
    """A point (n,) off every face; the origin where it is one, for it costs nothing."""
    if len(a) and (a > _FLAT * np.linalg.norm(S, axis=1)).all():
        return np.zeros(S.shape[1])
    try:
        centre, radius = chebyshev_centre(S, a)
    except InfeasibleProgramError:
        raise EmptyPolytopeError("the set is empty") from None
    if radius <= _FLAT:
        raise EmptyPolytopeError(f"the set is flat: no ball larger than {radius:.1g} fits in it")
    return centre


def _irredundant_by_programs(S: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Rows of {S x <= a} (0 inside, a > 0) that cut something off the rows kept so far and those to come."""
    program = LinearProgram(S, a)
    kept = []
    for row in range(len(S)):
        program.drop(row)
        try:
            cuts = bool(S[row] @ program.maximise(S[row]) > a[row] * (1.0 + _REDUNDANT))
        except UnboundedProgramError:
            cuts = True
        if cuts:
            kept.append(row)
            program.restore(row)
    return np.array(kept, dtype=np.intp)
