"""The command that checks a policy's adapter: policy."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from models.errors import InputError
from scenarios.catalogue import find
from sim.cli.numbers import seconds as length
from sim.cli.scenario_option import open_scenario
from sim.cli.terminal import progress_bar

# What takes long to import (physics, solvers) is imported by the command that needs it.


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(epilog="Example: okiagari policy t1.toml --seconds 20")(policy)


def policy(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario (okiagari list), or a .toml file.")],
    seconds: Annotated[float, typer.Option(parser=length, metavar="S", help="How long to let it stand.")] = 10.0,
    as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False,
) -> None:
    """Let a controller at joint level stand unpushed; show what it is given and answers; exit code 1 if it falls."""
    from sim.policy_check.policy_report import policy_report
    from sim.presenter.policy_section import policy_section, verdict
    from sim.presenter.render import print_sections, terminal

    chosen = open_scenario(scenario, {"pushes": [], "duration": seconds})
    try:
        with progress_bar("simulating", chosen.duration) as progress:
            report = policy_report(chosen, progress)
    except InputError as error:
        raise InputError(f"{find(scenario)}: {error}") from error
    if as_json:
        print(json.dumps(report, indent=1))
    else:
        print_sections([policy_section(report)])
        terminal().print(verdict(report), markup=False)
    if not report["stands"]:
        raise typer.Exit(1)
