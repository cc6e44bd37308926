"""The report on the sets of a scenario as tables for people."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

_COMPASS = {0: "forward", 90: "left", 180: "back", 270: "right"}


def print_report(report: dict[str, Any], console: Console) -> None:
    """Print what `set_report` returns."""
    robot, gain = report["robot"], report["gain"]
    console.print(f"[bold]{report['scenario']}[/]")
    console.print(
        f"{robot['name']}: {robot['mass']:.3g} kg, COG at {robot['cog_height']:.3g} m, ω {robot['omega']:.3g} 1/s; "
        f"period {1e3 * report['dt']:g} ms"
    )
    console.print(f"gain {gain['name']}: F = {_row(gain['F'][0])}, poles {_poles(gain['poles'])} 1/s\n")
    console.print(_sets(report))
    console.print()
    console.print(_directions(report))
    if report["pushes"]:
        console.print()
        console.print(_pushes(report))


def _sets(report: dict[str, Any]) -> Table:
    table = Table(title="Sets, each certified by linear programs of its own", title_justify="left")
    for heading in ("set", "certificate"):
        table.add_column(heading)
    for heading in ("sets", "rows", "t*", "worst row: ZMP now", "successor", "area x, ẋ: slice", "projection"):
        table.add_column(heading, justify="right")
    named = [("regulator", report["regulator"])]
    if "tracking" in report:
        named.append((f"tracker, {report['tracking']['plan']}", report["tracking"]))
    for name, facts in named:
        area = next((area for area in facts["areas"] if area["plane"] == "x-xd"), None)
        table.add_row(
            name,
            ("[green]holds[/]" if facts["holds"] else "[red]fails[/]") + ("" if facts["bounded"] else ", unbounded"),
            str(facts["phases"]),
            str(facts["rows"]),
            f"{facts['t_star']} ({facts['t_star'] * facts['dt']:.3g} s)",
            f"{1e3 * facts['inner']:+.1e} mm",
            f"{1e3 * facts['invariance']:+.1e} mm",
            *(("-", "-") if area is None else (_area(area["slice"]), _area(area["projection"]))),
        )
    return table


def _directions(report: dict[str, Any]) -> Table:
    steps = report["directions"][0]["stepping_limit_steps"]
    table = Table(title="Hardest sudden push from rest, Δv in m/s", title_justify="left")
    table.add_column("direction", justify="right")
    for heading in ("regulator set", "no-step limit ωd", "ratio", "with steps", f"{steps}-step limit ωd_N", "ratio"):
        table.add_column(heading, justify="right")
    for facts in report["directions"]:
        degrees = facts["direction_deg"]
        table.add_row(
            f"{_COMPASS.get(degrees, '')} {degrees}°".strip(),
            f"{facts['regulator_delta_v']:.3f}",
            f"{facts['no_step_limit']:.3f}",
            f"{facts['regulator_ratio']:.0%}",
            f"{facts['stepping_delta_v']:.3f}",
            f"{facts['stepping_limit']:.3f}",
            f"{facts['stepping_delta_v'] / facts['stepping_limit']:.0%}",
        )
    return table


def _pushes(report: dict[str, Any]) -> Table:
    table = Table(title="The scenario's pushes, as sudden ones from rest", title_justify="left")
    for heading in ("at", "direction", "Δv", "slack, regulator", "slack, tracker"):
        table.add_column(heading, justify="right")
    table.add_column("steps")
    table.add_column("under the regulator")
    for push in report["pushes"]:
        table.add_row(
            f"{push['start']:g} s",
            f"{push['direction_deg']:.0f}°",
            f"{push['delta_v']:.2f} m/s",
            _slack(push["regulator_slack"]),
            _slack(push["tracking_slack"]),
            push["plan"] or "none within reach",
            push["explanation"],
        )
    return table


def _slack(slack: float | None) -> str:
    if slack is None:
        return "-"
    colour = "green" if slack >= 0.0 else "red"
    return f"[{colour}]{1e3 * slack:+.1f} mm[/]"


def _area(area: float | None) -> str:
    return "unbounded" if area is None else f"{1e4 * area:.0f} cm²/s"


def _row(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values[:2]) + ") per axis"


def _poles(poles: list[list[float]]) -> str:
    return ", ".join(f"{real:.3g}" if abs(imag) < 1e-9 else f"{real:.3g}{imag:+.3g}i" for real, imag in poles)
