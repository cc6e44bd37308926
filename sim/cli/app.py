"""The program: its commands, and how it ends."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from models.errors import InputError
from sim.cli import ablation, adopt, check, film, listing, policy, report, run, sets, sweep
from sim.cli.terminal import make_printable
from sim.record.versions import commit, versions

# What takes long to import (physics, solvers, pictures) is imported by the command that needs it.

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Push a humanoid and see whether it stays on its feet.

    A scenario says who is pushed, when, where and how hard; a run leaves a folder with the trace of every control
    tick, the outcome, the decisions and their grounds, a figure and a video.

    [bold]okiagari list[/bold]   which scenarios there are

    [bold]okiagari run three_pushes[/bold]   the paper's experiment on a whole humanoid

    [bold]okiagari run three_pushes --world pendulum[/bold]   on its model alone, as in the paper

    [bold]okiagari run three_pushes --controller regulator[/bold]   the same pushes without stepping

    [bold]okiagari sets three_pushes[/bold]   how hard a push the robot can take, and how hard one could be

    [bold]okiagari figures[/bold]   the paper's figures of the sets
    """,
)

# click's error of a wrong command line, wherever this version of typer keeps it.
_UsageError: type[BaseException] = typer.BadParameter.__base__ or Exception

# Exit code of whoever was stopped by Ctrl-C; typer may turn that into the code on its own.
_INTERRUPTED = 130
# What is true of a command that was stopped; of all others, that they have written nothing.
_STOPPED = dict.fromkeys(("sweep", "ablation", "hardest"), "the same command goes on where it was")


@app.callback(invoke_without_command=True)
def _program(
    version: Annotated[bool, typer.Option("--version", help="Print version and commit, and do nothing else.")] = False,
) -> None:
    if version:
        print(f"okiagari {versions()['okiagari']}, commit {commit()}")
        raise typer.Exit


for _commands in (run, film, listing, adopt, policy, sets, sweep, ablation, report, check):
    _commands.register(app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None takes those of the process.

    Returns:
        0, or 2 if what was asked cannot be done, or 130 after Ctrl-C; then one line on stderr says why.
    """
    make_printable()
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(args=arguments, prog_name="okiagari", standalone_mode=False)
    except InputError as error:
        return _refuse(str(error))
    except _UsageError as error:
        message = error.format_message() if hasattr(error, "format_message") else str(error)
        return _refuse(message)
    except (typer.Abort, KeyboardInterrupt):
        code = _INTERRUPTED
    if code == _INTERRUPTED:
        why = _STOPPED.get(next(iter(given), ""), "nothing was written")
        print(f"okiagari: stopped; {why}", file=sys.stderr)
    return code if isinstance(code, int) else 0


def _refuse(message: str) -> int:
    # Of a choice, typer passes on how pydantic begins a message.
    line = " ".join(message.split()).replace(": Value error, ", ": ")
    if line:  # a bare `okiagari` has shown its help instead
        print(f"okiagari: {line}", file=sys.stderr)
    return 2
