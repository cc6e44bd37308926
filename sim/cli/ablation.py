"""The command line of the ablation: run it, or show one that has been run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError
from scenarios.suite_catalogue import load_suite
from sim.cli.numbers import positive
from sim.cli.report import tell_unfinished
from sim.cli.sweep import run_suite

# What takes long to import (statistics, pictures) is imported by the command that needs it.


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(
        epilog="""Examples:

    okiagari ablation

    okiagari ablation --suite my_variants.toml --out out/mine

    okiagari ablation out/mine --picture docs/ablation.svg
    """
    )(ablation)


def ablation(
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="Folder of a sweep, to show as it is.", show_default="run it")
    ] = None,
    suite: Annotated[
        str | None,
        typer.Option(help="A suite with variants: its name or .toml file.", show_default="ablation"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to run it in.", show_default="out/sweep-SUITE")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(parser=positive, metavar="N", help="Processes.", show_default="one a core")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Bars, .png or .svg.", show_default="DIR/ablation.png")
    ] = None,
) -> None:
    """Say what each part of the controller is worth: run a suite's variants, print their table in Markdown, draw it.

    The same command goes on where it was stopped. With DIR nothing is run: what that sweep has so far is shown.
    """
    from sim.report.ablation_chart import ABLATION, write_ablation
    from sim.report.style import check_picture

    if picture is not None:
        check_picture(picture, "--picture")
    for name, value in (("suite", suite), ("out", out), ("workers", workers)):
        if folder is not None and value is not None:
            raise InputError(f"--{name}: nothing is run for a folder that is given; give only one of it and DIR")
    from sim.results.table import read_sweep

    if folder is not None:
        sweep = read_sweep(folder)
        if not sweep.get("variants"):
            raise InputError(f"{str(folder)!r} is of the suite {sweep.get('name')!r}, which has no variants to compare")
    else:
        loaded = load_suite(suite or "ablation")
        if loaded.suite.variants is None:
            raise InputError(f"{loaded.path}: variants: is missing; an ablation compares them")
        folder = out if out is not None else Path("out") / f"sweep-{loaded.name}"
        run_suite(loaded, folder, workers=workers)

    from sim.analysis.summary import write_summary
    from sim.presenter.render import markdown
    from sim.presenter.sections import ablation_table

    summary = write_summary(folder)
    section = summary["ablation"]
    path = picture if picture is not None else folder / ABLATION
    write_ablation(section, path)
    print(markdown(ablation_table(section)))
    tell_unfinished(summary["episodes"], read_sweep(folder))
    print(path, file=sys.stderr)
