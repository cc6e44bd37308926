"""One episode: observe, decide, act, record, until it is over."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from controllers.whole_body.layer import WholeBody
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against
from scenarios.schema import Scenario
from sim.episode.make_controller import BalanceController, make_controller
from sim.episode.plant import Plant, make_plant
from sim.episode.recording import PushRecord, Recording, decision_as_dict
from sim.episode.sensor_model import SensorModel
from sim.episode.set_polygons import SetPolygon
from sim.record.motors import MotorUse
from sim.record.outcome import Outcome, judge
from sim.record.trace import Trace


@dataclass(frozen=True, kw_only=True)
class EpisodeResult:
    """All that an episode leaves behind.

    Attributes:
        scenario: as run.
        robot: whom it happened to.
        trace: a row a control tick.
        outcome: judged from the trace alone.
        decisions: what was decided, when and why; JSON types.
        pushes: what became of each push.
        motors: how much of them was used; None for the pendulum.
        set_polygons: the MOA sets at the end of each push, for drawing.
        real_time_factor: simulated time / wall time of the loop, pictures excluded.
    """

    scenario: Scenario
    robot: Robot
    trace: Trace
    outcome: Outcome
    decisions: list[dict[str, Any]]
    pushes: list[PushRecord]
    motors: MotorUse | None
    set_polygons: tuple[SetPolygon, ...]
    real_time_factor: float


def run_episode(
    scenario: Scenario,
    *,
    progress: Callable[[float], None] | None = None,
    controller: BalanceController | None = None,
    robot: Robot | None = None,
    layer: WholeBody | None = None,
    polygons: bool = True,
) -> EpisodeResult:
    """Run a scenario.

    Args:
        scenario: what happens.
        progress: called now and then with the simulated time [s].
        controller: a controller of your own; None for the one that the scenario names.
        robot: the one that the scenario names, if it has been read already.
        layer: the whole-body layer of a former episode, to be used again: see `whole_body_layer`.
        polygons: whether to work out the sets' outlines for the figure.

    Raises:
        InputError: if the scenario asks for what its robot does not have.
    """
    robot = robot or load_robot(scenario.robot)
    check_against(scenario, robot)
    plant = make_plant(scenario, robot, layer)
    controller = controller or make_controller(scenario, robot)
    controller.reset()
    sensor_model = SensorModel(scenario)
    recording = Recording(scenario, plant, polygons=polygons)
    begin = time.perf_counter()
    ticks = 0
    for tick in range(scenario.ticks):
        ticks = tick + 1
        if run_tick(plant, controller, recording, sensor_model):
            break
        if progress is not None and tick % 100 == 0:
            progress(ticks * scenario.timing.control)
    wall = time.perf_counter() - begin - recording.aside
    trace = recording.trace()
    pushes = recording.pushes(plant, controller.decisions, controller)
    return EpisodeResult(
        scenario=scenario,
        robot=robot,
        trace=trace,
        outcome=judge(trace),
        decisions=[decision_as_dict(decision) for decision in controller.decisions],
        pushes=pushes,
        motors=recording.motors(),
        set_polygons=recording.set_polygons,
        real_time_factor=ticks * scenario.timing.control / wall,
    )


def run_tick(
    plant: Plant, controller: BalanceController, recording: Recording, sensor_model: SensorModel | None = None
) -> bool:
    """One control tick: observe, decide, act, record; True if the episode ends here, before acting.

    The record is of what is; the controllers act on what they see of it.
    """
    observation = plant.observe()
    condition = plant.condition()
    seen = observation if sensor_model is None else sensor_model.see(observation)
    command = controller.command(seen)
    if recording.see(observation, condition, command, controller):
        return True
    recording.close(plant.advance(seen, command), plant)
    return False
