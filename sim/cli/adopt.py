"""The command line of other robots: adopt."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from models.errors import InputError
from sim.cli.terminal import progress_bar

STOOD = 5.0
"""How long a robot that was adopted is looked at [s]."""


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
    stages = iter(range(1, 9))
    with progress_bar(f"adopting {path.stem}", 4) as bar:
        done = adoption.adopt(path, out, hints=said, progress=lambda stage: bar(next(stages)) if bar else None)
    print(done.report, end="")
    print(f"\n{_stands(done.robot.path)}")
    _draw(done.robot.path, out / "stand.png")
    print(f'written to {out}; use it with  robot = "{done.robot.path}"')


def _stands(path: Path) -> str:
    """What becomes of the robot when nobody pushes it, in words."""
    from scenarios.schema import Scenario
    from sim.episode.episode import run_episode

    scenario = Scenario.model_validate(
        {"description": "nobody pushes", "world": "humanoid", "robot": str(path), "duration": STOOD}
    )
    try:
        with progress_bar("standing", STOOD) as bar:
            outcome = run_episode(scenario, progress=bar, polygons=False).outcome
    except InputError as error:
        return f"The built-in supervisor cannot be built for it: {error}"
    if outcome.time_of_fall is not None:
        return f"It does not stand: {outcome.reason}, after {outcome.time_of_fall:.2f} s under the built-in supervisor."
    return f"It stands: {outcome.reason} after {STOOD:g} s under the built-in supervisor, nobody pushing."


def _draw(robot: Path, picture: Path) -> None:
    from sim.cli.film import why_no_video

    if (note := why_no_video()) is not None:
        print(f"no picture: {note}")
        return
    from sim.viz.portrait import draw_portrait

    draw_portrait(robot, picture)
