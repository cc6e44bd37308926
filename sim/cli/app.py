"""The command line: run, render, list, and what the modules `cli_*` add."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from controllers.registry import CONTROLLERS, LAYERS
from models.errors import InputError
from scenarios.catalogue import check_against, find, load, shipped
from scenarios.schema import Scenario, World
from sim.cli import ablation as cli_ablation
from sim.cli import hardest as cli_hardest
from sim.cli import report as cli_report
from sim.cli import sweep as cli_sweep
from sim.cli.names import named
from sim.cli.numbers import number, whole
from sim.cli.sets import register
from sim.episode import run_folder

if TYPE_CHECKING:
    from sim.episode.episode import EpisodeResult

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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None takes those of the process.

    Returns:
        0, or 2 if what was asked cannot be done, or 130 after Ctrl-C; then one line on stderr says why.
    """
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
        print("okiagari: stopped; the same command makes a sweep go on where it was", file=sys.stderr)
    return code if isinstance(code, int) else 0


def _refuse(message: str) -> int:
    # Of a choice, typer passes on how pydantic begins a message.
    line = " ".join(message.split()).replace(": Value error, ", ": ")
    if line:  # a bare `okiagari` has shown its help instead
        print(f"okiagari: {line}", file=sys.stderr)
    return 2


@app.command(
    epilog="""Examples:

    okiagari run push_left --out out/left

    okiagari run my_scenario.toml --controller statue --seed 3 --no-video
    """
)
def run(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario (okiagari list), or a .toml file.")],
    world: Annotated[World | None, typer.Option(help="What is pushed: the whole body, or its model.")] = None,
    controller: Annotated[
        str | None,
        typer.Option(metavar="NAME", help=f"Who answers: {', '.join(CONTROLLERS.names())}, or path/to/file.py:Class."),
    ] = None,
    whole_body: Annotated[
        str | None,
        typer.Option(metavar="NAME", help=f"From balance to joints: {', '.join(LAYERS.names())}, or file.py:Class."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(parser=whole, metavar="N", help="Of what varies: the initial pose.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write, new or empty.", show_default="out/SCENARIO-WORLD")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that --out holds.")] = False,
    video: Annotated[
        bool | None, typer.Option("--video/--no-video", help="Film it.", show_default="video if this machine can")
    ] = None,
) -> None:
    """Run a scenario and write its folder. Options left out are as the scenario says."""
    asked = {
        "world": world,
        "controller": named(CONTROLLERS, "--controller", controller),
        "whole_body": named(LAYERS, "--whole-body", whole_body),
        "seed": seed,
    }
    chosen = _open(scenario, {name: value for name, value in asked.items() if value is not None})
    name = Path(scenario).stem
    folder = out if out is not None else run_folder.free_folder(f"{name}-{chosen.world}")
    run_folder.check_target(folder, overwrite=overwrite)
    note = _why_no_video() if video is not False else None
    if video and note:
        raise InputError(f"--video: {note}")

    from sim.episode.episode import run_episode
    from sim.viz.figures import draw_episode

    with _progress("simulating", chosen.duration) as progress:
        result = run_episode(chosen, progress=progress)
    with run_folder.staged(folder, overwrite=overwrite) as stage:
        run_folder.write_records(stage, result)
        draw_episode(result, stage / run_folder.FIGURE)
        if video is not False and note is None:
            from sim.viz.video import render_episode

            with _progress("filming", 1.0) as progress:
                render_episode(result.trace, stage / run_folder.VIDEO, progress=progress)
    _report(name, result, folder)
    if note:
        print(f"okiagari: {note}", file=sys.stderr)


@app.command(epilog="Example: okiagari render out/three_pushes-humanoid --camera side --slow 4")
def render(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    camera: Annotated[str, typer.Option(help="three_quarter, side, front or top.")] = "three_quarter",
    size: Annotated[str, typer.Option(metavar="WxH", help="Of a frame, in pixels.")] = "640x480",
    fps: Annotated[float, typer.Option(parser=number, metavar="N", help="Frames a second.")] = 60.0,
    slow: Annotated[float, typer.Option(parser=number, metavar="X", help="4 plays at a quarter of the speed.")] = 1.0,
) -> None:
    """Film a run again from its trace, without simulating: replaces the video in its folder."""
    match = re.fullmatch(r"(\d+)x(\d+)", size)
    if match is None:
        raise InputError(f"--size: {size!r} is not of the form WxH, for instance 1280x720")
    if not folder.is_dir():
        raise InputError(f"{str(folder)!r} is not a folder; it must be the folder of a run")
    from sim.record.trace import load_trace

    trace = load_trace(folder / run_folder.TRACE)
    note = _why_no_video()
    if note:
        raise InputError(note)
    from sim.viz.video import render_episode

    path = folder / run_folder.VIDEO
    frame = (int(match[1]), int(match[2]))
    with _progress("filming", 1.0) as progress:
        render_episode(trace, path, camera=camera, size=frame, fps=fps, slow=slow, progress=progress)
    print(path)


@app.command("list")
def list_scenarios() -> None:
    """List the shipped scenarios."""
    table = Table(box=None, pad_edge=False)
    table.add_column("scenario", style="bold", no_wrap=True)
    table.add_column("what happens")
    for name in shipped():
        table.add_row(name, load(name).description)
    Console().print(table)


def _open(name: str, overrides: dict[str, object]) -> Scenario:
    scenario = load(name, overrides)
    source = str(find(name))
    from models.robot import load_robot

    try:
        robot = load_robot(scenario.robot)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    check_against(scenario, robot, source=source)
    return scenario


def _why_no_video() -> str | None:
    from sim.viz.video import missing_renderer

    return missing_renderer()


@contextmanager
def _progress(what: str, total: float) -> Iterator[Callable[[float], None] | None]:
    """A bar on stderr, fed with how much of `total` is done; None where nobody looks."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn(what), BarColumn(), TextColumn("{task.percentage:3.0f} %"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


_COLOUR = {"recovered": "green", "fell": "red", "not_settled": "yellow"}


def _report(name: str, result: EpisodeResult, folder: Path) -> None:
    console = Console(highlight=False)
    scenario, outcome = result.scenario, result.outcome
    title = f"{name} ({scenario.world}, {scenario.controller.short}, seed {scenario.seed})"
    if result.pushes:
        table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 0), pad_edge=False)
        for heading in ("push at", "direction", "impulse", "Δv"):
            table.add_column(heading, justify="right", no_wrap=True)
        for heading in ("regulator\nset", "tracking\nset", "chosen", "outcome"):
            table.add_column(heading, no_wrap=True)
        for push, ending in zip(result.pushes, endings(result), strict=True):
            table.add_row(
                f"{push.start:g} s",
                f"{push.direction_deg:.0f}°",
                f"{push.asked_impulse:.2f} N s",
                f"{push.delta_v:.2f} m/s",
                _in_or_out(push.in_regulator_set),
                _in_or_out(push.in_tracking_set),
                push.chosen,
                ending,
            )
        console.print(table)
    else:
        console.print(title)
    steps = f"{outcome.steps_taken} step{'' if outcome.steps_taken == 1 else 's'}"
    when = f" at {outcome.time_of_fall:.2f} s" if outcome.time_of_fall is not None else ""
    verdict = outcome.result.value.replace("_", " ")
    console.print(f"[bold {_COLOUR[outcome.result]}]{verdict}[/]{when}: {outcome.reason.value}; {steps}")
    files = [folder / file for file in run_folder.FILES if (folder / file).exists()]
    console.print("open " + "\n     ".join(str(file) for file in reversed(files)), soft_wrap=True)


def _in_or_out(member: bool | None) -> str:
    return "-" if member is None else "in" if member else "out"


def endings(result: EpisodeResult) -> list[str]:
    """What became of each push: it "stood" until the next one, "fell" before it, or the push was "not reached".

    The last push that was reached takes the outcome of the episode.
    """
    begun = [push for push in result.pushes if push.start <= result.trace.time[-1]]
    verdict = result.outcome.result.value.replace("_", " ")
    missed = len(result.pushes) - len(begun)
    return ["stood"] * (len(begun) - 1) + [verdict] * bool(begun) + ["not reached"] * missed


register(app, _open, _progress)
cli_sweep.register(app)
cli_report.register(app)
cli_ablation.register(app)
cli_hardest.register(app, _progress)
