"""A summary as tables in the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from sim.analysis.ablation import difference_words, p_words, split_words
from sim.analysis.formatting import (
    case_words,
    first_words,
    fixed,
    fraction,
    median_words,
    motor_episodes,
    motor_lines,
    percent,
    quartile_words,
)

_LEGEND = """Δv [m/s]: every push up to it is recovered in 4 of 5 replicas, ≥ if the suite
has none larger; ever: the largest ever recovered; Δv/ωd = 1: the no-step limit"""
FEW = 4
"""Cases that are shown one by one; more are condensed to their means."""
_ORDER = ("supervisor", "paper", "regulator", "statue")


def ordered(controllers: Iterable[str]) -> list[str]:
    """Controllers with ours first and the null ones last."""
    return sorted(controllers, key=lambda name: (_ORDER.index(name) if name in _ORDER else len(_ORDER), name))


def cases(summary: dict[str, Any]) -> list[dict[str, Any]]:
    """The cases that the thresholds are of, each once."""
    found: list[dict[str, Any]] = []
    for entry in summary["robust"]:
        if entry.get("case", {}) not in found:
            found.append(entry.get("case", {}))
    return found


def show(summary: dict[str, Any]) -> None:
    """Print it."""
    console = Console(highlight=False)
    found = cases(summary)
    for case in found if len(found) <= FEW else []:
        console.print(_thresholds(summary, case))
    if len(found) > FEW:
        console.print(_by_case(summary))
    if summary["robust"]:
        console.print(_LEGEND, style="dim", markup=False)
        console.print(_envelope(summary))
    if summary["first"] is not None:
        console.print(first_words(summary["first"]), style="dim", markup=False)
    if summary["endurance"]:
        console.print(_endurance(summary))
    if summary["ablation"] is not None:
        console.print(_ablation(summary["ablation"]))
    console.print(_rates(summary))
    if summary["truth"]["false_safe"]:
        console.print(_truth(summary))
    if summary["motors"]:
        console.print(_motors(summary))


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 0))


def _thresholds(summary: dict[str, Any], case: dict[str, Any]) -> Table:
    entries = [entry for entry in summary["robust"] if entry.get("case", {}) == case]
    controllers = ordered({entry["controller"] for entry in entries})
    table = _table(f"{summary['suite']}: robust recoverable push" + (f", {escape(case_words(case))}" if case else ""))
    table.add_column("direction", justify="right", no_wrap=True)
    for name in controllers:
        table.add_column(f"{name}\nΔv", justify="right", no_wrap=True)
        table.add_column("\never", justify="right")
        table.add_column("\nΔv/ωd", justify="right")
    by_key = {(entry["controller"], entry["direction_deg"]): entry for entry in entries}
    for direction in sorted({entry["direction_deg"] for entry in entries}):
        cells = []
        for name in controllers:
            one = by_key.get((name, direction))
            cells += ["", "", ""] if one is None else _cells(one)
        table.add_row(f"{direction:g}°", *cells)
    table.add_section()
    for how, condense in (("mean", lambda found: sum(found) / len(found)), ("worst", min)):
        cells = []
        for name in controllers:
            own = [entry for entry in entries if entry["controller"] == name]
            scaled = [entry["over_omega_d"] for entry in own if entry["over_omega_d"] is not None]
            bound = any(entry["capped"] for entry in own) and how == "mean"
            cells += [fixed(condense([entry["delta_v"] for entry in own]), capped=bound), ""]
            cells += [fixed(condense(scaled) if scaled else None, capped=bound)]
        table.add_row(how, *cells, style="bold")
    return table


def _envelope(summary: dict[str, Any]) -> Table:
    """Means, the worst direction, and holes, over all cases."""
    table = _table("over the directions; holes: lost below 75 % of the direction's threshold")
    table.add_column("controller")
    for heading in ("mean Δv/ωd", "worst", "at", "mean Δv/√gh", "worst", "holes"):
        table.add_column(heading, justify="right", no_wrap=True)
    for name in ordered(summary["hole_counts"]):
        bound = summary["robust_capped"][name] > 0
        where = summary["robust_worst_direction"].get(name)
        table.add_row(
            name,
            fixed(summary["robust_mean_over_omega_d"].get(name), capped=bound),
            fixed(summary["robust_worst_over_omega_d"].get(name)),
            "" if where is None else f"{where:g}°",
            fixed(summary["robust_mean_over_sqrt_gh"].get(name), 3, capped=bound),
            fixed(summary["robust_worst_over_sqrt_gh"].get(name), 3),
            str(summary["hole_counts"][name]),
        )
    return table


def _endurance(summary: dict[str, Any]) -> Table:
    table = _table("pushes survived before the fall, median [95 %]")
    for heading in ("controller", "pushes", "quartiles", "impulse N s", "trains", "survived all"):
        table.add_column(heading, justify="left" if heading == "controller" else "right", no_wrap=True)
    order = ordered(entry["controller"] for entry in summary["endurance"])
    for entry in sorted(summary["endurance"], key=lambda entry: order.index(entry["controller"])):
        words = case_words(entry.get("case"))
        table.add_row(
            entry["controller"] + (f", {escape(words)}" if words else ""),
            median_words(entry["pushes_survived"]),
            quartile_words(entry["pushes_survived"]),
            median_words(entry["total_impulse"], 1),
            str(entry["n"]),
            str(entry["survived_all"]),
        )
    return table


def _ablation(section: dict[str, Any]) -> Table:
    table = _table(f"recovered [95 %], against “{escape(section['reference'])}” over the same pushes (exact McNemar)")
    table.add_column("variant")
    for heading in ("recovered", "of", "points", "pushes that differ", "p"):
        table.add_column(heading, justify="right", no_wrap=True)
    for one in section["designs"]:
        against, found = one["against"], one["recovered"]
        told = (difference_words(against), split_words(against), p_words(against))
        table.add_row(escape(one["variant"]), percent(found), str(found["n"]), *told)
    return table


def _motors(summary: dict[str, Any]) -> Table:
    table = _table(f"motors, over the {motor_episodes(summary)}")
    for heading in ("controller", "greatest", "median", "most", "joint of the most"):
        words = heading in ("controller", "greatest", "joint of the most")
        table.add_column(heading, justify="left" if words else "right", no_wrap=True)
    order = ordered(entry["controller"] for entry in summary["motors"])
    for entry in sorted(summary["motors"], key=lambda entry: order.index(entry["controller"])):
        for i, (what, median, most, joint) in enumerate(motor_lines(entry)):
            table.add_row(entry["controller"] if i == 0 else "", what, median, most, joint)
    return table


def condensed(summary: dict[str, Any]) -> list[tuple[dict[str, Any], list[tuple[float, float, bool] | None]]]:
    """For each case, and each controller in order: mean and least dv / (omega d), and whether the mean is a bound."""
    names = ordered(summary["controllers"])
    lines = []
    for case in cases(summary):
        line: list[tuple[float, float, bool] | None] = []
        for name in names:
            own = [e for e in summary["robust"] if e["controller"] == name and e.get("case", {}) == case]
            scaled = [entry["over_omega_d"] for entry in own if entry["over_omega_d"] is not None]
            bound = any(entry["capped"] for entry in own)
            line.append((sum(scaled) / len(scaled), min(scaled), bound) if scaled else None)
        lines.append((case, line))
    return lines


def _by_case(summary: dict[str, Any]) -> Table:
    names = ordered(summary["controllers"])
    table = _table(f"{summary['suite']}: robust Δv/ωd over the directions")
    table.add_column("case")
    for name in names:
        table.add_column(f"{name}\nmean", justify="right", no_wrap=True)
        table.add_column("\nworst", justify="right", no_wrap=True)
    for case, line in condensed(summary):
        cells = []
        for one in line:
            cells += ["", ""] if one is None else [fixed(one[0], capped=one[2]), fixed(one[1])]
        table.add_row(escape(case_words(case)), *cells)
    return table


def _cells(one: dict[str, Any]) -> list[str]:
    return [fixed(one["delta_v"], capped=one["capped"]), fixed(one["ever"]), fixed(one["over_omega_d"])]


def _rates(summary: dict[str, Any]) -> Table:
    table = _table(f"recovered, of the {'pushes' if summary['train'] else 'episodes'} that were run [95 %]")
    for heading in ("controller", "recovered", "of", "fell", "not settled", "crashed"):
        table.add_column(heading, justify="left" if heading == "controller" else "right", no_wrap=True)
    found = {entry["by"]["controller"]: entry for entry in summary["rates"] if list(entry["by"]) == ["controller"]}
    for name in ordered(found):
        one = found[name]
        counts = (str(one[key]) for key in ("n", "fell", "not_settled", "crashed"))
        table.add_row(name, percent(one), *counts)
    return table


def _truth(summary: dict[str, Any]) -> Table:
    truth = summary["truth"]
    table = _table("prediction of the sets at the end of the push [95 %]")
    table.add_column("world")
    table.add_column("false safe", no_wrap=True)
    table.add_column("of predicted safe", justify="right", no_wrap=True)
    table.add_column("false alarm", no_wrap=True)
    table.add_column("of predicted unsafe", justify="right", no_wrap=True)
    for world, safe in truth["false_safe"].items():
        alarm = truth["false_alarm"][world]
        table.add_row(world, percent(safe), fraction(safe), percent(alarm), fraction(alarm))
    return table
