"""Every question of an episode to a controller at joint level: what it was given, and what it answered."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.interface import BalanceController, JointController
from controllers.shown import ObservationTerm, ShowsObservation
from models.errors import InputError
from sim.episode.episode import Episode

Array = NDArray[np.float64]


class Questions:
    """The questions to one controller, filled tick by tick.

    Attributes:
        terms: of its input; None if it shows none.
    """

    def __init__(self, controller: BalanceController | JointController, who: str, dt: float) -> None:
        """Prepare.

        Args:
            controller: that is asked.
            who: what to call it in messages.
            dt: control period [s].

        Raises:
            InputError: if what it shows does not fit together.
        """
        self._who = f"controller {who!r}"
        self._shows = controller if isinstance(controller, ShowsObservation) else None
        self._every = max(1, round(getattr(controller, "period", dt) / dt))
        self._inputs: list[Array] = []
        self._actions: list[Array] = []
        self.terms: tuple[ObservationTerm, ...] | None = None
        if self._shows is not None:
            self.terms = tuple(self._shows.observation_terms)
            self._check(self.terms)

    def _check(self, terms: tuple[Any, ...]) -> None:
        for term in terms:
            if not isinstance(term, ObservationTerm):
                raise InputError(f"{self._who}: observation_terms must be a tuple of ObservationTerm")
            if len(term.places) != len(term.components):
                sizes = f"{len(term.places)} places and {len(term.components)} components"
                raise InputError(f"{self._who}: observation_terms: {term.name!r} has {sizes}; it must have as many")

    def see(self, episode: Episode) -> None:
        """Note the question of a tick, if it was one."""
        if self._shows is None or (episode.ticks - 1) % self._every:
            return
        size = sum(len(term.places) for term in self.terms or ())
        self._inputs.append(self._numbers("last_input", self._shows.last_input, size))
        action = len(self._actions[0]) if self._actions else None
        self._actions.append(self._numbers("last_action", self._shows.last_action, action))

    def _numbers(self, field: str, value: Any, size: int | None) -> Array:
        shape = getattr(value, "shape", None)
        if not isinstance(value, np.ndarray) or value.ndim != 1 or size not in (None, len(value)):
            given = f"has shape {shape}" if shape is not None else f"is of the type {type(value).__name__}"
            wanted = "one dimension" if size is None else f"shape ({size},)"
            raise InputError(f"{self._who}: {field} {given}; it must be an array of {wanted}")
        return np.array(value, dtype=np.float64)

    @property
    def inputs(self) -> Array:
        """(k, n) what the network was given."""
        return np.array(self._inputs)

    @property
    def actions(self) -> Array:
        """(k, a) what it answered."""
        return np.array(self._actions)
