"""The command line of comparisons, and of single episodes: check, compare, episodes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from sim.cli.report import CalibrationOption

if TYPE_CHECKING:
    from sim.analysis.baseline import Baseline
    from sim.analysis.check import Comparison

# What takes long to import (statistics) is imported by the command that needs it.

_Json = Annotated[bool, typer.Option("--json", help="For machines.")]
_Junit = Annotated[Path | None, typer.Option(metavar="FILE", help="Write it for a build server, too.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog="Example: okiagari check out/sweep-smoke --baseline baselines/smoke.json --junit out/check.xml")(
        check
    )
    app.command(epilog="Example: okiagari compare out/sweep-smoke out/two-steps")(compare)
    app.command(epilog="Example: okiagari episodes out/sweep-smoke --fell")(episodes)


def check(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    baseline: Annotated[Path, typer.Option(metavar="FILE", help="What to hold the sweep to.")],
    junit: _Junit = None,
    as_json: _Json = False,
) -> None:
    """Compare a sweep with a baseline, push by push; exit code 1 if recovery got worse beyond chance."""
    from sim.analysis.baseline import read_baseline

    _compare(read_baseline(baseline), folder, junit, as_json=as_json)


def compare(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Folder of a sweep.")],
    folder: Annotated[Path, typer.Argument(metavar="AFTER", help="Folder of another one of the same suite.")],
    junit: _Junit = None,
    as_json: _Json = False,
) -> None:
    """Compare two sweeps of a suite, push by push; exit code 1 if the second is worse beyond chance."""
    from sim.analysis.baseline import of_sweep

    _compare(of_sweep(before), folder, junit, as_json=as_json)


def _compare(then: Baseline, folder: Path, junit: Path | None, *, as_json: bool) -> None:
    from sim.analysis import check as analysis
    from sim.analysis.baseline import of_sweep
    from sim.results.out_file import check_file, write_file

    if junit is not None:
        check_file(junit, "--junit")
    result = analysis.compare(then, of_sweep(folder))
    if junit is not None:
        write_file(analysis.junit(result, then), junit, "--junit")
    if as_json:
        print(json.dumps(analysis.as_dict(result), indent=1))
    else:
        _print(result, then, folder)
    if result.worse:
        raise typer.Exit(1)


def episodes(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    fell: Annotated[bool, typer.Option("--fell", help="Only those that were not recovered.")] = False,
    controller: Annotated[str | None, typer.Option(metavar="NAME", help="Only this controller's.")] = None,
    calibration: CalibrationOption = None,
    as_json: _Json = False,
) -> None:
    """List the episodes of a sweep with their names, what was asked, how they ended, and how to see them again."""
    from models.errors import InputError
    from sim.analysis.calibration import probabilities
    from sim.analysis.calibration_files import calibrations_for
    from sim.analysis.frame import load_rows, records
    from sim.presenter.episode_section import episode_section
    from sim.presenter.render import print_sections
    from sim.results.table import read_sweep

    table = load_rows(folder)
    told = probabilities(table, calibrations_for(read_sweep(folder), calibration))
    rows: list[dict[str, Any]] = records(table.assign(probability=told))
    names = list(dict.fromkeys(row["controller"] for row in rows))
    if controller is not None and controller not in names:
        raise InputError(
            f"--controller: {controller!r} has no episodes in {str(folder)!r}; allowed: {', '.join(names)}"
        )
    rows = [row for row in rows if controller in (None, row["controller"])]
    rows = [row for row in rows if not fell or row["outcome"] != "recovered"]
    if as_json:
        print(json.dumps(rows, indent=1, default=str))
    else:
        print_sections([episode_section(rows, folder)])


def _print(result: Comparison, then: Baseline, folder: Path) -> None:
    from sim.analysis.check import describe, replay_command

    console = Console(highlight=False, soft_wrap=True, markup=False)
    colour, verdict = ("red", "worse") if result.worse else ("green", "not worse")
    console.print(verdict, style=f"bold {colour}", end="")
    console.print(
        f" than the baseline of {then.commit[:12]}: {result.counts}; "
        f"{len(result.lost)} lost, {len(result.gained)} gained, exact McNemar p = {result.p:.3g}"
    )
    for name, (before, after) in result.versions.items():
        console.print(f"  {name} {before} then, {after} now")
    if result.unpaired:
        console.print(f"  {result.unpaired} episodes that the baseline does not have were left out")
    for shift in result.shifts:
        console.print(f"  {shift.whose}: {shift.words}", end="")
        console.print(" more than one step" if shift.dropped else "", style="red")
    if result.lost:
        console.print("fewer pushes survived:" if result.trains else "no longer recovered:")
    for row in result.lost:
        if row["episode"] in result.unreached:
            console.print(f"  {describe(row)}: not run again, its series had failed before it")
        else:
            console.print(f"  {describe(row)}\n    {replay_command(folder, row)}")
