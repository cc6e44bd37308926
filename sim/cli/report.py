"""The command line of what is concluded from a sweep: summary, report, calibrate, envelope, baseline."""

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
CalibrationOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Of 'okiagari calibrate': how likely a push is recovered from, and so which is called safe.",
        show_default="baselines/calibration-*.json of the checkout, where they fit",
    ),
]
"""Which calibration gives the probabilities."""


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog="Example: okiagari summary out/sweep-smoke")(summary)
    app.command(
        epilog="""Examples:

    okiagari report out/sweep-trunk_push

    okiagari report out/sweep-smoke --baseline baselines/smoke.json --failures 0
    """
    )(report)
    app.command(epilog="Example: okiagari calibrate out/sweep-calibration --out baselines/calibration-utmu2.json")(
        calibrate
    )
    app.command(
        epilog="""Examples:

    okiagari envelope out/sweep-trunk_push --out docs/envelope.png

    okiagari envelope out/exact out/typical --label exact --label typical --out out/both.png
    """
    )(envelope)
    app.command(epilog="Example: okiagari baseline out/sweep-smoke --out baselines/smoke.json")(baseline)


def tell_unfinished(episodes: int, sweep: Mapping[str, Any]) -> None:
    """Say on stderr that a sweep is not finished, if it is not: what is shown of it may change."""
    if sweep.get("finished") != episodes:
        print(f"okiagari: not finished: {episodes} of {sweep.get('planned')} episodes", file=sys.stderr)


def summary(
    folder: _Folder,
    calibration: CalibrationOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False,
) -> None:
    """Print thresholds, rates and the score of the prediction, and write them to DIR/summary.json."""
    from sim.analysis.summary import SUMMARY, summary_of, write_summary
    from sim.presenter.render import print_sections
    from sim.presenter.sections import sections
    from sim.results.table import read_sweep

    made = write_summary(folder, summary_of(folder, calibration))
    if as_json:
        print((folder / SUMMARY).read_text(encoding="utf-8"), end="")
        return
    print_sections(sections(made))
    tell_unfinished(made["episodes"], read_sweep(folder))
    print(folder / SUMMARY)


def report(
    folder: _Folder,
    baseline: Annotated[Path | None, typer.Option(metavar="FILE", help="Baseline to compare with.")] = None,
    calibration: CalibrationOption = None,
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
        summary = write_report(folder, path, baseline=baseline, failures=failures, calibration=calibration)
    write_summary(folder, summary)
    print(path)


def envelope(
    folder: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folder of a sweep, or of several.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Picture, .png or .svg.", show_default="DIR/envelope.png, of the first"),
    ] = None,
    case: Annotated[str | None, typer.Option(metavar="WORDS", help="Which case, if the suite has several.")] = None,
    name: Annotated[
        list[str] | None,
        typer.Option("--label", metavar="WORDS", help="What each of several sweeps is called, in their order."),
    ] = None,
) -> None:
    """Draw the robust thresholds around the robot, and print them as a table in Markdown.

    Of several cases, robots for instance, --case draws one; without it and --out, one table of all is printed. Several
    sweeps of one suite, run with other --set for instance, are laid over each other.
    """
    from sim.analysis.summary import summary_of, write_summary
    from sim.presenter.render import markdown
    from sim.presenter.threshold_section import cases, cases_table, envelope_table, together_table
    from sim.report.envelope import ENVELOPE, chosen_case, write_envelope
    from sim.report.envelopes_together import read_named, shared, write_together
    from sim.results.table import read_sweep

    first, *others = folder
    path = out if out is not None else first / ENVELOPE
    if others:
        labels = name or [each.name for each in folder]
        if len(labels) != len(folder):
            raise InputError(f"--label: {len(labels)} for {len(folder)} sweeps; give one for each, or none")
        if case is not None:
            raise InputError("--case: does nothing with several sweeps, which must have one case each")
        sweeps = [read_named(label, each) for label, each in zip(labels, folder, strict=True)]
        write_together(sweeps, path)
        both = shared(sweeps)
        print(markdown(together_table([(one.name, one.summary) for one in sweeps], both)))
        if left_out := sorted({who for one in sweeps for who in one.summary["controllers"]} - {*both}):
            print(f"okiagari: left out, for not all of the sweeps have them: {', '.join(left_out)}", file=sys.stderr)
        for each, one in zip(folder, sweeps, strict=True):
            tell_unfinished(one.summary["episodes"], read_sweep(each))
        print(path, file=sys.stderr)
        return
    if name:
        raise InputError("--label: does nothing with a single sweep")
    summary = summary_of(first)
    if case is None and out is None and len(cases(summary)) > 1:
        print(markdown(cases_table(write_summary(first, summary))))
        tell_unfinished(summary["episodes"], read_sweep(first))
        return
    shown = chosen_case(summary, case)
    write_envelope(summary, shown, path)
    print(markdown(envelope_table(write_summary(first, summary), shown)))
    tell_unfinished(summary["episodes"], read_sweep(first))
    print(path, file=sys.stderr)


def calibrate(
    folder: _Folder,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write.")],
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Of a suite that is held out, or has a seed below 1000, too.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file if there is one.")] = False,
) -> None:
    """Fit how likely recovery is by the slacks at the end of a push, and write it to a small text file."""
    from sim.analysis.calibration import calibrate as fit
    from sim.analysis.calibration_files import as_text
    from sim.presenter.prediction_section import model_words
    from sim.results.out_file import write_file

    _check_new(out, overwrite=overwrite)
    made = fit(folder, anyway=anyway)
    write_file(as_text(made).encode(), out, "--out")
    for model in made.models:
        print(model_words(model))
    print(out)


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

    made = of_sweep(folder)
    path = out if out is not None else Path("baselines") / f"{made.suite}.json"
    _check_new(path, overwrite=overwrite)
    write_baseline(made, real_path(path, "--out"))
    print(path)


def _check_new(path: Path, *, overwrite: bool) -> None:
    """Refuse what cannot be written, or would replace a file unasked; raises `InputError`."""
    from sim.results.out_file import check_file

    check_file(path, "--out")
    if path.exists() and not overwrite:
        raise InputError(f"--out: {str(path)!r} is there already; name another file or pass --overwrite")
