"""Who an entry of a summary is about, in words and in order, and what holds of all entries."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sim.presenter.formatting import case_words, fraction

Summary = dict[str, Any]
"""What `sim.analysis.summary.summarise` returns."""
Entry = dict[str, Any]
"""An entry of one of its sections."""


def label(summary: Summary, controller: str) -> str:
    """What people call a controller."""
    return str(summary["controllers_shown"][controller]["label"])


def main_controller(summary: Summary) -> str:
    """The first controller that is shown; of a suite with variants, that the first variant has."""
    reference = (summary["ablation"] or {}).get("reference")
    asked = [entry["by"] for entry in summary["rates"] if list(entry["by"]) == ["controller", "variant"]]
    own = {by["controller"] for by in asked if by["variant"] == reference}
    return next(name for name in summary["controllers_shown"] if name in own or not own)


def who(summary: Summary, entry: Entry) -> str:
    """The controller of an entry, and its case if there are several: "supervisor, mass scale 1.1"."""
    return ", ".join(part for part in (label(summary, entry["controller"]), case_words(entry.get("case"))) if part)


def by_controller(summary: Summary, entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """The entries of each controller that has some, in the order in which they are shown."""
    found: dict[str, list[Entry]] = {name: [] for name in summary["controllers_shown"]}
    for entry in entries:
        found[entry["controller"]].append(entry)
    return {name: own for name, own in found.items() if own}


def in_order(summary: Summary, entries: Iterable[Entry]) -> list[Entry]:
    """The entries in the order in which their controllers are shown."""
    return [entry for own in by_controller(summary, entries).values() for entry in own]


def crash_words(summary: Summary) -> tuple[str, ...]:
    """How many episodes crashed, and of whom; nothing if none did."""
    found = {e["by"]["controller"]: e["crashed"] for e in summary["rates"] if list(e["by"]) == ["controller"]}
    counts = [f"{n} ({label(summary, name)})" for name, n in found.items() if n]
    if not counts:
        return ()
    return (f"Crashed by an error of the program, which counts as not recovered: {', '.join(counts)}.",)


def first_words(summary: Summary) -> str:
    """What precedes every push of a suite with a first push."""
    first = summary["first"]
    told = (
        f"Every push is the second: it comes {first['gap']:g} s after a first one, of {first['size']:g} ωd of its own "
        f"direction and {first['duration']:g} s long"
    )
    if ways := first["directions_deg"]:
        told += f", to {', '.join(f'{way:.0f}°' for way in ways)} (one a replica)"
    mid = first["mid_step"].items()
    steps = [f"{fraction(rate)} ({label(summary, name)})" for name, rate in mid if rate["count"]]
    return told + (f"; a step was under way then in {', '.join(steps)}." if steps else ".")
