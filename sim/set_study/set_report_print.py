"""The report on the sets of a scenario as tables for people."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

_COMPASS = {0: "forward", 90: "left", 180: "back", 270: "right"}


def print_report(report: dict[str, Any], console: Console) -> None:
    """Print what `set_report` returns."""
    robot, stepping = report["robot"], report["stepping"]
    console.print(f"[bold]{report['scenario']}[/]")
    console.print(
        f"{robot['name']}: {robot['mass']:.3g} kg, COG at {robot['cog_height']:.3g} m, ω {robot['omega']:.3g} 1/s; "
        f"period {1e3 * report['dt']:g} ms"
    )
    for facts in report["regulators"]:
        console.print(f"gain {facts['gain']}: F = {_row(facts['F'][0])}, poles {_poles(facts['poles'])} 1/s")
    times = ", ".join(f"{time:g}" for time in stepping["step_times"])
    console.print(
        f"steps of {times} s, up to {stepping['max_steps']}; their sets in the plane of the DCM end in that of "
        f"k = {stepping['gain_k']:g}\n"
    )
    console.print(_sets(report))
    console.print()
    console.print(_directions(report))
    if report["pushes"]:
        console.print()
        console.print(_pushes(report))


def _sets(report: dict[str, Any]) -> Table:
    table = Table(title="Regulators' sets, each certified by linear programs of its own", title_justify="left")
    for heading in ("set", "certificate"):
        table.add_column(heading)
    for heading in ("rows", "t*", "worst row: ZMP now", "successor", "area x, ẋ: slice", "projection"):
        table.add_column(heading, justify="right")
    for facts in report["regulators"]:
        area = next((area for area in facts["areas"] if area["plane"] == "x-xd"), None)
        table.add_row(
            facts["gain"],
            _verdict(facts["holds"]) + ("" if facts["bounded"] else ", unbounded"),
            str(facts["rows"]),
            f"{facts['t_star']} ({facts['t_star'] * facts['dt']:.3g} s)",
            f"{1e3 * facts['inner']:+.1e} mm",
            f"{1e3 * facts['invariance']:+.1e} mm",
            *(("-", "-") if area is None else (_area(area["slice"]), _area(area["projection"]))),
        )
    return table


def _directions(report: dict[str, Any]) -> Table:
    """Of the numbers of steps one, two, three and the most."""
    most = report["stepping"]["max_steps"]
    shown = sorted({min(n, most) for n in (1, 2, 3, most)})
    table = Table(title="Hardest sudden push from rest, Δv in m/s, and Koolen's limit", title_justify="left")
    table.add_column("direction", justify="right")
    for heading in ("regulators", "ratio", *(f"{n} step{'s' if n > 1 else ''}" for n in shown), "ratio"):
        table.add_column(heading, justify="right")
    table.add_column("certificates")
    for facts in report["directions"]:
        degrees, steps = facts["direction_deg"], {one["steps"]: one for one in facts["steps"]}
        given = [one["certificate"] for one in facts["steps"] if one["certificate"] is not None]
        table.add_row(
            f"{_COMPASS.get(degrees, '')} {degrees}°".strip(),
            f"{facts['regulator_delta_v']:.3f}/{facts['no_step_limit']:.3f}",
            f"{facts['regulator_ratio']:.0%}",
            *(f"{steps[n]['delta_v']:.3f}/{steps[n]['limit']:.3f}" for n in shown),
            f"{steps[most]['delta_v'] / steps[most]['limit']:.0%}",
            _verdict(all(one["holds"] for one in given)) if given else "-",
        )
    return table


def _pushes(report: dict[str, Any]) -> Table:
    table = Table(title="The scenario's pushes, as sudden ones from rest", title_justify="left")
    for heading in ("at", "direction", "Δv", "slack, regulator", "slack, steps"):
        table.add_column(heading, justify="right")
    for heading in ("best steps", "certificate", "under the regulator"):
        table.add_column(heading)
    for push in report["pushes"]:
        table.add_row(
            f"{push['start']:g} s",
            f"{push['direction_deg']:.0f}°",
            f"{push['delta_v']:.2f} m/s",
            _slack(push["regulator_slack"]),
            _slack(push["stepping_slack"]),
            push["plan"],
            _verdict(push["certificate"]["holds"]),
            push["explanation"],
        )
    return table


def _verdict(holds: bool) -> str:
    return "[green]holds[/]" if holds else "[red]fails[/]"


def _slack(slack: float) -> str:
    colour = "green" if slack >= 0.0 else "red"
    return f"[{colour}]{1e3 * slack:+.1f} mm[/]"


def _area(area: float | None) -> str:
    return "unbounded" if area is None else f"{1e4 * area:.0f} cm²/s"


def _row(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values[:2]) + ") per axis"


def _poles(poles: list[list[float]]) -> str:
    return ", ".join(f"{real:.3g}" if abs(imag) < 1e-9 else f"{real:.3g}{imag:+.3g}i" for real, imag in poles)
