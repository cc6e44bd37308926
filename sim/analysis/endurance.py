"""How many pushes of a growing train are survived: medians with their intervals, and the curve of survival."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sim.analysis.statistics import Rate, Row, grouped, spread
from sim.analysis.thresholds import varying
from sim.results.train import SURVIVED


def endurance(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The section `endurance` of a summary: an entry for every controller and case; empty without trains.

    Each has the number of replicas `n`, `pushes` at most, the spread of `pushes_survived` and of `total_impulse`
    [N s], how many replicas `survived_all`, and `survival`: the rate still standing after 0, 1, 2 ... pushes. Episodes
    that crashed are left out; the rates count them.
    """
    trains = [row for row in rows if row.get(SURVIVED) is not None]
    columns = varying(trains)
    found = []
    for (controller, *case), members in grouped(trains, ["controller", *columns]).items():
        survived = [int(row[SURVIVED]) for row in members]
        most = max(int(row["train"]) for row in members)
        found.append(
            {
                "controller": controller,
                **({"case": dict(zip(columns, case, strict=True))} if columns else {}),
                "n": len(members),
                "pushes": most,
                "pushes_survived": spread(survived),
                "total_impulse": spread([float(row["total_impulse"]) for row in members]),
                "survived_all": survived.count(most),
                "survival": [
                    Rate(count=sum(count >= number for count in survived), n=len(members)).as_dict()
                    for number in range(most + 1)
                ],
            }
        )
    return found
