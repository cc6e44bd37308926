"""The command line as its tests call it."""

from __future__ import annotations

from sim.cli.app import app


def call(*arguments: object) -> int:
    """The exit code; errors of the user come through as the program's own line would tell them."""
    code = app(args=[str(argument) for argument in arguments], prog_name="okiagari", standalone_mode=False)
    return code if isinstance(code, int) else 0
