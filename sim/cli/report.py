"""The command line of what is concluded from a sweep: summary, report, envelope, baseline."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from models.errors import InputError
from sim.cli.numbers import whole

# What takes long to import (statistics, pictures) is imported by the command that needs it.

_Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog="Example: okiagari summary out/sweep-smoke")(summary)
    app.command(
        epilog="""Examples:

    okiagari report out/sweep-trunk_push

    okiagari report out/sweep-smoke --baseline baselines/smoke.json --failures 0
    """
    )(report)
    app.command(epilog="Example: okiagari envelope out/sweep-trunk_push --out docs/envelope.png")(envelope)
    app.command(epilog="Example: okiagari baseline out/sweep-smoke --out baselines/smoke.json")(baseline)


def tell_unfinished(episodes: int, sweep: Mapping[str, Any]) -> None:
    """Say on stderr that a sweep is not finished, if it is not: what is shown of it may change."""
    if sweep.get("finished") != episodes:
        print(f"okiagari: not finished: {episodes} of {sweep.get('planned')} episodes", file=sys.stderr)


def summary(folder: _Folder, as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False) -> None:
    """Print thresholds, rates and the score of the prediction, and write them to DIR/summary.json."""
    from sim.analysis.summary import SUMMARY, write_summary
    from sim.presenter.render import print_sections
    from sim.presenter.sections import sections
    from sim.results.table import read_sweep

    made = write_summary(folder)
    if as_json:
        print((folder / SUMMARY).read_text(encoding="utf-8"), end="")
        return
    print_sections(sections(made))
    tell_unfinished(made["episodes"], read_sweep(folder))
    print(folder / SUMMARY)


def report(
    folder: _Folder,
    baseline: Annotated[Path | None, typer.Option(metavar="FILE", help="Baseline to compare with.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write.", show_default="DIR/report.html")
    ] = None,
    failures: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Failures to run again and show frames of.")
    ] = 4,
) -> None:
    """Write one page, complete in itself, that says what was run and what came of it."""
    from sim.analysis.summary import write_summary
    from sim.report.report import REPORT, write_report

    path = out if out is not None else folder / REPORT
    with Console(stderr=True).status("writing the report"):
        write_report(folder, path, baseline=baseline, failures=failures)
    write_summary(folder)
    print(path)


def envelope(
    folder: _Folder,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Picture, .png or .svg.", show_default="DIR/envelope.png"),
    ] = None,
    case: Annotated[str | None, typer.Option(metavar="WORDS", help="Which case, if the suite has several.")] = None,
) -> None:
    """Draw the robust thresholds around the robot, and print them as a table in Markdown."""
    from sim.analysis.summary import summary_of, write_summary
    from sim.presenter.render import markdown
    from sim.presenter.threshold_section import envelope_table
    from sim.report.envelope import ENVELOPE, chosen_case, write_envelope
    from sim.results.table import read_sweep

    path = out if out is not None else folder / ENVELOPE
    summary = summary_of(folder)
    shown = chosen_case(summary, case)
    write_envelope(summary, shown, path)
    print(markdown(envelope_table(write_summary(folder, summary), shown)))
    tell_unfinished(summary["episodes"], read_sweep(folder))
    print(path, file=sys.stderr)


def baseline(
    folder: _Folder,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File to write.", show_default="baselines/SUITE.json")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file if there is one.")] = False,
) -> None:
    """Write the outcomes of a sweep to a small text file, to be reviewed and committed."""
    from sim.analysis.baseline import of_sweep, write_baseline
    from sim.record.places import real_path
    from sim.results.out_file import check_file

    made = of_sweep(folder)
    path = out if out is not None else Path("baselines") / f"{made.suite}.json"
    check_file(path, "--out")
    if path.exists() and not overwrite:
        raise InputError(f"--out: {str(path)!r} is there already; name another file or pass --overwrite")
    write_baseline(made, real_path(path, "--out"))
    print(path)
