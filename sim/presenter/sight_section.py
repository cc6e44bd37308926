"""Words how far off the controllers saw."""

from __future__ import annotations

from typing import Any

from sim.presenter.tables import Section, Table
from sim.presenter.who import Summary, in_order, who


def sight_section(summary: Summary) -> Section | None:
    """The error of the DCM that was seen, of each controller and case; None if all saw the true state."""
    if not summary["sight"]:
        return None
    rows: list[dict[Any, str]] = []
    for entry in in_order(summary, summary["sight"]):
        row: dict[Any, str] = {"controller": who(summary, entry), "episodes": str(entry["n"])}
        for name, what in (("dcm_error_rms", "RMS [mm]"), ("dcm_error_peak", "peak [mm]")):
            row |= {
                (what, how): f"{1e3 * entry[name][key]:.1f}" for how, key in (("median", "median"), ("most", "max"))
            }
        rows.append(row)
    return Section(
        key="sight",
        heading="What the controllers saw",
        text="Error of the DCM that was seen, about the loaded soles, from the first push on and until a fall.",
        tables=(Table(title="Error of the DCM that was seen, over the episodes", rows=tuple(rows)),),
    )
