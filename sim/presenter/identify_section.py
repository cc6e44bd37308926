"""What was measured of the running body, as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sim.presenter.formatting import MISSING
from sim.presenter.tables import Section, Table

Report = Mapping[str, Any]
AXES = ("x", "y")
_RESPONSES = {"body": "command", "loop": "law at the true state"}


def identify_sections(report: Report) -> list[Section]:
    """What `sim.identify.identify.identify` returns, in words."""
    peaks = " and ".join(f"{1e3 * peak:.2g} mm along {axis}" for peak, axis in zip(report["peaks"], AXES, strict=True))
    facts = (
        f"{report['robot']['name']}, {report['layer'] or 'pendulum'}, {report['sensing']}; period "
        f"{1e3 * report['dt']:g} ms; swayed by up to {peaks}, {len(report['seeds'])} seeds, ± is a 95 % interval"
    )
    return [
        Section(key="response", heading="How the ZMP follows", tables=(_responses(report),), notes=(facts,)),
        Section(key="feedback", heading="The feedback", tables=(_gains(report),)),
        Section(key="errors", heading="Errors", tables=(_errors(report),), notes=_error_notes(report)),
        Section(key="left", heading="What is left", tables=(_left(report),), notes=_left_notes(report)),
    ]


def line_to_use(report: Report, scenario: str) -> str:
    """The command that runs the scenario with sets that withstand what was measured."""
    return f"okiagari run {scenario} --set stepping.zmp_error={report['zmp_error']:g}"


def _named(report: Report, case: str) -> str:
    return str(report["sensing"]) if case == "as given" else "true state"


def _responses(report: Report) -> Table:
    rows: list[dict[Any, str]] = []
    for case, measured in report["standing"].items():
        for response, against in _RESPONSES.items():
            for i, frequency in enumerate(report["frequencies"]):
                row: dict[Any, str] = {"senses": "", "against": ""}
                if i == 0:
                    row = {"senses": _named(report, case), "against": against}
                row["frequency"] = f"{frequency:g} Hz"
                for axis in AXES:
                    found = measured["axes"][axis][response][i]
                    row[axis, "gain"] = _estimate(found["gain"], 1.0, 2)
                    row[axis, "lag [ms]"] = _estimate(found["lag"], 1e3, 1)
                rows.append(row)
    return Table(title="Realised ZMP, standing: gain and lag; below 0 it leads", rows=tuple(rows))


def _gains(report: Report) -> Table:
    rows = tuple(
        {"senses": _named(report, case), "k of": of, "designed": f"{report['gain']['designed']:.3f}"}
        | {axis: _estimate(measured["axes"][axis]["gain"][key], 1.0, 3) for axis in AXES}
        for case, measured in report["standing"].items()
        for key, of in (("commanded", "the command"), ("realised", "the realised ZMP"))
    )
    return Table(title=f"Gain of the ZMP on the true DCM ({report['gain']['name']})", rows=rows)


def _errors(report: Report) -> Table:
    rows = []
    for case, measured in report["standing"].items():
        who = f"standing, {_named(report, case)}"
        rows += [_spreads(who, "not explained by gain and lag", {a: measured["axes"][a]["residual"] for a in AXES})]
        rows += [_spreads("", "from the command", measured["error"])]
        rows += [_spreads("", "from the law at the true state", measured["to_withstand"])]
    steps = report["stepping"]
    if steps is not None and steps["steps"]:
        rows += [_spreads(f"stepping, {report['sensing']}", "from the command", steps["error"])]
        if steps["dcm_error"] is not None:
            rows += [_spreads("", "with k times the DCM's error", steps["to_withstand"])]
    return Table(title="Error of the realised ZMP [mm]", rows=tuple(rows))


def _spreads(who: str, what: str, found: Mapping[str, Any]) -> dict[Any, str]:
    row: dict[Any, str] = {"when": who, "error": what}
    for axis in AXES:
        for key, words in (("rms", "RMS"), ("q95", "95 %"), ("q99", "99 %"), ("largest", "largest")):
            row[axis, words] = MISSING if found[axis] is None else f"{1e3 * found[axis][key]:.2f}"
    return row


def _error_notes(report: Report) -> tuple[str, ...]:
    notes = []
    sights = {"standing": report["standing"]["as given"]["dcm_error"]}
    steps = report["stepping"]
    if steps is not None:
        sights["stepping"] = steps["dcm_error"]
        fell = f", {steps['fell']} fell" if steps["fell"] else ""
        means = ""
        if steps["steps"]:
            most = ", ".join(f"{1e3 * steps['mean_of_step'][axis]:.1f} mm along {axis}" for axis in AXES)
            means = f"; mean error of a step at most {most}"
        notes.append(f"{steps['steps']} spells of stepping in {steps['episodes']} pushed episodes{fell}{means}")
    for when, sight in sights.items():
        if sight is not None:
            notes.append(f"DCM as seen, {when}: {1e3 * sight['rms']:.2f} mm RMS, {1e3 * sight['peak']:.2f} mm peak")
    return tuple(notes)


def _left(report: Report) -> Table:
    rows = tuple(
        {
            "gain": f"{row['gain']}, {report['gain'][row['gain']]:.3f}",
            "ZMP error": "none" if row["error"] == "none" else f"{1e3 * row['zmp_error']:.2f} mm, {row['error']}",
            "least [m/s]": _speed(row["least"]),
            "mean [m/s]": _speed(row["mean"]),
            "of any law's": MISSING if row["share"] is None else f"{100 * row['share']:.0f} %",
        }
        for row in report["sets"]
    )
    return Table(title="Δv that the set of standing holds, over eight directions", rows=rows)


def _left_notes(report: Report) -> tuple[str, ...]:
    return tuple(f"{row['gain']} gain, {row['error']}: {row['why']}" for row in report["sets"] if row["why"])


def _speed(value: float | None) -> str:
    return MISSING if value is None else f"{value:.3f}"


def _estimate(found: Mapping[str, Any], scale: float, digits: int) -> str:
    """A mean with half its interval: "1.07 ± 0.02"."""
    half = scale * (found["interval"][1] - found["mean"])
    mean = round(scale * found["mean"], digits) + 0.0
    return f"{mean:.{digits}f} ± {half:.{digits}f}"
