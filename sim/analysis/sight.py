"""How far off the controllers of a sweep saw, where they did not see the true state."""

from __future__ import annotations

from typing import Any

import pandas as pd

from sim.analysis.frame import groups, varying

_ERRORS = ("dcm_error_rms", "dcm_error_peak")


def sight(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The section `sight` of a summary: an entry for every controller and case in which the true state was not seen.

    Of all episodes, until their falls: `dcm_error_rms` and `dcm_error_peak` [m], each with its median and maximum over
    the episodes.
    """
    seen = frame[frame["dcm_error_rms"].notna()]
    by = ["controller", *(name for name in ("variant", "sensing", "latency", "body_error") if name in varying(frame))]
    return [
        {
            "controller": values[0],
            "case": dict(zip(by[1:], values[1:], strict=True)),
            "n": len(members),
            **{name: {"median": float(members[name].median()), "max": float(members[name].max())} for name in _ERRORS},
        }
        for values, members in groups(seen, by)
    ]
