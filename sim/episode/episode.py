"""One episode: observe, decide, act, record, until it is over."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.interface import BalanceController, JointController, Observation, WholeBodyLayer
from controllers.registry import CONTROLLERS, ESTIMATORS
from controllers.senses import Estimator
from models.errors import InputError, OkiagariError
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.guard import Guard
from sim.episode.humanoid_world import HumanoidWorld
from sim.episode.plant import Action, Condition, Plant, make_plant
from sim.episode.push_record import PushRecord
from sim.episode.recording import Recording, decision_as_dict
from sim.episode.senses import make_senses
from sim.episode.set_polygons import SetPolygon
from sim.record.motors import MotorUse
from sim.record.outcome import Outcome, falls, judge
from sim.record.seen import SightError, sight_error
from sim.record.trace import Trace


@dataclass(frozen=True, kw_only=True)
class EpisodeResult:
    """All that an episode leaves behind.

    Attributes:
        scenario: as run, with the pushes that were added on the way.
        robot: whom it happened to.
        trace: a row a control tick.
        outcome: judged from the trace alone.
        decisions: what was decided, when and why; JSON types.
        pushes: what became of each push.
        motors: how much of them was used; None for the pendulum.
        sight: how far off the controllers saw; None if they saw the true state.
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
    sight: SightError | None
    set_polygons: tuple[SetPolygon, ...]
    real_time_factor: float


class Episode:
    """One episode, tick by tick: it owns the clock, the senses, the record and the verdict.

    Whoever drives it calls `tick` until it is False, or, if the physics is stepped by somebody else, `observe`, `begin`
    with the action, and `end` after the physics. The record is of what is; controllers get what they see of it.

    Attributes:
        scenario: what happens, with the pushes that were added.
        robot: whom it happens to.
        plant: the world.
        controller: who answers, with balance commands or joint targets; None if the actions come from outside.
        ticks: control ticks begun.
        truth: the observation of this tick as it is.
        seen: the same as the controller sees it.
        action: what was done in this tick.
    """

    def __init__(
        self,
        scenario: Scenario,
        plant: Plant,
        controller: BalanceController | JointController | None = None,
        *,
        polygons: bool = False,
        goes_on: bool = False,
        on_tick: Callable[[Episode], None] | None = None,
    ) -> None:
        """Stand ready for the first tick.

        Args:
            scenario: what happens.
            plant: its world, at the start.
            controller: who answers; None if the actions come from outside.
            polygons: whether to work out the sets' outlines for the figure.
            goes_on: whether only a fall ends it before its time, for somebody may push a robot that rests.
            on_tick: called after each tick.
        """
        self.scenario, self.plant, self.controller, self.robot = scenario, plant, controller, plant.robot
        self.ticks = 0
        self._goes_on, self._on_tick = goes_on, on_tick
        self._senses = make_senses(scenario, plant)
        self._recording = Recording(scenario, plant, controller, polygons=polygons)
        choice = scenario.controller
        self._guard = Guard(f"controller {choice.short!r}", foreign=choice.name not in CONTROLLERS.shipped)
        self._asked_every = 1
        reset, given = getattr(controller, "reset", None), list[int]()
        if controller is not None and not hasattr(controller, "command"):
            self._asked_every = _whole_ticks(choice.short, controller, scenario.timing.control)
            given = [scenario.seed]
        if reset is not None:
            self._guard.ask(reset, 0, *given)
        self._began = self._ended = time.perf_counter()
        self.action: Action | None = None
        self.truth: Observation
        self.seen: Observation
        self._condition: Condition

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return self.ticks * self.scenario.timing.control

    @property
    def fell(self) -> bool:
        """Whether the robot has fallen, as it is now."""
        condition, height = self.plant.condition(), float(self.plant.observe().cog[2])
        return any(falls(condition.trunk_tilt, height / self.robot.cog_height, condition.other_contact).values())

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the columns of `row`."""
        return self._recording.channels

    @property
    def row(self) -> NDArray[np.float64]:
        """(c,) what the trace holds of the latest tick, but for the columns of single pushes and of the motors."""
        return self._recording.row

    @property
    def acting(self) -> Mapping[int, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """The pushes that acted in the latest tick: index -> (3,) mean force [N] or torque [N m], (3,) where [m]."""
        return self._recording.acting

    def add_push(self, push: Push) -> Push:
        """Push now, be it from `on_tick` or between two ticks.

        The push is booked, checked and recorded like those of the scenario, which holds it from now on: run again, that
        scenario gives the same episode, bit for bit.

        Args:
            push: what to add; its start does not matter.

        Returns:
            The same with its start, which is that of the next physics step.

        Raises:
            InputError: if the scenario would not be allowed with it; nothing is added then.
        """
        added = self.plant.add_push(push)
        self.scenario = self.plant.scenario
        self._recording.push_added(self.scenario)
        return added

    def tick(self) -> bool:
        """One control tick with the episode's controller; False if the episode is over."""
        if self.ticks >= self.scenario.ticks:
            return False
        if self.controller is None:
            raise OkiagariError("an episode without a controller is driven by observe, begin and end")
        self.observe()
        if not self.begin(self._ask(self.controller)):
            return False
        self.plant.step()
        self.end()
        return True

    def _ask(self, controller: BalanceController | JointController) -> Action:
        """The answer to what is seen; at joint level the last one, until its period is over."""
        seen, tick = self.seen, self.ticks
        if hasattr(controller, "command"):
            return self._guard.check_command(self._guard.ask(controller.command, tick, seen), tick, seen)
        if self.action is not None and tick % self._asked_every:
            return self.action
        targets = self._guard.ask(controller.targets, tick, seen)
        return self._guard.check_targets(targets, tick, len(self.robot.joint_names), seen)

    def observe(self) -> Observation:
        """What the controller sees now; to be asked once a tick."""
        self.truth, self._condition = self.plant.observe(), self.plant.condition()
        self.seen = self._senses.see(self.truth, self.ticks)
        return self.seen

    def begin(self, action: Action) -> bool:
        """Take this tick's action and record it; False if the episode ends here, before acting."""
        self.action = action
        self.ticks += 1
        over = self._recording.see(self.truth, self._condition, action, self.seen)
        # Somebody else's physics goes on, whatever the record says of it.
        if over and self.controller is not None and not (self._goes_on and not self.fell):
            self._ended = time.perf_counter()
            return False
        self.plant.give(self.ticks - 1, self.seen, action)
        return True

    def end(self) -> None:
        """Record how this tick went, after its physics."""
        self._recording.close(self.plant.end(), self.plant)
        self._ended = time.perf_counter()
        if self._on_tick is not None:
            self._on_tick(self)

    def result(self) -> EpisodeResult:
        """The record so far, judged."""
        wall = self._ended - self._began - self._recording.aside
        trace = self._recording.trace(self._world_facts())
        outcome = judge(trace)
        return EpisodeResult(
            scenario=self.scenario,
            robot=self.robot,
            trace=trace,
            outcome=outcome,
            decisions=[decision_as_dict(decision) for decision in getattr(self.controller, "decisions", ())],
            pushes=self._recording.pushes(self.plant, trace),
            motors=self._recording.motors(),
            sight=sight_error(trace, outcome.time_of_fall),
            set_polygons=self._recording.set_polygons,
            real_time_factor=self.time / wall,
        )

    def _world_facts(self) -> dict[str, Any]:
        """What the metadata say of senses and body beside the scenario, if there is anything to say."""
        sensing, errors = self.scenario.sensing, self.plant.body_errors
        found: dict[str, Any] = {"body_errors": errors} if errors else {}
        if not sensing.is_true:
            found["sensing"] = sensing.as_run(self.scenario.timing.physics)
            found["estimator_source"] = ESTIMATORS.entry(sensing.who.name).source
        return found


def _whole_ticks(who: str, controller: JointController, dt: float) -> int:
    """Control ticks in a controller's period.

    Raises:
        InputError: if that is no whole number.
    """
    period = getattr(controller, "period", None)
    if not isinstance(period, int | float) or not period > 0.0 or not math.isclose(period / dt, round(period / dt)):
        raise InputError(
            f"controller {who!r}: period: {period!r} must be a number of seconds, a whole multiple of the control "
            f"period, {dt:g} s"
        )
    return round(period / dt)


def run_episode(
    scenario: Scenario,
    *,
    progress: Callable[[float], None] | None = None,
    controller: BalanceController | JointController | None = None,
    robot: Robot | None = None,
    layer: WholeBodyLayer | None = None,
    estimator: Estimator | None = None,
    world: HumanoidWorld | None = None,
    polygons: bool = True,
    on_tick: Callable[[Episode], None] | None = None,
) -> EpisodeResult:
    """Run a scenario.

    Args:
        scenario: what happens.
        progress: called now and then with the simulated time [s].
        controller: a controller of your own; None for the one that the scenario names.
        robot: the one that the scenario names, if it has been read already.
        layer: the whole-body layer of a former episode, to be used again: see `sim.episode.build.make_layer`.
        estimator: the estimator of a former episode, likewise.
        world: the compiled world of a former episode, likewise: see `sim.episode.humanoid_world.compiled_in`.
        polygons: whether to work out the sets' outlines for the figure.
        on_tick: called after each tick with the episode.

    Raises:
        InputError: if the scenario asks for what its robot does not have, or a controller that is not ours fails.
    """
    robot = robot or load_robot(scenario.robot)
    check_against(scenario, robot)
    plant = make_plant(scenario, robot, layer, estimator, world)
    controller = controller or make_controller(scenario, robot)
    episode = Episode(scenario, plant, controller, polygons=polygons, on_tick=on_tick)
    while episode.tick():
        if progress is not None and episode.ticks % 100 == 1:
            progress(episode.time)
    return episode.result()
