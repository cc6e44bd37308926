"""Words a summary once, as sections of tables, for the terminal, for Markdown and for the page alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sim.presenter.formatting import (
    MISSING,
    degrees,
    difference_words,
    fraction,
    median_words,
    p_words,
    percent,
    quartile_words,
    split_words,
)
from sim.presenter.prediction_section import prediction_section
from sim.presenter.sight_section import sight_section
from sim.presenter.tables import Section, Table
from sim.presenter.threshold_section import cases, threshold_section
from sim.presenter.who import Entry, Summary, crash_words, first_words, in_order, label, who

# What is told of the motors: the entry, its words, its unit, and digits after the point.
_USES = (
    ("peak_torque_use", "torque / stall", "N m", 2),
    ("peak_speed_use", "speed / no load", "rad/s", 2),
    ("saturated_time", "time in saturation", "s", 3),
)


def sections(summary: Summary) -> list[Section]:
    """All sections of a summary that have something to tell, of each robot in turn if there are several."""
    if not summary["by_robot"]:
        makers = (
            _first,
            _endurance,
            _ablation,
            threshold_section,
            _recovered,
            prediction_section,
            sight_section,
            _motors,
        )
        return [section for make in makers if (section := make(summary)) is not None]
    return [
        replace(
            section,
            robot=robot,
            heading=f"{section.heading} – {robot}",
            tables=tuple(replace(table, title=f"{robot}: {table.title}") for table in section.tables),
        )
        for robot, part in summary["by_robot"].items()
        for section in sections(part)
    ]


def _first(summary: Summary) -> Section | None:
    if summary["first"] is None:
        return None
    text = (
        "Sizes, directions, thresholds and the prediction below are of the second push; ωd and Koolen's limits are "
        "those of a robot that stands, and serve as a scale only. Who fell by the first push counts as not recovered."
    )
    return Section(key="first", heading="A first push precedes", text=text, notes=(first_words(summary),))


def _endurance(summary: Summary) -> Section | None:
    if not summary["endurance"]:
        return None
    rows = tuple(
        {
            "controller": who(summary, one),
            ("pushes", "median"): median_words(one["pushes_survived"]),
            ("pushes", "quartiles"): quartile_words(one["pushes_survived"]),
            ("impulse [N s]", "median"): median_words(one["total_impulse"], 1),
            ("impulse [N s]", "quartiles"): quartile_words(one["total_impulse"], 1),
            "trains": str(one["n"]),
            "survived all": str(one["survived_all"]),
        }
        for one in in_order(summary, summary["endurance"])
    )
    table = Table(
        title="Pushes survived before the fall, and their impulse: medians with 95 % bootstrap intervals",
        rows=rows,
        notes=("Trains that crashed are left out.",) if crash_words(summary) else (),
    )
    return Section(key="endurance", heading="How many pushes it survives", tables=(table,))


def _ablation(summary: Summary) -> Section | None:
    if summary["ablation"] is None:
        return None
    reference = summary["ablation"]["reference"]
    text = (
        f"The same pushes, answered by each variant. Lost are those that “{reference}” recovers and the variant does "
        "not, gained the reverse. Thresholds and rates below are of all variants; the figures at the top, the "
        f"prediction, the limits, the motors and the failures are of “{reference}”."
    )
    table = ablation_table(summary["ablation"])
    return Section(key="ablation", heading="What each part is worth", text=text, tables=(table,))


def ablation_table(section: Entry) -> Table:
    """Each variant's recovery, and how it differs from that of the first.

    Args:
        section: `ablation` of a summary.
    """
    designs = section["designs"]
    ways = sorted({there["direction_deg"] for one in designs for there in one["by_direction"]})
    crashes = any(one["crashed"] for one in designs)
    rows = []
    for one in designs:
        found, against = one["recovered"], one["against"]
        there = {rate["direction_deg"]: rate for rate in one["by_direction"]}
        row = {"variant": one["variant"], "recovered": fraction(found), "[95 %]": percent(found)}
        row |= {"crashed": str(one["crashed"])} if crashes else {}
        row |= {"difference": difference_words(against), "pushes that differ": split_words(against)}
        rows.append(row | {"p": p_words(against)} | {degrees(way): fraction(there.get(way)) for way in ways})
    note = (
        f"Difference to “{section['reference']}” in percentage points over the pushes that both were given, with p of "
        "the exact McNemar test, not corrected for the number of variants"
    )
    what = "sectors of 45° about the directions" if section["sectors"] else "directions"
    note += f"; the last columns are {what} of the push" if ways else ""
    note += "; episodes that crashed are counted apart and in no rate" if crashes else ""
    return Table(title="Recovered, with 95 % Wilson intervals", rows=tuple(rows), notes=(f"{note}.",))


def _recovered(summary: Summary) -> Section:
    what = "pushes" if summary["train"] else "episodes"
    several = len(cases(summary)) > 1
    share = "Share of pushes after which it stood until the next" if summary["train"] else "Share of replicas recovered"
    text = f"{share}, by direction and size{', over all cases' if several else ''}. White was not run"
    text += ": a series ends when it only fails." if summary["robust"] else "."
    if summary["robust"] and not several:
        text += " Black bars are the robust thresholds, yellow ones the limit without a step."
    found = [
        {"controller": controller, "case": other, **entry}
        for entry in summary["rates"]
        if (controller := entry["by"].get("controller")) is not None
        and len(other := {name: value for name, value in entry["by"].items() if name != "controller"}) < 2
        and not {"direction_deg", "delta_v"} & other.keys()
    ]
    rows = (
        {"controller": who(summary, one), "recovered": percent(one), "of": str(one["n"])}
        | {name.replace("_", " "): str(one[name]) for name in ("fell", "not_settled", "crashed")}
        for one in sorted(in_order(summary, found), key=lambda one: len(one["by"]))
    )
    return Section(
        key="recovered",
        heading="What was recovered",
        text=text,
        tables=(
            Table(title=f"Of the {what} that were run, with 95 % intervals", rows=tuple(rows)),
            *_direction_tables(summary),
        ),
        notes=() if summary["robust"] else crash_words(summary),
    )


def _direction_tables(summary: Summary) -> list[Table]:
    found = [entry for entry in summary["rates"] if list(entry["by"]) == ["controller", "direction_deg"]]
    rows = []
    for way in sorted({entry["by"]["direction_deg"] for entry in found}):
        there = {entry["by"]["controller"]: entry for entry in found if entry["by"]["direction_deg"] == way}
        row: dict[Any, str] = {"direction": degrees(way)}
        for name in summary["controllers_shown"]:
            row[label(summary, name), "recovered"] = percent(there[name]) if name in there else ""
            row[label(summary, name), "of"] = str(there[name]["n"]) if name in there else ""
        rows.append(row)
    return [Table(title="The same by direction", rows=tuple(rows), shown="page")] if rows else []


def _motors(summary: Summary) -> Section | None:
    if not summary["motors"]:
        return None
    rows: list[dict[Any, str]] = []
    for entry in in_order(summary, summary["motors"]):
        who_gave = {"controller": label(summary, entry["controller"]), "episodes": str(entry["n"])}
        for column, what, unit, digits in _USES:
            use = entry[column]
            joint = f"{use['joint']}, {use['peak']:.3g} {unit}" if "peak" in use else f"{use['joint'] or MISSING}"
            numbers = (f"{use[how]:.{digits}f}{'' if 'peak' in use else f' {unit}'}" for how in ("median", "max"))
            cells = dict(zip(("median", "most"), numbers, strict=True))
            rows.append({**who_gave, "greatest in an episode": what, **cells, "joint of the most": joint})
            who_gave = dict.fromkeys(who_gave, "")
    episodes = "trains of pushes, with their falls" if summary["train"] else "episodes that were recovered"
    return Section(
        key="motors",
        heading="Motors",
        text=(
            "What was asked of them in an episode. A motor is in saturation at its torque–speed line, which the "
            "physics enforces."
        ),
        tables=(Table(title=f"Motors, over the {episodes}", rows=tuple(rows)),),
    )
