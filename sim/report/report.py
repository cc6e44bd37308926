"""One page that a reviewer can read: what was run, what came of it, and whether the prediction held."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from scenarios.suite_catalogue import shipped as shipped_suites
from sim.analysis import formatting
from sim.analysis.ablation import difference_words, p_words, reference_rows, split_words
from sim.analysis.baseline import of_sweep, read_baseline
from sim.analysis.check import Comparison, compare, describe, replay_command
from sim.analysis.push_limits import PushLimit, push_limits
from sim.analysis.statistics import Rate, Row, grouped
from sim.analysis.summary import load_rows, summarise
from sim.analysis.summary_table import FEW, cases, condensed, ordered
from sim.analysis.thresholds import Threshold, thresholds
from sim.report.ablation_chart import ablation_picture
from sim.report.charts import heat_map, rate_curves, slack_plot
from sim.report.endurance_chart import survival_curves
from sim.report.envelope_chart import envelope
from sim.report.failures import Failure, Strip, film_strip, law_words, worst_failures
from sim.report.style import COLOURS, Picture
from sim.results.out_file import check_file, write_file
from sim.results.table import SUITE, read_sweep
from sim.results.train import each_push

REPORT = "report.html"
_TEMPLATE = "template.html"
_HOLES = 40  # shown at most
_MOMENTS = {"end": "at the end of the push", "decision": "when deciding"}


@dataclass(frozen=True, kw_only=True)
class ShownFailure:
    """A failure as the page shows it: which, why, in the sets' words, how to see it, and its frames."""

    title: str
    why: str
    reason: str
    sets: str
    command: str
    strip: Strip | None


def write_report(
    folder: Path,
    path: Path,
    *,
    baseline: Path | None = None,
    failures: int = 4,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write the report of a sweep's folder.

    Args:
        folder: of the sweep.
        path: file to write.
        baseline: file to compare with.
        failures: how many failures to run again and film.
        progress: called now and then with the fraction that is done.

    Raises:
        InputError: if the folder or the baseline cannot be read, they cannot be compared, or the file not be written.
    """
    check_file(path, "--out")
    comparison = None if baseline is None else compare(read_baseline(baseline), of_sweep(folder))
    rows, sweep = load_rows(folder), read_sweep(folder)
    shown = []
    for i, failure in enumerate(worst_failures(reference_rows(each_push(rows), sweep), failures)):
        shown.append(_shown(folder, failure, film_strip(failure.row)))
        if progress is not None:
            progress((i + 1) / (failures + 1))
    suite = folder / SUITE
    text = suite.read_text(encoding="utf-8") if suite.is_file() else ""
    page = render(folder, rows, sweep, suite_text=text, failures=shown, comparison=comparison, baseline=baseline)
    write_file(page.encode(), path, "--out")
    if progress is not None:
        progress(1.0)


def render(
    folder: Path,
    rows: Sequence[Row],
    sweep: dict[str, Any],
    *,
    suite_text: str,
    failures: Sequence[ShownFailure],
    comparison: Comparison | None,
    baseline: Path | None,
) -> str:
    """The page."""
    summary = summarise(rows, sweep)
    pushes = reference_rows(each_push(rows), sweep)
    for section in ("regions", "scores"):
        for one in summary["truth"][section]:
            one["group"] = f"{one['world']}, {one['controller']}, {_MOMENTS[one['moment']]}"
    robust = thresholds(rows)
    limits = push_limits(reference_rows(rows, sweep)) if robust else []
    environment = Environment(
        loader=PackageLoader("sim.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "percent": formatting.percent,
        "fraction": formatting.fraction,
        "case": formatting.case_words,
        "value": formatting.value_words,
        "median": formatting.median_words,
        "quartiles": formatting.quartile_words,
        "motor_lines": formatting.motor_lines,
        "difference": difference_words,
        "split": split_words,
        "chance": p_words,
    }
    environment.globals["fixed"] = formatting.fixed
    return environment.get_template(_TEMPLATE).render(
        folder=str(folder),
        summary=summary,
        suite_text=suite_text,
        suite_argument=summary["suite"] if summary["suite"] in shipped_suites() else f"{summary['suite']}.toml",
        controllers=ordered(summary["controllers"]),
        colours=COLOURS,
        tables=[_table(summary, case) for case in cases(summary)],
        by_case=condensed(summary),
        few=len(cases(summary)) <= FEW,
        envelopes=_envelopes(robust, limits) if len(cases(summary)) <= FEW else [],
        what="pushes" if summary["train"] else "episodes",
        first=None if summary["first"] is None else formatting.first_words(summary["first"]),
        motor_episodes=formatting.motor_episodes(summary),
        survival=survival_curves(summary["endurance"], summary["train"]) if summary["endurance"] else [],
        bars=None if summary["ablation"] is None else ablation_picture(summary["ablation"]),
        holes=summary["holes"][:_HOLES],
        heat_maps=_heat_maps(summary, robust),
        curves=rate_curves(_curves(rows, robust, summary)),
        rates=_rate_table(summary),
        direction_rates=_direction_rates(summary),
        slack_plots=[
            slack_plot(world, [row for row in pushes if row["world"] == world], section)
            for world, section in summary["truth"]["slack"].items()
            if section["n"]
        ],
        failures=failures,
        comparison=comparison,
        baseline=None if baseline is None else str(baseline),
        describe=describe,
        replay=lambda row: replay_command(folder, row),
    )


def _shown(folder: Path, failure: Failure, strip: Strip | None) -> ShownFailure:
    row = failure.row
    when = "" if row["time_of_fall"] is None else f" at {row['time_of_fall']:.2f} s"
    return ShownFailure(
        title=describe(row).removeprefix("episode "),
        why=failure.why,
        reason=f"{str(row['outcome']).replace('_', ' ')}{when}: {row['reason']}",
        sets=law_words(row),
        command=replay_command(folder, row),
        strip=strip,
    )


def _table(summary: dict[str, Any], case: dict[str, Any]) -> dict[str, Any]:
    entries = [entry for entry in summary["robust"] if entry.get("case", {}) == case]
    names = ordered({entry["controller"] for entry in entries})
    found = {(entry["controller"], entry["direction_deg"]): entry for entry in entries}
    directions = sorted({entry["direction_deg"] for entry in entries})
    robot = case.get("robot", summary["robots"][0])
    limits = {limit["direction_deg"]: limit for limit in summary["limits"] if limit["robot"] == robot}
    means = []
    for name in names:
        own = [entry for entry in entries if entry["controller"] == name]
        scales = ("delta_v", "over_omega_d", "over_sqrt_gh")
        values = {scale: [entry[scale] for entry in own if entry[scale] is not None] for scale in scales}
        condensed = {
            scale: (sum(found) / len(found), min(found)) if found else (None, None) for scale, found in values.items()
        }
        means.append({**condensed, "capped": (any(entry["capped"] for entry in own), False)})
    return {
        "case": case,
        "controllers": names,
        "lines": [
            {
                "direction": direction,
                "limit": limits.get(direction),
                "entries": [found.get((name, direction)) for name in names],
            }
            for direction in directions
        ],
        "means": means,
    }


def _envelopes(robust: Sequence[Threshold], limits: Sequence[PushLimit]) -> list[Picture]:
    by_case: dict[str, list[Threshold]] = {}
    for one in robust:
        by_case.setdefault(json.dumps(one.case), []).append(one)
    pictures = []
    for members in by_case.values():
        case = members[0].case
        names = {limit.robot for limit in limits}
        own = [limit for limit in limits if limit.robot == case.get("robot", limit.robot) or len(names) == 1]
        title = formatting.case_words(case)
        pictures.append(envelope(members, own, normalised=True, title=title))
        if len(by_case) == 1:
            pictures.append(envelope(members, own, normalised=False))
    return pictures


def _heat_maps(summary: dict[str, Any], robust: Sequence[Threshold]) -> list[Picture]:
    rates = [entry for entry in summary["rates"] if list(entry["by"]) == ["controller", "direction_deg", "delta_v"]]
    marks = robust if len(cases(summary)) == 1 else []
    return [heat_map(name, rates, marks) for name in ordered(summary["controllers"])]


def _curves(
    rows: Sequence[Row], robust: Sequence[Threshold], summary: dict[str, Any]
) -> dict[str, list[tuple[float, Rate]]]:
    """Recovery by size; the levels that an adaptive series never reached count as not recovered."""
    curves: dict[str, list[tuple[float, Rate]]] = {}
    ladder = [level for (level,) in grouped(rows, ["delta_v"])]
    # Not so where each direction has levels of its own, being of units of its omega d.
    if robust and all(list(one.levels) == ladder[: len(one.levels)] for one in robust):
        for name in {one.controller for one in robust}:
            own = [one for one in robust if one.controller == name]
            most = max(rate.n for one in own for rate in one.levels.values())
            for level in ladder:
                rates = [one.levels.get(level) or Rate(count=0, n=most) for one in own]
                total = Rate(count=sum(rate.count for rate in rates), n=sum(rate.n for rate in rates))
                curves.setdefault(name, []).append((level, total))
        return curves
    for entry in summary["rates"]:
        if list(entry["by"]) == ["controller", "delta_v"]:
            span = entry["by"]["delta_v"]
            level = 0.5 * (span[0] + span[1]) if isinstance(span, list) else float(span)
            point = (level, Rate(count=entry["count"], n=entry["n"]))
            curves.setdefault(entry["by"]["controller"], []).append(point)
    return curves


def _rate_table(summary: dict[str, Any]) -> list[dict[str, Any]]:
    """Rates by controller, and by controller and each other column that varies."""
    found = []
    for entry in summary["rates"]:
        names = list(entry["by"])
        others = [name for name in names if name != "controller"]
        if names and names[0] == "controller" and others not in (["direction_deg"], ["delta_v"]) and len(others) < 2:
            words = formatting.case_words({name: entry["by"][name] for name in others})
            found.append({"controller": entry["by"]["controller"], "what": words, **entry})
    order = ordered(summary["controllers"])
    return sorted(found, key=lambda entry: (len(entry["by"]), order.index(entry["controller"])))


def _direction_rates(summary: dict[str, Any]) -> list[tuple[float, list[dict[str, Any] | None]]]:
    found = {
        (entry["by"]["direction_deg"], entry["by"]["controller"]): entry
        for entry in summary["rates"]
        if list(entry["by"]) == ["controller", "direction_deg"]
    }
    names = ordered(summary["controllers"])
    return [(way, [found.get((way, name)) for name in names]) for way in sorted({way for way, _ in found})]
