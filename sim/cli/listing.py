"""The command line of what is shipped: list."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from scenarios.catalogue import load, shipped


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("list")(list_scenarios)


def list_scenarios(as_json: Annotated[bool, typer.Option("--json", help="For machines.")] = False) -> None:
    """List the shipped scenarios."""
    found = {name: load(name).description for name in shipped()}
    if as_json:
        print(json.dumps(found, indent=1))
        return
    from sim.presenter.render import print_sections
    from sim.presenter.tables import Section, Table

    rows = tuple({"scenario": name, "what happens": description} for name, description in found.items())
    print_sections([Section(key="list", heading="Scenarios", tables=(Table(title="Scenarios", rows=rows),))])
