"""Where a control tick goes: wall time of each stage of the loop, standing and stepping, with exact and real senses.

python -m tests.benchmarks tick

Each stage is timed by itself, which adds some tenths of a microsecond to each; the whole is timed without that.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from models.robot import load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import HumanoidPlant, make_plant
from tests.benchmarks.loop import bare_step, kinds
from tests.benchmarks.timing import show, table

# What is inside of a stage above is set in by two blanks.
STAGES = (
    "physics and sensors",
    "  of it sensors",
    "observe",
    "estimator",
    "controller",
    "whole-body layer",
    "servos and drives",
    "record",
    "all",
    "bare physics",
)
REPEATS = 3


def main() -> None:
    """Print the table."""
    found = {name: best(scenario) for name, scenario in kinds() if name[1] == "dynamics"}
    made = table("Wall time of a control tick [µs]", "stage", *(f"{name}, {senses}" for name, _, senses in found))
    for stage in STAGES:
        made.add_row(stage, *(f"{1e6 * times[stage]:.0f}" if stage in times else "-" for times in found.values()))
    show(made)


def best(scenario: Scenario) -> dict[str, float]:
    """The least of a few episodes, stage by stage [s]: what disturbs can only add."""
    runs = [_Run(scenario).times() for _ in range(REPEATS)]
    return {stage: min(times[stage] for times in runs) for stage in runs[0]}


class _Run:
    """An episode twice: as it is, and with a watch at each stage."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario, self._robot = scenario, load_robot(scenario.robot)
        self._spent: dict[str, float] = {}

    def times(self) -> dict[str, float]:
        """Mean wall time of each stage in a tick [s]."""
        whole, ticks = self._run(self._episode())
        episode = self._episode()
        self._watch(episode)
        self._run(episode)
        spent = {stage: total / ticks for stage, total in self._spent.items()}
        substeps = self._scenario.timing.substeps
        return spent | {"all": whole / ticks, "bare physics": substeps * bare_step(self._scenario)}

    def _episode(self) -> Episode:
        plant = make_plant(self._scenario, self._robot)
        return Episode(self._scenario, plant, make_controller(self._scenario, self._robot))

    def _watch(self, episode: Episode) -> None:
        plant: Any = episode.plant
        assert isinstance(plant, HumanoidPlant)
        hidden: Any = episode
        self._time(plant, "step", "physics and sensors")
        self._time(plant, "observe", "observe")
        self._time(plant, "condition", "observe")
        self._time(plant.world, "set_targets", "servos and drives")
        self._time(plant.world, "motor_state", "servos and drives")
        self._time(plant._drives, "reference", "servos and drives")
        self._time(plant._layer, "targets", "whole-body layer")
        self._time(hidden, "_ask", "controller")
        self._time(hidden._recording, "see", "record")
        self._time(hidden._recording, "close", "record")
        self._time(hidden._senses, "see", "estimator")
        if (sensors := getattr(hidden._senses, "_sensors", None)) is not None:
            self._time(sensors, "sample", "  of it sensors")
            plant.world.physics.watch(sensors.sample)

    def _time(self, owner: Any, method: str, stage: str) -> None:
        """Add what a method takes from now on to a stage."""
        call: Callable[..., Any] = getattr(owner, method)
        spent = self._spent
        spent.setdefault(stage, 0.0)

        def timed(*arguments: Any) -> Any:
            begin = time.perf_counter()
            try:
                return call(*arguments)
            finally:
                spent[stage] += time.perf_counter() - begin

        setattr(owner, method, timed)

    @staticmethod
    def _run(episode: Episode) -> tuple[float, int]:
        """Wall time of all ticks [s], and their number."""
        begin = time.perf_counter()
        while episode.tick():
            pass
        return time.perf_counter() - begin, episode.ticks
