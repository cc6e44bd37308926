"""The recursion of Gilbert and Tan (1991): which constraints of which samples describe an MOA set.

It adds the constraints of one more sample until they cut nothing off. Here whole blocks of samples are added,
and the last one that cuts is read off the convex hull of the dual points S_i / a_i.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from controllers.gains import UnobservableGainError
from models.errors import OkiagariError

MOST_ROWS = 8_192
"""Constraints in more than two coordinates that are looked through at once; their hull takes ten seconds."""
# Samples of the first attempt; doubled until the last ones cut nothing off.
_FIRST_BLOCK = 32


class MoaError(OkiagariError):
    """An MOA set cannot be computed from what was given."""


class NotDeterminedError(MoaError):
    """The recursion did not end within the samples allowed."""


def cutting(
    C: np.ndarray,
    d: np.ndarray,
    loop: np.ndarray,
    name: str,
    max_samples: int,
    taken: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Constraints C loop^i x <= d, i = 0, 1, ..., that cut something off {x : all of them hold}.

    Args:
        C: (q, n) outputs.
        d: (q,) limits, positive.
        loop: (n, n), its powers converging.
        name: of the gain, for messages.
        max_samples: where to give up.
        taken: what a disturbance takes from d, (T, q) from the rows (T, q, n), always less than d. The criterion
            is the same then: sample t + 1 asks of a state what sample t asks of all its possible successors.

    Returns:
        (T, q) of bool, whether constraint j of sample i cuts (never at i = T - 1), and the rows (T, q, n).

    Raises:
        UnobservableGainError: the set is unbounded, or so nearly that rounding decides.
        NotDeterminedError: constraints at max_samples still cut, or there are more than `MOST_ROWS`.
    """
    stack, power = C[None], loop
    while len(stack) < _FIRST_BLOCK:
        stack, power = np.concatenate((stack, stack @ power)), power @ power
    while True:
        if C.shape[1] > 2 and stack.shape[0] * stack.shape[1] > MOST_ROWS:
            raise NotDeterminedError(
                f"gain {name!r}: the MOA set needs more than {MOST_ROWS} constraints of {C.shape[1]} coordinates; use "
                "faster poles, the same gain for both axes, or a longer control period"
            )
        try:
            limits = d if taken is None else d - taken(stack)
            hull = ConvexHull((stack / limits[..., None]).reshape(-1, C.shape[1]))
        except QhullError:
            hull = None
        if hull is None or hull.equations[:, -1].max() > -1e-12:
            raise UnobservableGainError(
                f"gain {name!r}: the ZMP does not show the whole state, so its set is unbounded; "
                "use a dcm() gain, other poles, or give bounds of the state"
            )
        cuts = np.zeros((len(stack), len(C)), dtype=bool)
        cuts.flat[hull.vertices] = True
        # Once no constraint of a whole sample cuts, none of a later one does (Gilbert and Tan 1991).
        if not cuts[-1].any():
            return cuts, stack
        if len(stack) >= max_samples:
            raise NotDeterminedError(
                f"gain {name!r}: the MOA set is not determined within {max_samples} samples; use faster poles"
            )
        stack, power = np.concatenate((stack, stack @ power)), power @ power
