"""The episodes of a sweep one by one, as a table."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sim.presenter.formatting import MISSING, fixed
from sim.presenter.tables import Section, Table


def episode_section(rows: Sequence[Mapping[str, Any]], folder: Path) -> Section:
    """A row for each episode.

    Args:
        rows: of the sweep's table, each with its probability of recovery or None.
        folder: of the sweep, for the command that shows one again.
    """
    several = [name for name in ("robot", "world", "variant") if len({row.get(name) for row in rows}) > 1]
    told = any(row["probability"] is not None for row in rows)
    table = Table(
        title=f"{len(rows)} episodes",
        rows=tuple(
            {
                "episode": row["episode"],
                "controller": row["controller"],
                **{name: str(row[name]) for name in several},
                "to": "–" if row["direction_deg"] is None else f"{row['direction_deg']:.4g}°",
                "Δv": "–" if row["delta_v"] is None else fixed(row["delta_v"]),
                "replica": str(row["replica"]),
                **(
                    {"p": MISSING if row["probability"] is None else f"{100 * row['probability']:.0f} %"}
                    if told
                    else {}
                ),
                "outcome": str(row["outcome"]),
                "why": str(row["reason"] or ""),
            }
            for row in rows
        ),
        notes=(
            *(("p: probability of recovery, told by the slacks at the end of the push",) if told else ()),
            f"again: okiagari replay {shlex.quote(str(folder))} EPISODE --video",
        ),
    )
    return Section(key="episodes", heading="Episodes", tables=(table,))
