"""One page that a reviewer can read: what was run, what came of it, and whether the prediction held."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from scenarios.suite_catalogue import shipped as shipped_suites
from sim.analysis.baseline import of_sweep, read_baseline
from sim.analysis.calibration import probabilities
from sim.analysis.calibration_files import calibrations_for
from sim.analysis.check import Comparison, compare, describe, replay_command
from sim.analysis.frame import each_push, load_rows, recovered, reference_rows
from sim.analysis.summary import summarise
from sim.presenter.formatting import case_words, degrees, fixed
from sim.presenter.overview import cards, facts
from sim.presenter.sections import sections
from sim.presenter.tables import Picture, Section, Table
from sim.presenter.threshold_section import FEW, cases
from sim.presenter.who import label, main_controller
from sim.report.ablation_chart import ablation_picture
from sim.report.calibration_chart import calibration_curve
from sim.report.charts import heat_maps, rate_curves, slack_plot
from sim.report.endurance_chart import survival_curves
from sim.report.envelope import envelopes
from sim.report.failures import film_strip, worst_failures
from sim.report.sight_chart import sight_plot
from sim.results.out_file import check_file, write_file
from sim.results.table import SUITE, read_sweep

REPORT = "report.html"
_TEMPLATE = "template.html"


def write_report(
    folder: Path, path: Path, *, baseline: Path | None = None, failures: int = 4, calibration: Path | None = None
) -> dict[str, Any]:
    """Write the report of a sweep's folder.

    Args:
        folder: of the sweep.
        path: file to write.
        baseline: file to compare with.
        failures: how many failures to run again and film.
        calibration: file of one; None for those of the checkout that fit.

    Returns:
        The summary that it tells.

    Raises:
        InputError: if the folder, the baseline or the calibration cannot be read, they cannot be compared, or the
            file not be written.
    """
    check_file(path, "--out")
    comparison = None if baseline is None else compare(read_baseline(baseline), of_sweep(folder))
    rows, sweep = load_rows(folder), read_sweep(folder)
    calibrations = calibrations_for(sweep, calibration)
    summary = summarise(rows, sweep, calibrations)
    pushes = reference_rows(each_push(rows), sweep)
    pushes = pushes.assign(probability=probabilities(pushes, calibrations))
    own = pushes[pushes["controller"] == main_controller(summary)]
    worst = worst_failures(own, failures)
    suite = folder / SUITE
    page = _template().render(
        folder=folder,
        summary=summary,
        suite_text=suite.read_text(encoding="utf-8") if suite.is_file() else "",
        suite_argument=_asked(summary),
        cards=cards(summary),
        facts=facts(summary),
        sections=_illustrated(summary, pushes),
        failures=[(failure, film_strip(failure.row)) for failure in worst],
        no_failure=_no_failure(summary, own, failures),
        comparison=comparison,
        shifts=None if comparison is None or not comparison.shifts else _shifts(comparison),
        baseline=baseline,
        colours=_colours(summary),
        describe=describe,
        replay=lambda row: replay_command(folder, row),
    )
    write_file(page.encode(), path, "--out")
    return summary


def _asked(summary: dict[str, Any]) -> str:
    """The suite and what was replaced of it, as they are typed."""
    suite = summary["suite"] if summary["suite"] in shipped_suites() else f"{summary['suite']}.toml"
    world = ["--world", summary["world"]] if summary["world"] else []
    return shlex.join([suite, *(summary["options"] or []), *world])


def _template() -> Any:
    environment = Environment(
        loader=PackageLoader("sim.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(_TEMPLATE)


def _illustrated(summary: dict[str, Any], pushes: pd.DataFrame) -> Sequence[Section]:
    """The sections with their pictures, of each robot."""
    parts = summary["by_robot"] or {"": summary}
    pictures = {
        robot: _pictures(part, pushes[pushes["robot"] == robot] if robot else pushes) for robot, part in parts.items()
    }
    return [replace(one, pictures=tuple(pictures[one.robot].get(one.key, ()))) for one in sections(summary)]


def _pictures(summary: dict[str, Any], pushes: pd.DataFrame) -> dict[str, list[Picture]]:
    """The pictures of each section."""
    slack = summary["prediction_score"]["slack"]
    return {
        "endurance": survival_curves(summary),
        "ablation": [ablation_picture(summary["ablation"])] if summary["ablation"] else [],
        "thresholds": envelopes(summary) if len(cases(summary)) <= FEW else [],
        "recovered": [*heat_maps(summary), rate_curves(summary)],
        "sight": sight_plot(pushes),
        "prediction": [
            slack_plot(world, pushes[pushes["world"] == world], part) for world, part in slack.items() if part["n"]
        ]
        + [calibration_curve(summary, one) for one in summary["prediction_score"]["probability"]],
    }


def _colours(summary: dict[str, Any]) -> dict[str, str]:
    """What a cell begins with, before a comma -> its colour."""
    return {look["label"]: look["colour"] for look in summary["controllers_shown"].values()}


def _no_failure(summary: dict[str, Any], pushes: pd.DataFrame, asked: int) -> str:
    """Why no failure is shown, if none is: of whom, and of what."""
    main, n, well = label(summary, main_controller(summary)), len(pushes), recovered(pushes).sum()
    who = f"“{summary['ablation']['reference']}” ({main})" if summary["ablation"] else main
    if not n:
        return f"None: {who} has not been pushed yet."
    if well == n:
        return f"None: {who} recovered from all of its {n} pushes."
    return f"None is shown, for {asked} were asked for: {who} did not recover from {n - well} of its {n} pushes."


def _shifts(comparison: Comparison) -> Table:
    rows = (
        {
            "controller": ", ".join(filter(None, (one.after.controller, case_words(one.after.case)))),
            "direction": degrees(one.after.direction_deg),
            "before": fixed(one.before.delta_v, capped=one.before.capped),
            "now": fixed(one.after.delta_v, capped=one.after.capped),
            "steps": f"{one.levels:+d}",
        }
        for one in comparison.shifts
    )
    return Table(title="Thresholds that moved, Δv [m/s]", rows=tuple(rows))
