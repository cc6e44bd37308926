"""Runs a suite: episodes side by side, each written down as it ends; goes on where it was stopped."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from controllers.registry import CONTROLLERS
from models.errors import InputError
from scenarios.schema import Scenario
from scenarios.suite_catalogue import LoadedSuite
from sim.episode.build import make_controller, make_estimator
from sim.results.push_size import robot_named
from sim.sweep.executors import Workers
from sim.sweep.kept import is_shipped, layer_kept, warm_up_shipped
from sim.sweep.plan import Series, plan, scenario_of
from sim.sweep.progress import SweepDisplay
from sim.sweep.runner import Runner
from sim.sweep.scheduler import Scheduler
from sim.sweep.store import Store, describe, owned, prepare
from sim.sweep.worker import Job

_KIND = ("robot", "world", "controller", "whole_body", "sensing", "latency", "variant")


def run_sweep(loaded: LoadedSuite, folder: Path, workers: Workers, *, progress: SweepDisplay | None = None) -> None:
    """Run what a suite's folder lacks.

    Args:
        loaded: the suite.
        folder: of the sweep; new, empty, or of the same suite.
        workers: who runs the episodes.
        progress: is told how it goes.

    Raises:
        InputError: if the suite is impossible, the folder is another suite's, a file in it is damaged, or the disk
            is full; what is finished is kept.
    """
    series = plan(loaded)
    _check_classes(loaded, series)
    with owned(folder):
        prepare(loaded, folder)
        store = Store(folder)
        strangers = store.outcomes.keys() - {episode.name for one in series for episode in one.episodes}
        if strangers:
            raise InputError(
                f"{str(folder)!r} holds {len(strangers)} episodes that are none of {loaded.name!r}; "
                "choose another folder with --out"
            )
        scheduler = Scheduler(series, store.outcomes)

        def finished(job: Job, row: dict[str, Any]) -> None:
            store.add(row)
            scheduler.finish(job.episode, row["outcome"])
            if progress is not None:
                progress.tell(scheduler, row["outcome"])

        def jobs() -> Iterator[Job]:
            while (episode := scheduler.next()) is not None:
                yield Job(episode=episode, scenario=scenario_of(loaded, episode))

        if scheduler.left and workers.share_code:
            # Before they start: else each would compile the same, and none says what it waits for.
            lacking = [one for one in series if any(episode.name not in store.outcomes for episode in one.episodes)]
            warm_up_shipped(_kinds(loaded, lacking))
        if progress is not None:
            progress.begin(scheduler, store.outcomes.values())
        if scheduler.left:
            Runner(workers, finished).work(jobs)
        store.finish()
        describe(loaded, folder, planned=scheduler.planned, finished=len(store.outcomes))


def _kinds(loaded: LoadedSuite, series: list[Series]) -> Iterator[Scenario]:
    """A scenario for each robot, world, class and sensing that the suite names."""
    known = set()
    for one in series:
        parameters = one.episodes[0].parameters
        if (key := tuple(map(parameters.get, _KIND))) not in known:
            known.add(key)
            yield scenario_of(loaded, one.episodes[0])


def _check_classes(loaded: LoadedSuite, series: list[Series]) -> None:
    """Build controllers at joint level, our layers and our estimators once: what does not fit would always crash."""
    for scenario in _kinds(loaded, series):
        robot = robot_named(scenario.robot)
        try:
            if CONTROLLERS.entry(scenario.controller.name).at_joints:
                make_controller(scenario, robot)
            elif is_shipped(scenario):
                layer_kept(scenario, robot)
                if scenario.world == "humanoid":
                    make_estimator(scenario, robot)
        except InputError as error:
            raise InputError(f"{loaded.path}: {error}") from None
