"""How numbers of a summary are written for people, the same in the terminal, in Markdown and on the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sim.analysis.thresholds import least_of

MISSING = "–"


def percent(rate: Mapping[str, Any] | None, *, interval: bool = True) -> str:
    """A rate with its 95 % interval: "81 % [76, 85]"."""
    if rate is None or rate["rate"] is None:
        return MISSING
    words = f"{100 * rate['rate']:.0f} %"
    if interval:
        low, high = rate["interval"]
        words += f" [{100 * low:.0f}, {100 * high:.0f}]"
    return words


def fraction(rate: Mapping[str, Any] | None) -> str:
    """A rate as what it counts: "41 of 50"."""
    return MISSING if rate is None or not rate["n"] else f"{rate['count']} of {rate['n']}"


def fixed(value: float | None, digits: int = 2, *, capped: bool = False) -> str:
    """A number; "≥" before one that the suite's highest level cut short."""
    return MISSING if value is None else f"{'≥ ' if capped else ''}{value:.{digits}f}"


def condensed(entries: Sequence[Mapping[str, Any]], scale: str, digits: int = 2) -> tuple[str, str]:
    """Mean and least of thresholds, each with "≥" if the suite's highest level cut it short.

    Args:
        entries: of `robust` of a summary.
        scale: delta_v, over_omega_d or over_sqrt_gh.
        digits: after the point.
    """
    known = [(entry[scale], entry["capped"]) for entry in entries if entry[scale] is not None]
    if not known:
        return MISSING, MISSING
    mean, least = sum(value for value, _ in known) / len(known), min(value for value, _ in known)
    # The least is not known better than the one that is least; of two alike, the one that is not cut short.
    cut = all(capped for value, capped in known if value == least)
    return fixed(mean, digits, capped=any(capped for _, capped in known)), fixed(least, digits, capped=cut)


def degrees(direction: float) -> str:
    """A direction: "22.5°"."""
    return f"{direction:g}°"


def replica_words(replicas: int) -> str:
    """How many replicas a robust push is recovered in: "at least 4 of 5 replicas"."""
    least = least_of(replicas)
    if least < replicas:
        return f"at least {least} of {replicas} replicas"
    return {1: "its only replica", 2: "both replicas"}.get(replicas, f"all {replicas} replicas")


def case_words(case: Mapping[str, Any] | None) -> str:
    """What distinguishes a case: "body trunk, mass scale 1.1"."""
    return ", ".join(f"{name.replace('_', ' ')} {value_words(value)}" for name, value in (case or {}).items())


def value_words(value: Any) -> str:
    """One value of a column."""
    if value is None:
        return "as the scenario has it"
    if isinstance(value, list):
        return f"{value[0]:g} to {value[1]:g}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def median_words(spread: Mapping[str, Any], digits: int = 0) -> str:
    """A median with its 95 % interval: "12 [10, 14]"."""
    low, high = spread["interval"]
    return f"{_short(spread['median'], digits)} [{_short(low, digits)}, {_short(high, digits)}]"


def quartile_words(spread: Mapping[str, Any], digits: int = 0) -> str:
    """The quartiles: "9 to 15"."""
    low, high = spread["quartiles"]
    return f"{_short(low, digits)} to {_short(high, digits)}"


def _short(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if digits else f"{value:.4g}"


def difference_words(against: Mapping[str, Any] | None) -> str:
    """How many percentage points more than the full design are recovered: "−23"."""
    if against is None or against["difference"] is None:
        return MISSING
    return f"{100 * against['difference']:+.0f}".replace("-", "−")


def p_words(against: Mapping[str, Any] | None) -> str:
    """The chance of so uneven a split if the variants were alike."""
    p = None if against is None else against["p"]
    return MISSING if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def split_words(against: Mapping[str, Any] | None) -> str:
    """How many pushes only one of the two recovers: "22 lost, 1 gained"."""
    return MISSING if against is None or not against["pairs"] else f"{against['lost']} lost, {against['gained']} gained"
