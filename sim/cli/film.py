"""The command line of films: render, and hardest of a sweep; and pages in 3-D, for replay."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from models.errors import InputError
from sim.cli.numbers import not_negative, number
from sim.cli.report import tell_unfinished
from sim.cli.terminal import progress_bar
from sim.episode import run_folder

if TYPE_CHECKING:
    from sim.record.trace import Trace

# What takes long to import (pictures) is imported by the command that needs it.


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(epilog="Example: okiagari render out/three_pushes-humanoid --camera side --slow 4 --from 9 --to 10.5")(
        render
    )
    app.command(epilog="Example: okiagari hardest out/sweep-trunk_push --out docs/hardest")(hardest)


def why_no_video() -> str | None:
    """Why this machine cannot draw, in words that name the package; None if it can."""
    from sim.viz.video import missing_renderer

    return missing_renderer()


def render(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    camera: Annotated[str, typer.Option(help="three_quarter, side, front or top.")] = "three_quarter",
    size: Annotated[str, typer.Option(metavar="WxH", help="Of a frame, in pixels.")] = "640x480",
    fps: Annotated[float, typer.Option(parser=number, metavar="N", help="Frames a second.")] = 60.0,
    slow: Annotated[float, typer.Option(parser=number, metavar="X", help="4 plays at a quarter of the speed.")] = 1.0,
    begin: Annotated[
        float | None, typer.Option("--from", parser=not_negative, metavar="S", help="Of the run.", show_default="0")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", parser=not_negative, metavar="S", help="Of the run.", show_default="its end")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Video to write.", show_default="DIR/video.mp4")
    ] = None,
) -> None:
    """Film a run again from its trace, without simulating: replaces the video in its folder, or writes --out."""
    match = re.fullmatch(r"(\d+)x(\d+)", size)
    if match is None:
        raise InputError(f"--size: {size!r} is not of the form WxH, for instance 1280x720")
    if not os.path.isdir(folder):  # False, too, for a name that no system can have
        raise InputError(f"{str(folder)!r} is not a folder; it must be the folder of a run")
    from sim.record.places import made_parents, real_path
    from sim.record.trace import load_trace
    from sim.results.out_file import check_file

    trace = load_trace(folder / run_folder.TRACE)
    path = out if out is not None else folder / run_folder.VIDEO
    check_file(path, "--out")
    if path.suffix != ".mp4":
        raise InputError(f"--out: {str(path)!r} must end with .mp4")
    span = _span(begin, end, float(trace.time[-1]))
    note = why_no_video()
    if note:
        raise InputError(note)
    from sim.viz.video import render_episode

    real = real_path(path, "--out")
    frame = (int(match[1]), int(match[2]))
    with made_parents(real, "--out"), progress_bar("filming", 1.0) as progress:
        render_episode(trace, real, camera=camera, size=frame, fps=fps, slow=slow, span=span, progress=progress)
    print(path)


def hardest(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep with thresholds.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Folder to write.", show_default="DIR/hardest")
    ] = None,
    controller: Annotated[str | None, typer.Option(help="Who answers.", show_default="the first that is shown")] = None,
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


def _span(begin: float | None, end: float | None, last: float) -> tuple[float, float]:
    first = 0.0 if begin is None else begin
    until = last if end is None else end
    if first > last:
        raise InputError(f"--from: {first:g} s is after the end of the run, {last:g} s")
    if until <= first:
        raise InputError(f"--to: {until:g} s must be after --from, {first:g} s")
    return first, min(until, last)


def write_page(folder: Path, out: Path | None, *, overwrite: bool) -> Path:
    """Write the page that plays a run in 3-D.

    Args:
        folder: of the run.
        out: file to write; None for that of its folder.
        overwrite: whether one that is there may be replaced.

    Returns:
        The file.

    Raises:
        InputError: if the folder is no run's, viser is not installed, or the file is there or cannot be written.
    """
    from sim.record.trace import load_trace
    from sim.results.out_file import check_file, write_file
    from sim.viewer.server import check_viser

    check_viser()
    path = folder / run_folder.PAGE if out is None else out
    if not os.path.isfile(folder / run_folder.TRACE):
        raise InputError(f"{str(folder)!r} is not the folder of a run; of a sweep, give the name of an episode, too")
    trace = load_trace(folder / run_folder.TRACE)
    check_file(path, "--out")
    if path.exists() and not overwrite:
        raise InputError(f"--out: {str(path)!r} is there already; choose another file or pass --overwrite")
    write_file(page_of(trace), path, "--out")
    return path


def page_of(trace: Trace) -> bytes:
    """The page that plays a trace in 3-D; shows how far it is."""
    from sim.viewer.page import replay_page

    with progress_bar("drawing", 1.0) as progress:
        return replay_page(trace, progress=progress).encode()
