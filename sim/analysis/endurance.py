"""How many pushes of a growing train are survived: medians with their intervals, and the curve of survival."""

from __future__ import annotations

from typing import Any

import pandas as pd

from sim.analysis.frame import groups, varying
from sim.analysis.statistics import rate_of, spread
from sim.results.train import SURVIVED


def endurance(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The section `endurance` of a summary: an entry for every controller and case; empty without trains.

    Each has the number of replicas `n`, `pushes` at most, the spread of `pushes_survived` and of `total_impulse`
    [N s], how many replicas `survived_all`, and `survival`: the rate still standing after 0, 1, 2 ... pushes. Episodes
    that crashed are left out; the rates count them.
    """
    trains = frame[frame[SURVIVED].notna()]
    columns = varying(trains)
    found = []
    for (controller, *case), members in groups(trains, ["controller", *columns]):
        survived, most = members[SURVIVED], int(members["train"].max())
        found.append(
            {
                "controller": controller,
                **({"case": dict(zip(columns, case, strict=True))} if columns else {}),
                "n": len(members),
                "pushes": most,
                "pushes_survived": spread(survived),
                "total_impulse": spread(members["total_impulse"]),
                "survived_all": int((survived == most).sum()),
                "survival": [rate_of(survived >= number) for number in range(most + 1)],
            }
        )
    return found
