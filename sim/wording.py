"""How numbers of a summary are written for people, the same in the terminal and in the report."""

from __future__ import annotations

from typing import Any

MISSING = "–"


def percent(rate: dict[str, Any] | None, *, interval: bool = True) -> str:
    """A rate with its 95 % interval: "81 % [76, 85]"."""
    if rate is None or rate["rate"] is None:
        return MISSING
    words = f"{100 * rate['rate']:.0f} %"
    if interval:
        low, high = rate["interval"]
        words += f" [{100 * low:.0f}, {100 * high:.0f}]"
    return words


def fraction(rate: dict[str, Any] | None) -> str:
    """A rate as what it counts: "41 of 50"."""
    return MISSING if rate is None or not rate["n"] else f"{rate['count']} of {rate['n']}"


def fixed(value: float | None, digits: int = 2, *, capped: bool = False) -> str:
    """A number; "≥" before one that the suite's highest level cut short."""
    return MISSING if value is None else f"{'≥ ' if capped else ''}{value:.{digits}f}"


def case_words(case: dict[str, Any] | None) -> str:
    """What distinguishes a case: "body trunk, mass scale 1.1"."""
    return ", ".join(f"{name.replace('_', ' ')} {value_words(value)}" for name, value in (case or {}).items())


def value_words(value: Any) -> str:
    """One value of a column."""
    if value is None:
        return "as the scenario has it"
    if isinstance(value, list):
        return f"{value[0]:g} to {value[1]:g}"
    return f"{value:g}" if isinstance(value, float) else str(value)
