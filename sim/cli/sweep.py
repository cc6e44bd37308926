"""The command line of sweeps: sweep, replay."""

from __future__ import annotations

import hashlib
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from controllers.registry import CONTROLLERS, short
from models.errors import InputError
from scenarios.schema import World
from scenarios.suite import MANY
from scenarios.suite_catalogue import LoadedSuite, in_world, load_suite, shipped, with_controllers
from scenarios.variants import CHANGEABLE, DECIDED
from sim.cli.film import page_of, why_no_video, write_page
from sim.cli.numbers import positive
from sim.cli.scenario_option import assigned, named
from sim.episode import run_folder

# What takes long to import (physics, solvers, pictures) is imported by the command that needs it.

_LONGEST_NAME = 40  # of an assignment in a folder's name


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(
        epilog="""Examples:

    okiagari sweep smoke

    okiagari sweep my_suite.toml --out out/mine --workers 4

    okiagari sweep trunk_push --world pendulum

    okiagari sweep trunk_push --controller my_controller.py:Mine --controller supervisor

    okiagari sweep smoke --set stepping.max_steps=2 --out out/two-steps

    okiagari sweep trunk_push --cluster tcp://127.0.0.1:8786
    """
    )(sweep)
    app.command(
        epilog="""Examples:

    okiagari replay out/sweep-smoke 3f2a9c --video

    okiagari replay out/three_pushes-humanoid --html
    """
    )(replay)


def sweep(
    suite: Annotated[
        str,
        typer.Argument(help=f"{', '.join(shipped())}, or a .toml file of your own."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write, or to go on with.", show_default="out/sweep-SUITE")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(parser=positive, metavar="N", help="Processes.", show_default="one a core")
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, instead of processes of this machine.")
    ] = None,
    world: Annotated[
        World | None, typer.Option(help="Run all of it in this world only.", show_default="as the suite says")
    ] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Who answers, instead of the suite's; may be repeated."),
    ] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Replace a field of the base scenario.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Run more than a million episodes, too.")] = False,
) -> None:
    """Run all episodes of a suite; the same command goes on where it was stopped."""
    loaded = load_suite(suite)
    called = [f"sweep-{loaded.name}"]
    if assignments:
        loaded = _with_base(loaded, assignments)
        called += map(_as_name, assignments)
    if world is not None:
        loaded, called = in_world(loaded, world), [*called, world]
    if controller:
        names = tuple(dict.fromkeys(str(named(CONTROLLERS, "--controller", name)) for name in controller))
        loaded, called = with_controllers(loaded, names), [*called, *(short(name).replace(":", "-") for name in names)]
    options = [("--set", one) for one in assignments or ()] + [("--controller", one) for one in controller or ()]
    loaded = replace(loaded, options=tuple(word for option in options for word in option))
    folder = out if out is not None else Path("out") / "-".join(called)
    run_suite(loaded, folder, workers=workers, cluster=cluster, many=yes)
    _report(folder)


def _as_name(assignment: str) -> str:
    """Part of a folder's name."""
    name = re.sub(r"[^\w.+-]+", "-", assignment).strip("-")
    if len(name) > _LONGEST_NAME:
        return f"{name[:_LONGEST_NAME]}-{hashlib.sha256(assignment.encode()).hexdigest()[:8]}"
    return name


def _with_base(loaded: LoadedSuite, assignments: list[str]) -> LoadedSuite:
    """A suite whose base scenario has other values.

    Raises:
        InputError: if one is not allowed, or the suite decides it itself.
    """
    for text in assignments:
        if text.partition("=")[0].strip().partition(".")[0] in DECIDED:
            raise InputError(f"--set: {text!r}: the suite decides it; allowed: {', '.join(CHANGEABLE)}")
    return replace(loaded, base=assigned(loaded.base, assignments))


def run_suite(
    loaded: LoadedSuite, folder: Path, *, workers: int | None = None, cluster: str | None = None, many: bool = False
) -> None:
    """Run what a suite's folder lacks, and show how it goes.

    Args:
        loaded: the suite.
        folder: of the sweep.
        workers: processes of this machine; None for one a core.
        cluster: address of a Dask scheduler instead.
        many: whether more than a million episodes are run, too.

    Raises:
        InputError: if that is not possible; see `run_sweep`.
    """
    if cluster is not None and workers is not None:
        raise InputError("--workers: the cluster's own workers run the episodes; give only one of it and --cluster")
    count = loaded.suite.episodes
    if count > MANY and not many:
        raise InputError(f"{loaded.path}: makes {count} episodes; more than {MANY} are run only with --yes")

    from sim.sweep import executors
    from sim.sweep.progress import SweepDisplay
    from sim.sweep.sweep import run_sweep

    if cluster is not None:
        chosen = executors.cluster(cluster)
    else:
        chosen = executors.local(workers or len(os.sched_getaffinity(0)))
    with chosen as who, SweepDisplay(loaded.name) as progress:
        run_sweep(loaded, folder, who, progress=progress)


def replay(
    folder: Annotated[Path, typer.Argument(help="Folder of a sweep; with --html, of a run, too.")],
    episode: Annotated[
        str | None,
        typer.Argument(help="Of a sweep: name of an episode, or enough of its beginning.", show_default=False),
    ] = None,
    video: Annotated[bool, typer.Option("--video", help="Write its run's folder, with figure and video.")] = False,
    html: Annotated[
        bool, typer.Option("--html", help="Write a page that plays it in 3-D; of a sweep, into its run's folder.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write, new or empty; of a run, the page.",
            show_default=f"DIR/replays/EPISODE, DIR/{run_folder.PAGE}",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace what --out or the page's name holds.")
    ] = False,
) -> None:
    """Run one episode of a sweep again and confirm that every bit comes back; exit code 1 if not.

    With --html, and of a run's folder without running it again: one file that plays it in 3-D in a browser.
    """
    if episode is None:
        if not html or video:
            raise InputError("EPISODE: give the name of a sweep's episode; only --html alone plays a run's own folder")
        print(write_page(folder, out, overwrite=overwrite))
        return
    from sim.record.places import check_writable
    from sim.sweep import replay as again

    row = again.find_row(folder, episode)
    name = row["episode"]
    target = out if out is not None else folder / "replays" / name
    overwrite = overwrite or out is None
    writes = video or html or out is not None
    if writes:
        run_folder.check_target(target, overwrite=overwrite)
        check_writable(target / run_folder.OUTCOME, "--out")
    if video:
        note = why_no_video()
        if note:
            raise InputError(f"--video: {note}")
    if html:
        from sim.viewer.server import check_viser

        check_viser()
    if again.crashed(row):
        print(row["traceback"])
    result = again.replay(folder, name)
    if writes:
        from sim.viz.figures import draw_episode

        with run_folder.claimed(target, overwrite=overwrite) as stage:
            run_folder.write_records(stage, result.result)
            draw_episode(result.result, stage / run_folder.FIGURE)
            if video:
                from sim.viz.video import render_episode

                render_episode(result.result.trace, stage / run_folder.VIDEO)
            if html:
                (stage / run_folder.PAGE).write_bytes(page_of(result.result.trace))
        print(target / (run_folder.PAGE if html else run_folder.VIDEO if video else run_folder.OUTCOME))
    print(f"{name} {result.words()}")
    if not result.identical:
        raise typer.Exit(1)


def _report(folder: Path) -> None:
    from sim.analysis.summary import write_summary
    from sim.presenter.render import print_sections
    from sim.presenter.sections import sections
    from sim.results.table import RESULTS

    summary = write_summary(folder)
    print_sections(sections(summary))
    print(f"{summary['episodes']} episodes in {folder / RESULTS}")
    crashed = sum(entry["crashed"] for entry in summary["rates"] if not entry["by"])
    if crashed and crashed == summary["episodes"]:
        print(
            f"okiagari: every episode crashed; `okiagari replay {folder} ID` shows the traceback of one",
            file=sys.stderr,
        )
        raise typer.Exit(1)
