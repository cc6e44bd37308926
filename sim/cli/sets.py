"""The commands about the sets alone: figures and sets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError
from sim.cli.numbers import not_negative
from sim.cli.scenario_option import open_scenario
from sim.cli.terminal import progress_bar


def register(app: typer.Typer) -> None:
    """Add `okiagari figures` and `okiagari sets` to the program."""

    @app.command(epilog="Example: okiagari figures --out out/paper")
    def figures(
        out: Annotated[
            Path,
            typer.Option(help="Folder for fig2.png to fig7.png, steps.png and figures.json; same names are replaced."),
        ] = Path("out/figures"),
        robot: Annotated[str, typer.Option(help="Name of a shipped robot, or an .xml file.")] = "utmu2",
    ) -> None:
        """Draw the paper's figures of the sets and the N-step sets, with the numbers behind them."""
        from models.robot import load_robot
        from sim.record.places import made_parents, real_path
        from sim.set_study.figures import NUMBERS, PICTURES, draw_set_figures

        body = load_robot(robot)
        folder = real_path(out, "--out")
        if folder.exists() and not folder.is_dir():
            raise InputError(f"--out: {str(out)!r} is not a folder")
        with made_parents(folder / NUMBERS, "--out"), progress_bar("drawing", 1.0) as advance:
            draw_set_figures(folder, body, progress=advance)
        for name in (*PICTURES, NUMBERS):
            print(out / name)

    @app.command(epilog="Example: okiagari sets three_pushes --zmp-error 0.005 --delay 0.004")
    def sets(
        scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario (okiagari list), or a .toml file.")],
        zmp_error: Annotated[
            float,
            typer.Option(
                parser=not_negative, metavar="M", help="Show, too, the sets that withstand such errors of the ZMP."
            ),
        ] = 0.0,
        delay: Annotated[
            float,
            typer.Option(parser=not_negative, metavar="S", help="Show, too, the regulators' sets with so late a ZMP."),
        ] = 0.0,
        as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False,
    ) -> None:
        """Print the sets of a scenario: rows, certificate, and how hard a push they hold, in eight directions."""
        from sim.presenter.render import print_sections
        from sim.presenter.set_sections import set_sections
        from sim.set_study.set_report import set_report

        chosen = open_scenario(scenario, {})
        with progress_bar("computing", 1.0) as advance:
            report = set_report(chosen, zmp_error=zmp_error, delay=delay, progress=advance)
        if as_json:
            print(json.dumps(report, indent=1))
        else:
            print(chosen.description)
            print_sections(set_sections(report))
