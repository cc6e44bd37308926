"""The commands about the sets alone: figures and sets."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from models.errors import InputError
from sim.cli.numbers import not_negative

if TYPE_CHECKING:
    from scenarios.schema import Scenario

ProgressBar = Callable[[str, float], AbstractContextManager[Callable[[float], None] | None]]


def register(
    app: typer.Typer, open_scenario: Callable[[str, dict[str, object]], Scenario], progress: ProgressBar
) -> None:
    """Add `okiagari figures` and `okiagari sets`.

    Args:
        app: the command line.
        open_scenario: loads and checks a scenario, given its name and overrides.
        progress: opens a bar, given what is done and how much of it there is.
    """

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
        from sim.set_study.figures import NUMBERS, PICTURES, draw_set_figures

        body = load_robot(robot)
        if out.exists() and not out.is_dir():
            raise InputError(f"--out: {str(out)!r} is not a folder")
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"--out: {str(out)!r} cannot be made: {error.strerror}") from None
        with progress("drawing", 1.0) as advance:
            draw_set_figures(out, body, progress=advance)
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
        with progress("computing", 1.0) as advance:
            report = set_report(chosen, zmp_error=zmp_error, delay=delay, progress=advance)
        if as_json:
            print(json.dumps(report, indent=1))
        else:
            print(chosen.description)
            print_sections(set_sections(report))
