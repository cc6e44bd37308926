"""Words the thresholds of a summary: by direction, by case, and condensed to an envelope."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sim.presenter.formatting import MISSING, case_words, condensed, degrees, fixed, replica_words
from sim.presenter.tables import Section, Table
from sim.presenter.who import Entry, Summary, by_controller, crash_words, first_words, label, who

FEW = 4
"""Cases that are shown one by one; more are condensed to their means."""
_HOLES = 40  # shown at most
_COLUMNS = 12  # directions that have a column each; of more, a table tells mean and worst
_SCALES = {"delta_v": ("Δv", 2), "ever": ("ever", 2), "over_omega_d": ("/(ωd)", 2), "over_sqrt_gh": ("/√(gh)", 3)}


def cases(summary: Summary) -> list[Entry]:
    """The cases that the thresholds are of, each once."""
    found: list[Entry] = []
    for entry in summary["robust"]:
        if entry.get("case", {}) not in found:
            found.append(entry.get("case", {}))
    return found


def _of_case(entries: Sequence[Entry], case: Entry) -> list[Entry]:
    return [entry for entry in entries if entry.get("case", {}) == case]


def threshold_section(summary: Summary) -> Section | None:
    """How hard the robot can be pushed: thresholds by direction, condensed over them, and the holes."""
    if not summary["robust"]:
        return None
    found, replicas = cases(summary), replica_words(summary["replicas"])
    tables = [_case_table(summary, found)] if len(found) > 1 else []
    tables += [_threshold_table(summary, case, folded=len(found) > FEW) for case in found]
    return Section(
        key="thresholds",
        heading=f"How hard it can be pushed{' a second time' if summary['first'] else ''}",
        text=(
            f"The robust threshold of a direction is the largest Δv such that every push up to it is recovered in "
            f"{replicas}; the largest push ever recovered may be an isolated pocket. Koolen's limits are those of a "
            "pendulum whose weightless feet step at once, as far and as fast as the scenario allows, straight into the "
            "push."
        ),
        tables=(*tables, _condensed_table(summary), *([_hole_table(summary)] if summary["holes"] else [])),
        notes=(
            f"Δv [m/s]: every push up to it is recovered in {replicas}; ever: the largest ever recovered; ≥: the suite "
            "has no larger push; Δv/(ωd) = 1 is the limit without a step.",
            *crash_words(summary),
        ),
    )


def _threshold_table(summary: Summary, case: Entry, *, folded: bool) -> Table:
    entries = by_controller(summary, _of_case(summary["robust"], case))
    robot = case.get("robot", summary["robots"][0])
    limits = {limit["direction_deg"]: limit for limit in summary["limits"] if limit["robot"] == robot}
    holed = holed_thresholds(summary, case)
    rows: list[dict[Any, str]] = []
    for way in sorted({entry["direction_deg"] for own in entries.values() for entry in own}):
        row: dict[Any, str] = {"to": degrees(way)}
        if limit := limits.get(way):
            row["limits", "ωd"] = fixed(limit["no_step_delta_v"])
            if steps := limit["n_step_over_omega_d"]:
                row["limits", f"{len(steps)} steps/(ωd)"] = fixed(steps[-1])
        for name, own in entries.items():
            one = next((entry for entry in own if entry["direction_deg"] == way), None)
            for scale, (words, digits) in _SCALES.items():
                told = fixed(one[scale], digits, capped=one["capped"] and scale != "ever") if one else ""
                row[label(summary, name), words] = told + (
                    _HOLE if told and scale != "ever" and (name, way) in holed else ""
                )
        rows.append(row)
    for i, how in enumerate(("mean", "worst")):
        row = {"to": how}
        for name, own in entries.items():
            for scale, (words, digits) in _SCALES.items():
                row[label(summary, name), words] = "" if scale == "ever" else condensed(own, scale, digits)[i]
        rows.append(row)
    return Table(
        title="Robust recoverable push" + (f", {case_words(case)}" if case else ""),
        rows=tuple(rows),
        totals=2,
        notes=(HOLE_WORDS,) if holed else (),
        shown="folded" if folded else "everywhere",
    )


def _case_table(summary: Summary, found: Sequence[Entry]) -> Table:
    entries = by_controller(summary, summary["robust"])
    rows = []
    for case in found:
        row: dict[Any, str] = {"case": case_words(case)}
        for name, every in entries.items():
            own = _of_case(every, case)
            row |= _grouped(label(summary, name), condensed(own, "over_omega_d") if own else ("", ""))
        rows.append(row)
    return Table(title="Robust Δv/(ωd) over the directions", rows=tuple(rows))


def _condensed_table(summary: Summary) -> Table:
    """Over all directions and cases; of a suite with variants, those of the first."""
    first = (summary["ablation"] or {}).get("reference")
    robust = [one for one in summary["robust"] if one.get("case", {}).get("variant", first) == first]
    rows = []
    for name, own in by_controller(summary, robust).items():
        at = summary["robust_worst_direction"].get(name)
        sizes = (*condensed(own, "over_omega_d"), MISSING if at is None else degrees(at))
        froude, holes = condensed(own, "over_sqrt_gh", 3), summary["hole_counts"][name]
        row = {"controller": label(summary, name), **_grouped("Δv/(ωd)", sizes), **_grouped("Δv/√(gh)", froude)}
        rows.append(row | {"holes": str(holes)})
    return Table(title="Over the directions; holes: lost below 75 % of the direction's threshold", rows=tuple(rows))


def _grouped(group: str, cells: Sequence[str]) -> dict[Any, str]:
    return {(group, heading): cell for heading, cell in zip(("mean", "worst", "at"), cells, strict=False)}


_HOLE = " *"
HOLE_WORDS = "*: above a hole: some push to that side of less than 75 % of the threshold was lost."


def holed_thresholds(summary: Summary, case: Entry) -> set[tuple[str, float]]:
    """Controller and direction of the thresholds that are above a hole."""
    return {(hole["controller"], hole["direction_deg"]) for hole in _of_case(summary["holes"], case)}


def envelope_table(summary: Summary, case: Entry) -> Table:
    """The thresholds of one case in units of omega d, with means, the least and holes: a row a controller.

    Each direction has a column; of more than twelve only the least is told, with its direction.
    """
    entries = _of_case(summary["robust"], case)
    ways = sorted({entry["direction_deg"] for entry in entries})
    rows, holed = [], holed_thresholds(summary, case)
    for name, own in by_controller(summary, entries).items():
        row = {"Δv/(ωd)": label(summary, name)} | _over_directions(own, ways, {w for n, w in holed if n == name})
        row |= {"mean Δv/√(gh)": condensed(own, "over_sqrt_gh", 3)[0]}
        holes = sum(hole["controller"] == name for hole in _of_case(summary["holes"], case))
        rows.append(row | {"holes": str(holes)})
    notes: tuple[str, ...] = () if summary["first"] is None else (first_words(summary),)
    notes += (HOLE_WORDS,) if holed and len(ways) <= _COLUMNS else ()
    return Table(title="Robust recoverable push", rows=tuple(rows), strong="mean", notes=notes)


def together_table(sweeps: Sequence[tuple[str, Summary]], controllers: Sequence[str]) -> Table:
    """The thresholds of several sweeps in units of omega d, as `envelope_table` has them: a row a controller and sweep.

    Args:
        sweeps: what each is called, and its summary.
        controllers: whose thresholds.
    """
    ways = sorted({entry["direction_deg"] for _, summary in sweeps for entry in summary["robust"]})
    rows = []
    for controller in controllers:
        for name, summary in sweeps:
            own = by_controller(summary, summary["robust"])[controller]
            holed = {hole["direction_deg"] for hole in summary["holes"] if hole["controller"] == controller}
            row = {"Δv/(ωd)": f"{label(summary, controller)}, {name}"} | _over_directions(own, ways, holed)
            rows.append(row | {"holes": str(summary["hole_counts"][controller])})
    noted = len(ways) <= _COLUMNS and any(_HOLE in cell for row in rows for cell in row.values())
    notes = (HOLE_WORDS,) if noted else ()
    return Table(title="Robust recoverable push", rows=tuple(rows), strong="mean", notes=notes)


def _over_directions(own: Sequence[Entry], ways: Sequence[float], holed: set[float]) -> dict[str, str]:
    """Cells of a controller's thresholds: of each direction if they are few, their mean, and the least."""
    at = {
        entry["direction_deg"]: fixed(entry["over_omega_d"], capped=entry["capped"])
        + (_HOLE if entry["direction_deg"] in holed else "")
        for entry in own
    }
    few = len(ways) <= _COLUMNS
    mean, worst = condensed(own, "over_omega_d")
    row = {degrees(way): at.get(way, "") for way in ways} if few else {"directions": str(len(own))}
    row |= {"mean": mean, "worst": worst}
    if not few:
        known = [(entry["over_omega_d"], entry["direction_deg"]) for entry in own if entry["over_omega_d"] is not None]
        least = min(known, default=(None, None))[0]
        row["worst at"] = ", ".join(degrees(way) for size, way in known if size == least) or MISSING
    return row


def cases_table(summary: Summary) -> Table:
    """The thresholds of all cases in units of omega d: a row for each and each controller, a column a direction.

    Beside each stands the largest push that was ever recovered, where it is another one.
    """
    ways = sorted({entry["direction_deg"] for entry in summary["robust"]})
    rows = []
    for case in cases(summary):
        for name, own in by_controller(summary, _of_case(summary["robust"], case)).items():
            row = {"case": case_words(case), "Δv/(ωd), robust (ever)": label(summary, name)}
            for way in ways:
                one = next((entry for entry in own if entry["direction_deg"] == way), None)
                row[degrees(way)] = MISSING if one is None else _with_ever(one)
            rows.append(row)
    return Table(title="Robust recoverable push", rows=tuple(rows))


def _with_ever(one: Entry) -> str:
    told = fixed(one["over_omega_d"], capped=one["capped"])
    return told if one["ever"] == one["delta_v"] else f"{told} ({fixed(one['ever_over_omega_d'])})"


def _hole_table(summary: Summary) -> Table:
    holes = summary["holes"]
    which = f"the first {_HOLES} of {len(holes)}" if len(holes) > _HOLES else "all of them"
    rows = (
        {
            "controller": who(summary, one),
            "to": degrees(one["direction_deg"]),
            "Δv": fixed(one["delta_v"]),
            "of the threshold": f"{100 * one['of_threshold']:.0f} %",
            "replica": str(one["replica"]),
            "how it ended": str(one["reason"]),
            "episode": one["episode"],
        }
        for one in holes[:_HOLES]
    )
    title = f"Holes, {which}: pushes below 75 % of their direction's robust threshold that were lost"
    return Table(title=title, rows=tuple(rows), shown="page")
