"""Bounded error of the ZMP, and what it takes away from the constraints of an MOA set.

The body realises u + w instead of the commanded ZMP u, with w in a box W. A constraint m (u + w) <= d of
the closed loop x+ = Atilde x + B w then loses, t samples ahead, the most that the errors until then can add up to:

    h_W(m) + sum over j < t of h_W((-m F Atilde^j B)'),    h_W(r) = max over w in W of r w,

a closed-form sum, no linear program (Kolmanovsky and Gilbert 1998).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from controllers.admissible.gilbert_tan import MoaError
from controllers.gains import Gain
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum

# The tail of the infinite sum that is bounded instead of added up, relative to the sum.
_TAIL = 1e-13
# Doublings of the sum: 2^40 samples are a year at 1 ms; a loop that needs more does not converge in practice.
_DOUBLINGS = 40


@dataclass(frozen=True, kw_only=True, slots=True)
class ZmpError:
    """Box W of errors (2,) [m] of the realised ZMP, world frame, symmetric about zero.

    Attributes:
        half_widths: largest error in x and in y [m].

    Raises:
        MoaError: not two finite numbers >= 0.
    """

    half_widths: tuple[float, float]

    def __post_init__(self) -> None:
        x, y = self.half_widths
        if not (math.isfinite(x) and math.isfinite(y) and x >= 0.0 and y >= 0.0):
            raise MoaError(f"a ZMP error needs finite half-widths in metres, not negative, got {self.half_widths!r}")

    @classmethod
    def box(cls, x: float, y: float | None = None) -> Self:
        """|w_x| <= x, |w_y| <= y [m]; y as x if None."""
        return cls(half_widths=(float(x), float(x if y is None else y)))

    @property
    def w_bar(self) -> float:
        """Largest error along an axis [m]."""
        return max(self.half_widths)

    def scaled(self, factor: float) -> Self:
        """The same shape `factor` times as large."""
        x, y = self.half_widths
        return type(self)(half_widths=(factor * x, factor * y))

    def support(self, rows: np.ndarray) -> np.ndarray:
        """h_W (...,) of each row (..., 2): the most that an error adds to row . w."""
        return np.asarray(np.abs(rows) @ np.array(self.half_widths))


class EmptySetError(MoaError):
    """No state withstands a ZMP error as large as this.

    Attributes:
        largest: the error of the same shape at which the set just becomes empty; anything smaller will do.
    """

    def __init__(self, message: str, largest: ZmpError) -> None:
        super().__init__(message)
        self.largest = largest

    @property
    def w_bar(self) -> float:
        """Largest half-width [m] that would still do."""
        return self.largest.w_bar


def taken(stack: np.ndarray, B: np.ndarray, direct: np.ndarray, error: ZmpError) -> np.ndarray:
    """What the error takes from the right sides of the constraints `direct` samples on.

    Args:
        stack: (T, q, n) rows C loop^t.
        B: (n, 2) by which the ZMP drives the state.
        direct: (q, 2) rows by which the ZMP itself appears in the constraint.
        error: W.

    Returns:
        (T, q) [m], not decreasing in t.
    """
    added = error.support(stack[:-1] @ B)
    return np.cumsum(np.concatenate((error.support(direct)[None], added)), axis=0)


def taken_at_last(C: np.ndarray, loop: np.ndarray, B: np.ndarray, direct: np.ndarray, error: ZmpError) -> np.ndarray:
    """Limit (q,) of `taken` for T to infinity [m], from above.

    Raises:
        MoaError: the sum does not converge.
    """
    stack, power = C[None], loop
    for _ in range(_DOUBLINGS):
        stack, power = np.concatenate((stack, stack @ power)), power @ power
        if len(stack) < 64:
            continue
        added = error.support(stack @ B).sum(axis=0)
        # The next T samples add at most ||loop^T|| times the sum of ||C loop^t|| ||B||, and so on.
        decay = float(np.linalg.norm(power, 2))
        bound = np.linalg.norm(stack, axis=2).sum(axis=0) * np.linalg.norm(B, 2) * math.sqrt(2.0) * error.w_bar
        tail = decay / (1.0 - decay) * bound if decay < 1.0 else np.inf * bound
        total = error.support(direct) + added
        if (tail <= _TAIL * total).all():
            return np.asarray(total + tail)
        if len(stack) > 1_000_000:
            break
    raise MoaError("the sum of the ZMP errors does not converge: use a gain that decays faster")


def required_margin(pendulum: Pendulum, gain: Gain, polygon: SupportPolygon, error: ZmpError) -> np.ndarray:
    """Distance (q,) [m] to each edge that a referential ZMP must keep so that tracking it withstands the error.

    It is the amplification of the ZMP error by the loop times the error seen along the edge's normal. A regulator
    set is empty unless its centre keeps this distance too.

    Raises:
        UnstableGainError: the closed loop does not converge.
    """
    gain.require_stable(pendulum)
    return taken_at_last(-polygon.M @ gain.F, gain.closed_loop(pendulum), pendulum.B, polygon.M, error)


def require_room(room: np.ndarray, reach: np.ndarray, error: ZmpError, what: str) -> None:
    """Raise EmptySetError unless the distances `room` (q,) [m] exceed the `reach` (q,) [m] of the error."""
    if (room > reach).all():
        return
    with np.errstate(divide="ignore"):
        factor = float(np.min(room / reach))
    largest = error.scaled(max(factor, 0.0))
    raise EmptySetError(
        f"{what} withstands no ZMP error of {1e3 * error.w_bar:.3g} mm, only below {1e3 * largest.w_bar:.3g} mm: "
        "use a gain that amplifies it less, or keep farther from the edges",
        largest,
    )
