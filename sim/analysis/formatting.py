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


def median_words(spread: dict[str, Any], digits: int = 0) -> str:
    """A median with its 95 % interval: "12 [10, 14]"."""
    low, high = spread["interval"]
    return f"{_short(spread['median'], digits)} [{_short(low, digits)}, {_short(high, digits)}]"


def quartile_words(spread: dict[str, Any], digits: int = 0) -> str:
    """The quartiles: "9 to 15"."""
    low, high = spread["quartiles"]
    return f"{_short(low, digits)} to {_short(high, digits)}"


def _short(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if digits else f"{value:.4g}"


def first_words(first: dict[str, Any]) -> str:
    """What precedes every push of a suite with a first push."""
    told = (
        f"Every push is the second: it comes {first['gap']:g} s after a first one, of {first['size']:g} ωd of its own "
        f"direction and {first['duration']:g} s long"
    )
    if ways := first["directions_deg"]:
        told += f", to {', '.join(f'{way:.0f}°' for way in ways)} (one a replica)"
    steps = [f"{fraction(rate)} ({name})" for name, rate in first["mid_step"].items() if rate["count"]]
    return told + (f"; a step was under way then in {', '.join(steps)}." if steps else ".")


def motor_episodes(summary: dict[str, Any]) -> str:
    """What the use of the motors is taken from."""
    return "trains of pushes, with their falls" if summary["train"] else "episodes that were recovered"


def motor_lines(entry: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """An entry of the section `motors`: what, its median, its maximum, and the joint of that."""
    lines = []
    for name, what, unit in (
        ("peak_torque_use", "torque / stall", "N m"),
        ("peak_speed_use", "speed / no load", "rad/s"),
    ):
        use = entry[name]
        lines.append((what, f"{use['median']:.2f}", f"{use['max']:.2f}", f"{use['joint']}, {use['peak']:.3g} {unit}"))
    time = entry["saturated_time"]
    longest = time["joint"] or MISSING
    return [*lines, ("time in saturation", f"{time['median']:.3f} s", f"{time['max']:.3f} s", longest)]
