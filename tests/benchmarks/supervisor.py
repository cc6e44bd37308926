"""What a control tick of the supervisor costs, standing and stepping, beside the bare physics."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from controllers.interface import Observation, Phase
from controllers.supervisor.supervisor import Supervisor
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import run_episode
from tests.benchmarks.loop import EPISODES, bare_step
from tests.benchmarks.timing import in_words, show, table

REPEATS = 5


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """What a supervisor was shown in an episode.

    Attributes:
        scenario: the episode.
        observations: of every control tick.
    """

    scenario: Scenario
    observations: list[Observation]


def recorded(overrides: dict[str, Any]) -> Recorded:
    """Run `quiet` with overrides, and keep what the supervisor sees."""
    scenario = Scenario.model_validate(load("quiet").as_dict() | overrides)
    controller = supervisor_of(scenario)
    seen: list[Observation] = []
    decide = controller.command

    def command(observation: Observation) -> Any:
        seen.append(observation)
        return decide(observation)

    controller.command = command  # type: ignore[method-assign]
    run_episode(scenario, controller=controller, polygons=False)
    return Recorded(scenario=scenario, observations=seen)


def supervisor_of(scenario: Scenario) -> Supervisor:
    """The supervisor that a scenario asks for."""
    controller = make_controller(scenario, load_robot(scenario.robot))
    assert isinstance(controller, Supervisor)
    return controller


def tick_times(record: Recorded, repeats: int = REPEATS) -> dict[Phase, float]:
    """Mean time of a tick [s] by the phase that it ends in, each tick at its best of several runs of the record.

    The same observations lead to the same decisions, so every run goes through the same phases.
    """
    controller = supervisor_of(record.scenario)
    best, phases = np.full(len(record.observations), np.inf), []
    for run in range(repeats):
        controller.reset()
        for i, observation in enumerate(record.observations):
            begin = time.perf_counter()
            controller.command(observation)
            best[i] = min(best[i], time.perf_counter() - begin)
            if run == 0:
                phases.append(controller.phase)
    at = {phase: [i for i, found in enumerate(phases) if found is phase] for phase in Phase}
    return {phase: float(best[ticks].mean()) for phase, ticks in at.items() if ticks}


def main() -> None:
    """Print the table."""
    made = table("A tick of the supervisor; mean, each tick at its best", "episode", "phase", "tick", "over mj_step")
    for name, overrides in EPISODES:
        record = recorded(overrides)
        bare = bare_step(record.scenario)
        times = tick_times(record)
        bare = min(bare, bare_step(record.scenario))
        for phase, tick in times.items():
            made.add_row(name, phase.name.lower(), in_words(tick), f"{tick / bare:.2f}")
    show(made)


if __name__ == "__main__":
    main()
