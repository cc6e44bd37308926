"""The command line of the films of a sweep's hardest pushes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError
from sim.cli.report import tell_unfinished
from sim.cli.terminal import progress_bar


def register(app: typer.Typer) -> None:
    """Add the command to the program."""

    @app.command(epilog="Example: okiagari hardest out/sweep-trunk_push --out docs/hardest")
    def hardest(
        folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep with thresholds.")],
        out: Annotated[
            Path | None, typer.Option(metavar="FOLDER", help="Folder to write.", show_default="DIR/hardest")
        ] = None,
        controller: Annotated[
            str | None, typer.Option(help="Who answers.", show_default="the first that is shown")
        ] = None,
        case: Annotated[str | None, typer.Option(metavar="WORDS", help="Which case, if the suite has several.")] = None,
    ) -> None:
        """Film the hardest robust push of each direction: hardest_090.mp4, and a strip of frames hardest_090.png.

        Each is run again from the sweep's row, and it is said whether every bit came back. What is filmed already is
        skipped.
        """
        from sim.analysis.frame import load_rows
        from sim.report.hardest import film_hardest, hardest_pushes
        from sim.results.table import read_sweep
        from sim.viz.video import missing_renderer

        rows, sweep = load_rows(folder, all_columns=True), read_sweep(folder)
        pushes = hardest_pushes(rows, sweep, controller, case)
        tell_unfinished(len(rows), sweep)
        note = missing_renderer()
        if note:
            raise InputError(note)
        target = out if out is not None else folder / "hardest"
        with progress_bar("filming", len(pushes)) as bar:
            for push, words in film_hardest(folder, target, pushes, bar):
                print(f"{target / push.name}.mp4  {push.words}; {words}", flush=True)
