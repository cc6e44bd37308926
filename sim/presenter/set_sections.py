"""The report on the sets of a scenario as sections of tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sim.presenter.tables import Section, Table

_COMPASS = {0: "forward", 90: "left", 180: "back", 270: "right"}


def set_sections(report: dict[str, Any]) -> list[Section]:
    """What `sim.set_study.set_report.set_report` returns, in words."""
    exact = report["exact"]
    found = [Section(key="sets", heading="The sets", tables=tuple(_set_tables(exact)), notes=tuple(_facts(report)))]
    if report["pushes"]:
        found.append(Section(key="pushes", heading="The scenario's pushes", tables=(_pushes(report),)))
    if (robust := report["robust"]) is not None:
        error = f"whatever the ZMP's error up to {1e3 * robust['zmp_error']:g} mm along each axis"
        tables = tuple(_set_tables(robust, f", {error}"))
        notes = tuple(f"{name}: no set; {why}" for name, why in robust["left_out"].items())
        found.append(Section(key="robust", heading="With an error of the ZMP", tables=tables, notes=notes))
    if (late := report["late"]) is not None:
        found.append(Section(key="late", heading="With a delay", tables=(_late(late),), notes=tuple(_unstable(late))))
    return found


def _facts(report: dict[str, Any]) -> Iterator[str]:
    """What must be known to read the tables."""
    if torques := report["torques"]:
        left_out = "1 torque is" if torques == 1 else f"{torques} torques are"
        yield f"{left_out} left out: a torque changes no velocity of the COG at once"
    robot, stepping = report["robot"], report["exact"]["stepping"]
    yield (
        f"{robot['name']}: {robot['mass']:.3g} kg, COG at {robot['cog_height']:.3g} m, ω {robot['omega']:.3g} 1/s; "
        f"period {1e3 * report['dt']:g} ms"
    )
    for facts in report["exact"]["regulators"]:
        yield f"gain {facts['gain']}: F = {_row(facts['F'][0])}, poles {_poles(facts['poles'])} 1/s"
    times = ", ".join(f"{time:g}" for time in stepping["step_times"])
    yield (
        f"steps of {times} s, up to {stepping['max_steps']}; their sets in the plane of the DCM end in that of "
        f"k = {stepping['gain_k']:.4g}"
    )


def _set_tables(sets: dict[str, Any], despite: str = "") -> Iterator[Table]:
    rows = []
    for facts in sets["regulators"]:
        area = next((area for area in facts["areas"] if area["plane"] == "x-xd"), None)
        rows.append(
            {
                "set": facts["gain"],
                "certificate": _verdict(facts["holds"]) + ("" if facts["bounded"] else ", unbounded"),
                "rows": str(facts["rows"]),
                "t*": f"{facts['t_star']} ({facts['t_star'] * facts['dt']:.3g} s)",
                ("worst row", "ZMP now"): f"{1e3 * facts['inner']:+.1e} mm",
                ("worst row", "successor"): f"{1e3 * facts['invariance']:+.1e} mm",
                ("area x, ẋ", "slice"): "–" if area is None else _area(area["slice"]),
                ("area x, ẋ", "projection"): "–" if area is None else _area(area["projection"]),
            }
        )
    yield Table(title=f"Regulators' sets{despite}, each certified by linear programs of its own", rows=tuple(rows))
    yield Table(
        title=f"Hardest sudden push from rest{despite}, Δv in m/s / Koolen's limit",
        rows=tuple(_direction(facts, sets["stepping"]["max_steps"]) for facts in sets["directions"]),
    )


def _direction(facts: dict[str, Any], most: int) -> dict[Any, str]:
    """Of the numbers of steps one, two, three and the most."""
    degrees, steps = facts["direction_deg"], {one["steps"]: one for one in facts["steps"]}
    given = [one["certificate"] for one in facts["steps"] if one["certificate"] is not None]
    row: dict[Any, str] = {
        "direction": f"{degrees}° {_COMPASS.get(degrees, '')}".strip(),
        ("regulators", "Δv"): f"{facts['regulator_delta_v']:.3f}/{facts['no_step_limit']:.3f}",
        ("regulators", "ratio"): f"{facts['regulator_ratio']:.0%}",
    }
    for n in sorted({min(n, most) for n in (1, 2, 3, most)}):
        row[f"{n} step{'s' if n > 1 else ''}"] = f"{steps[n]['delta_v']:.3f}/{steps[n]['limit']:.3f}"
    row["ratio"] = f"{steps[most]['delta_v'] / steps[most]['limit']:.0%}"
    row["certificates"] = _verdict(all(one["holds"] for one in given)) if given else "–"
    return row


def _pushes(report: dict[str, Any]) -> Table:
    rows = [
        {
            "at": f"{push['start']:g} s",
            "direction": f"{push['direction_deg']:.0f}°",
            "Δv": f"{push['delta_v']:.2f} m/s",
            ("slack", "regulator"): f"{1e3 * push['regulator_slack']:+.1f} mm",
            ("slack", "steps"): f"{1e3 * push['stepping_slack']:+.1f} mm",
            "best steps": push["plan"],
            "certificate": _verdict(push["certificate"]["holds"]),
        }
        for push in report["pushes"]
    ]
    notes = tuple(f"{push['start']:g} s: under the regulator {push['explanation']}" for push in report["pushes"])
    return Table(title="The scenario's pushes, as sudden ones from rest", rows=tuple(rows), notes=notes)


def _late(late: dict[str, Any]) -> Table:
    rows = []
    for facts in late["regulators"]:
        row: dict[Any, str] = {"set": facts["gain"], "rows": str(facts["rows"]) if facts["rows"] else "–"}
        for one in facts["directions"]:
            row["Δv [m/s] to", f"{one['direction_deg']}°"] = f"{one['delta_v']:.3f}"
        rows.append(row)
    title = (
        f"Regulators' sets when the ZMP comes {1e3 * late['delay']:g} ms late, and the hardest sudden push from rest"
    )
    return Table(title=title, rows=tuple(rows))


def _unstable(late: dict[str, Any]) -> Iterator[str]:
    yield "The steps' sets know no delay: a step is aimed anew in every tick, from the state that is then seen."
    for facts in late["regulators"]:
        if facts["why"]:
            yield f"{facts['gain']}: no set; {facts['why']}"


def _verdict(holds: bool) -> str:
    return "holds" if holds else "fails"


def _area(area: float | None) -> str:
    return "unbounded" if area is None else f"{1e4 * area:.0f} cm²/s"


def _row(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values[:2]) + ") per axis"


def _poles(poles: list[list[float]]) -> str:
    return ", ".join(f"{real:.3g}" if abs(imag) < 1e-9 else f"{real:.3g}{imag:+.3g}i" for real, imag in poles)
