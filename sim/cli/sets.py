"""The commands about the sets: figures, sets, and identify, which measures what they assume."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError
from sim.cli.numbers import not_negative, number, several
from sim.cli.scenario_option import open_scenario
from sim.cli.terminal import progress_bar


def register(app: typer.Typer) -> None:
    """Add `okiagari figures`, `okiagari sets` and `okiagari identify` to the program."""
    app.command(epilog="Example: okiagari identify push_diagonal --set sensing.preset=typical")(identify)

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


def identify(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario (okiagari list), or a .toml file.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="A .toml file for the figures that the sets should use, or a .json file for all that was "
            "measured; a picture of the same name is put beside it."
        ),
    ] = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Change a field, dotted; may be given several times."),
    ] = None,
    seeds: Annotated[
        int, typer.Option(parser=several, metavar="N", help="Episodes of each kind; the intervals are over them.")
    ] = 4,
    amplitude: Annotated[
        float,
        typer.Option(
            parser=number, metavar="SHARE", help="Peak of the sway, of the way to the soles' edge; 0.01 to 0.5."
        ),
    ] = 0.25,
    as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False,
) -> None:
    """Sway the standing robot, measure how its ZMP follows and its feedback, and say which zmp_error the sets need."""
    from scenarios.catalogue import find
    from sim.identify.identify import identify as measured
    from sim.identify.picture import draw
    from sim.identify.short_form import short_form
    from sim.presenter.identify_section import identify_sections, line_to_use
    from sim.presenter.render import print_sections, terminal
    from sim.results.out_file import check_file, write_file

    if not 0.01 <= amplitude <= 0.5:
        raise InputError(f"--amplitude: {amplitude!r} must be from 0.01 to 0.5")
    if out is not None:
        if out.suffix not in (".toml", ".json"):
            raise InputError(f"--out: {str(out)!r} must end in .toml or .json")
        check_file(out, "--out")
        check_file(out.with_suffix(".png"), "--out")
    chosen = open_scenario(scenario, {}, assignments or ())
    try:
        with progress_bar("simulating", 1.0) as advance:
            report = measured(chosen, seeds=seeds, amplitude=amplitude, progress=advance)
    except InputError as error:
        raise InputError(f"{find(scenario)}: {error}") from error
    full = json.dumps(report, indent=1)
    if out is not None:
        write_file((full + "\n" if out.suffix == ".json" else short_form(report)).encode(), out, "--out")
        write_file(draw(report), out.with_suffix(".png"), "--out")
    if as_json:
        print(full)
        return
    print_sections(identify_sections(report))
    terminal().print(line_to_use(report, scenario), markup=False)
    for path in () if out is None else (out, out.with_suffix(".png")):
        print(path)
