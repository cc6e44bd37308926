"""The command line of other robots: adopt."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError, OkiagariError
from sim.cli.terminal import print_markdown, progress_bar

STOOD = 5.0
"""How long a robot that was adopted is looked at [s]."""
PICTURE = "stand.png"


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(epilog="Example: okiagari adopt my_biped.xml --out my_robot")(adopt)


def adopt(
    source: Annotated[str, typer.Argument(help="MJCF of a biped, or a robot's name: op3, t1, g1, bh, h1, apollo.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="New folder for the robot.")],
    hints: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What the MJCF cannot say.", show_default="robot.toml beside it, if any"),
    ] = None,
) -> None:
    """Make a robot that the testbed runs out of any biped's MJCF.

    Writes DIR/NAME.xml with its meshes, a report of what was found, chosen and assumed, and a picture of its stand;
    then lets it stand for 5 s under the built-in supervisor, and says whether it does.
    """
    from models.adopt import adopt as adoption
    from models.adopt.catalogue import KNOWN, source_of
    from models.adopt.hints import Hints, read_hints

    path = Path(source)
    if source in KNOWN:
        path = source_of(source)
    elif path.suffix != ".xml":
        raise InputError(f"SOURCE: {source!r} is neither a path to an .xml file nor one of {', '.join(KNOWN)}")
    elif not path.is_file():
        raise InputError(f"SOURCE: no file {source!r}")
    said = read_hints(hints) if hints is not None else None
    if source in KNOWN:
        said = (said or Hints()).model_copy(update={"name": source} if said is None or said.name is None else {})
    with progress_bar(f"adopting {path.stem}", 2.0) as bar:
        show = bar or (lambda done: None)
        done = adoption.adopt(path, out, hints=said, progress=show, trial=lambda robot: _trial(robot, show))
    print_markdown(done.report)
    print(f'written to {out}; use it with  robot = "{done.robot.path}"')


def _trial(robot: Path, progress: Callable[[float], None]) -> str:
    """What becomes of the robot when nobody pushes it, in words, and a picture of its stand beside it."""
    from scenarios.schema import Scenario
    from sim.cli.film import why_no_video
    from sim.episode.episode import run_episode

    scenario = Scenario.model_validate(
        {"description": "nobody pushes", "world": "humanoid", "robot": str(robot), "duration": STOOD}
    )
    try:
        outcome = run_episode(scenario, progress=lambda time: progress(1.0 + time / STOOD), polygons=False).outcome
    except OkiagariError as error:
        words = f"The built-in supervisor cannot be built for it: {str(error).removeprefix(f'{robot}: ')}."
    else:
        if outcome.time_of_fall is not None:
            words = f"It does not stand: {outcome.reason}, after {outcome.time_of_fall:.2f} s "
        else:
            words = f"It stands: {outcome.reason} after {STOOD:g} s "
        words += "under the built-in supervisor, nobody pushing."
    if (note := why_no_video()) is not None:
        return f"{words} No picture: {note}"
    from sim.viz.portrait import draw_portrait

    draw_portrait(robot, robot.parent / PICTURE)
    return f"{words} Its stand is drawn in {PICTURE}."
