"""What a controller at joint level may show of what it is given and what it answers, for `okiagari policy`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservationTerm:
    """A part of what a network is given.

    Attributes:
        name: of the term.
        components: (m) what each of its numbers is, in words.
        places: (m,) where in the network's input each of them stands.
        clip: least and greatest value that the network is given; None without limits.
    """

    name: str
    components: tuple[str, ...]
    places: NDArray[np.intp]
    clip: tuple[float, float] | None = None


@runtime_checkable
class ShowsObservation(Protocol):
    """A controller at joint level that shows what it is given.

    Attributes:
        observation_terms: the parts of its input, which leave nothing of it out.
        last_input: (n,) what the network was given at the last question, in its units.
        last_action: (a,) what it answered, as the next question shows it.
    """

    observation_terms: tuple[ObservationTerm, ...]
    last_input: Array
    last_action: Array
