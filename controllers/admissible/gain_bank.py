"""A bank of gains for one stance, switched by their MOA sets (reference 18 of the paper).

Every set is invariant under its own gain. As long as the regulator takes, each sample, a gain whose set contains the
state, the next state is in that set again: the union is never left, however the gains are switched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.gains import Gain, GainError
from controllers.geometry.slack_kernel import first_with, slack_in_any, table_of
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum


class GainBankError(GainError):
    """A bank that cannot be: no gain, two of one name, or no set that is not empty."""


def stiffness(pendulum: Pendulum, gain: Gain) -> float:
    """ZMP displaced [m] by a DCM that is off by 1 m, the larger of the axes; k for a DCM gain."""
    pushed = np.kron(np.eye(2), 0.5 * np.array([[1.0], [pendulum.omega]]))
    return float(np.abs(np.diagonal(-gain.F @ pushed)).max())


def best_dcm_ratio(half_width: float, w_bar: float) -> float:
    """k* = (c - w) / (c - 2 w): the DCM gain whose set is largest under a ZMP error up to w.

    Its set reaches c - 2 w, the most that any law attains: it is where the gain just still withstands the error.

    Args:
        half_width: c, from the centre to the edge [m].
        w_bar: w > 0 [m]; for w = 0 there is no largest, only k above 1.

    Raises:
        GainBankError: 0 < 2 w < c does not hold.
    """
    if not 0.0 < 2.0 * w_bar < half_width:
        raise GainBankError(
            f"a ZMP error of {w_bar:g} m must be above 0 and below half the {half_width:g} m from centre to edge"
        )
    return (half_width - w_bar) / (half_width - 2.0 * w_bar)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GainBank:
    """MOA sets of several gains about one centre, the stiffest gain first; their union is what the bank recovers.

    Attributes:
        sets: one for each gain, in the order of falling `stiffness`.
        left_out: why a gain has no set (empty under the error), by name.
    """

    sets: tuple[MoaSet, ...]
    left_out: dict[str, str] = field(default_factory=dict)
    _tables: np.ndarray = field(init=False, repr=False)
    _rows: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        worlds = [moa.in_world() for moa in self.sets]
        object.__setattr__(self, "_tables", np.concatenate([table_of(world.S, world.a).ravel() for world in worlds]))
        object.__setattr__(self, "_rows", np.array([len(moa.a) for moa in self.sets]))

    @property
    def pendulum(self) -> Pendulum:
        """Model and period."""
        return self.sets[0].pendulum

    @property
    def polygon(self) -> SupportPolygon:
        """Support polygon that all sets share."""
        return self.sets[0].polygon

    @property
    def centre(self) -> np.ndarray:
        """(2,) point u_C that all gains hold [m]."""
        return self.sets[0].centre

    @property
    def x_C(self) -> np.ndarray:
        """(4,) state at rest over the centre."""
        return self.sets[0].x_C

    def __getitem__(self, name: str) -> MoaSet:
        """Set of the gain of this name."""
        for moa in self.sets:
            if moa.gain.name == name:
                return moa
        raise KeyError(name)

    def slack(self, x: ArrayLike) -> float:
        """Largest slack [m of ZMP] of state x (4,) in any of the sets; negative outside the union."""
        return slack_in_any(self._tables, self._rows, np.ascontiguousarray(x, float))

    def stiffest(self, x: ArrayLike, present: Gain | None, more: float) -> MoaSet:
        """The first set that holds state x (4,) with a slack of `more` [m of ZMP], else the last one.

        The set of the present gain, if there is one, need only hold it.
        """
        held = next((k for k, moa in enumerate(self.sets) if moa.gain is present), -1)
        return self.sets[first_with(self._tables, self._rows, np.ascontiguousarray(x, float), held, more)]

    def slacks(self, x: ArrayLike) -> np.ndarray:
        """`slack` of each state of x (..., 4), as (...,)."""
        return np.max([moa.slacks(x) for moa in self.sets], axis=0)

    def contains(self, x: ArrayLike) -> bool:
        """Whether state x (4,) is in the union."""
        return self.slack(x) >= 0.0


def gain_bank(
    pendulum: Pendulum,
    gains: Sequence[Gain],
    polygon: SupportPolygon,
    centre: ArrayLike | None = None,
    bounds: tuple[float, float] | None = None,
    error: ZmpError | None = None,
) -> GainBank:
    """Bank of named gains; arguments as `regulator_set`.

    Raises:
        GainBankError: there is no gain, or two have the same name.
        EmptySetError: no gain withstands the error; it carries the largest that one of them would.
        MoaError: a set cannot be computed for another reason.
    """
    names = [gain.name for gain in gains]
    if not names or len(set(names)) < len(names):
        raise GainBankError(f"a bank needs gains of different names, got {names}")
    sets, left_out, empty = [], {}, []
    for gain in sorted(gains, key=lambda gain: -stiffness(pendulum, gain)):
        try:
            sets.append(regulator_set(pendulum, gain, polygon, centre, bounds, error))
        except EmptySetError as reason:
            left_out[gain.name] = str(reason)
            empty.append(reason)
    if not sets:
        raise max(empty, key=lambda reason: reason.w_bar)
    return GainBank(sets=tuple(sets), left_out=left_out)
