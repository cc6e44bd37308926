"""The command line of one episode: run."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from controllers.registry import CONTROLLERS, LAYERS
from models.errors import InputError
from scenarios.catalogue import find
from scenarios.push import Push
from scenarios.schema import Scenario, World
from sim.cli.film import why_no_video
from sim.cli.numbers import positive, whole
from sim.cli.scenario_option import named, open_scenario
from sim.cli.terminal import progress_bar
from sim.episode import run_folder
from sim.episode.push_record import PushRecord, next_after

if TYPE_CHECKING:
    from sim.episode.episode import EpisodeResult
    from sim.viewer.live import Watched

# What takes long to import (physics, solvers, pictures) is imported by the command that needs it.

PORT, MOST = 8080, 65535
"""Where the browser finds the live view unless told otherwise, and the last port there is."""


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(
        epilog="""Examples:

    okiagari run push_left --out out/left

    okiagari run my_scenario.toml --controller statue --seed 3 --no-video

    okiagari run push_left --set stepping.max_steps=2 --set duration=8

    okiagari run quiet --view --set duration=120
    """
    )(run)


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
    assignments: Annotated[
        list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Replace a field, may be repeated.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write, new or empty.", show_default="out/SCENARIO-WORLD[-CONTROLLER]")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that --out holds.")] = False,
    video: Annotated[
        bool | None, typer.Option("--video/--no-video", help="Film it.", show_default="video if this machine can")
    ] = None,
    view: Annotated[
        bool, typer.Option("--view", help="First live in a browser, in 3-D, where it can be pushed by hand.")
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(parser=positive, metavar="N", help="Of this machine, for the browser.", show_default="8080"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print folder and outcome.json, for machines.")] = False,
) -> None:
    """Run a scenario and write its folder. Options left out are as the scenario says."""
    asked = {
        "world": world,
        "controller": named(CONTROLLERS, "--controller", controller),
        "whole_body": named(LAYERS, "--whole-body", whole_body),
        "seed": seed,
    }
    if port is not None and (not view or port > MOST):
        raise InputError(f"--port: {port} " + (f"must be at most {MOST}" if view else "is of no use without --view"))
    if view:
        from sim.viewer.server import check_free, check_viser

        check_viser()
        check_free(port or PORT)
    overrides = {name: value for name, value in asked.items() if value is not None}
    chosen = open_scenario(scenario, overrides, assignments or ())
    name = Path(scenario).stem
    note = why_no_video() if video is not False else None
    if video and note:
        raise InputError(f"--video: {note}")
    place = f"{name}-{chosen.world}" + (f"-{chosen.controller.short.replace(':', '-')}" if controller else "")
    claim = run_folder.claimed_free(place) if out is None else run_folder.claimed_at(out, overwrite=overwrite)
    with claim as (folder, stage):
        try:
            result = _write(chosen, stage, film=video is not False and note is None, view=view, port=port or PORT)
        except InputError as error:
            raise InputError(f"{find(scenario)}: {error}") from error
    if as_json:
        record = json.loads((folder / run_folder.OUTCOME).read_text(encoding="utf-8"))
        print(json.dumps({"folder": str(folder)} | record, indent=1))
    else:
        _report(name, result, folder)
    if note:
        print(f"okiagari: {note}", file=sys.stderr)


def _write(scenario: Scenario, stage: Path, *, film: bool, view: bool, port: int) -> EpisodeResult:
    """Run, and write all files; what was viewed is run again, without the view."""
    from sim.episode.episode import run_episode
    from sim.viz.figures import draw_episode

    watched = _watch(scenario, port) if view else None
    scenario = watched.scenario if watched else scenario
    with progress_bar("simulating", scenario.duration) as progress:
        result = run_episode(scenario, progress=progress)
    if watched is not None and (since := watched.differs(result.trace)) is not None:
        print(
            f"okiagari: from {since:g} s on the run written is not what was seen: its controller or layer does not "
            "answer alike twice",
            file=sys.stderr,
        )
    run_folder.write_records(stage, result)
    draw_episode(result, stage / run_folder.FIGURE)
    if film:
        from sim.viz.video import render_episode

        with progress_bar("filming", 1.0) as progress:
            render_episode(result.trace, stage / run_folder.VIDEO, progress=progress)
    return result


def _watch(scenario: Scenario, port: int) -> Watched:
    """Show the episode in a browser until somebody ends it."""
    from sim.viewer.live import watch

    def announce(address: str) -> None:
        print(f"open {address} in a browser; it begins then. Ctrl-C here ends it and writes the run", file=sys.stderr)

    return watch(scenario, port=port, announce=announce)


def _report(name: str, result: EpisodeResult, folder: Path) -> None:
    """Say what became of every push, how it ended, and what to open."""
    from rich.text import Text

    from sim.presenter.render import print_sections, terminal
    from sim.presenter.tables import Section, Table

    console = terminal()
    scenario, outcome = result.scenario, result.outcome
    title = f"{name} ({scenario.world}, {scenario.controller.short}, seed {scenario.seed})"
    rows = tuple(
        {
            "push at": f"{push.start:g} s",
            "for": f"{push.duration:g} s",
            "to": direction_words(asked),
            "on": push.body,
            "impulse": impulse_words(push),
            "Δv": f"{push.delta_v:.2f} m/s" if asked.torque is None else "–",
            ("set of the", "regulator"): _in_or_out(push.in_regulator_set),
            ("set of the", "steps"): _in_or_out(push.in_tracking_set),
            "chosen": push.chosen,
            "outcome": ending,
        }
        for push, asked, ending in zip(result.pushes, scenario.pushes, endings(result), strict=True)
    )
    if rows:
        print_sections([Section(key="run", heading=title, tables=(Table(title=title, rows=rows),))], console)
    else:
        console.print(Text(title))
    steps = f"{outcome.steps_taken} step{'' if outcome.steps_taken == 1 else 's'}"
    when = f" at {outcome.time_of_fall:.2f} s" if outcome.time_of_fall is not None else ""
    verdict = outcome.result.value.replace("_", " ")
    colour = {"recovered": "green", "fell": "red"}.get(outcome.result.value, "yellow")
    console.print(Text.assemble((verdict, f"bold {colour}"), f"{when}: {outcome.reason.value}; {steps}"))
    if result.sight is not None:
        off = f"{1e3 * result.sight.rms:.1f} mm RMS, {1e3 * result.sight.peak:.1f} mm at most"
        console.print(Text(f"{scenario.sensing.words}: the DCM that was seen was off by {off}"))
    files = [folder / file for file in run_folder.FILES if (folder / file).exists()]
    console.print(Text("open " + "\n     ".join(str(file) for file in reversed(files))), soft_wrap=True)


def direction_words(push: Push) -> str:
    """Where a push goes: "90°", "up", or "0°, 30° down"; "torque 3 N m about y" of a torque."""
    if push.torque is not None:
        return push.torque_words.removesuffix(f" on {push.body}")
    x, y, z = push.unit.tolist()
    flat = math.hypot(x, y)
    if flat < 1e-9:
        return "up" if z > 0.0 else "down"
    steep = math.degrees(math.atan2(z, flat))
    aside = f", {abs(steep):.0f}° {'up' if steep > 0.0 else 'down'}" if z else ""
    return f"{push.direction_deg:.0f}°{aside}"


def impulse_words(push: PushRecord) -> str:
    """What was asked for: "0.55 N s", or of a torque "0.30 N m s"."""
    spin = getattr(push, "asked_angular_impulse", None)
    return f"{push.asked_impulse:.2f} N s" if spin is None else f"{spin:.2f} N m s"


def _in_or_out(member: bool | None) -> str:
    return "–" if member is None else "in" if member else "out"


def endings(result: EpisodeResult) -> list[str]:
    """What became of each push: it "stood" until the next one, "fell" before it, or the push was "not reached".

    The next one is the first that begins after its end. The last push that was reached, and those that overlap it, take
    the outcome of the episode.
    """
    begun = [push for push in result.pushes if push.start <= result.trace.time[-1]]
    verdict = result.outcome.result.value.replace("_", " ")
    missed = len(result.pushes) - len(begun)
    found = [verdict if next_after(begun, index) is None else "stood" for index in range(len(begun))]
    return found + ["not reached"] * missed
