"""Writes an episode down: a row a control tick, and what each push did."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.fields import file_hash
from controllers.interface import (
    BalanceCommand,
    BalanceController,
    Decision,
    JointController,
    Observation,
    Phase,
    Predictor,
    Regional,
)
from controllers.registry import CONTROLLERS
from models.arena import SIDES
from models.robot import Robot
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.plant import Action, Condition, Effort, Plant
from sim.episode.push_record import PushRecord, check_delivered, next_after, push_record
from sim.episode.set_polygons import PLANES, SetPolygon, admissible_polygons
from sim.episode.step_count import StepCount
from sim.record.motors import MotorLog, MotorUse
from sim.record.outcome import EarlyEnd
from sim.record.push_columns import PushColumns, combined
from sim.record.seen import away, in_the_world, loaded_soles, seen_row
from sim.record.support_slack import SupportSlack
from sim.record.trace import SEEN_CHANNELS, SEEN_STANCE_CHANNELS, Trace, TraceRecorder
from sim.record.versions import commit, versions

Array = NDArray[np.float64]

# What a tick's row says of a force that is not there, of where it acts, and of a point of the plane that nobody names.
_NO_FORCE = (0.0, 0.0, 0.0)
_NOWHERE = (math.nan, math.nan, math.nan)
_NO_POINT = (math.nan, math.nan)
_SEEN = len(SEEN_CHANNELS) + len(SEEN_STANCE_CHANNELS)


class Recording:
    """The record of one episode, filled tick by tick.

    A tick is recorded in two halves: `see` before the physics runs, `close` after it.

    Attributes:
        period: control period [s].
        aside: wall time spent on those outlines [s], which are no part of the control loop.
    """

    def __init__(
        self,
        scenario: Scenario,
        plant: Plant,
        controller: BalanceController | JointController | None,
        *,
        polygons: bool = False,
    ) -> None:
        """Make room for the whole episode.

        Args:
            scenario: what happens.
            plant: the world.
            controller: who answers, for what it predicts; None if the actions come from outside.
            polygons: whether to work out the sets' outlines.
        """
        robot = plant.robot
        self._polygons: tuple[SetPolygon, ...] = ()
        self._last_polygons: tuple[SetPolygon, ...] = ()
        self.aside = 0.0
        joints = robot.joint_names if scenario.world == "humanoid" else None
        self.period = scenario.timing.control
        self._scenario = scenario
        self._robot = robot
        self._files = {option: file_hash(path) for option, path in scenario.controller.files(CONTROLLERS).items()}
        self._recorder = TraceRecorder(scenario.ticks, joints=joints, seen=not scenario.sensing.is_true)
        self._at = _Columns(self._recorder, joints is not None)
        # A late or noisy true state is not lost in the world, as an estimator's is.
        self._drifts = scenario.sensing.estimates
        last = max((push.end for push in scenario.pushes), default=None)
        self._early = EarlyEnd(
            self._recorder.index,
            cog_height=robot.cog_height,
            last_push=last,
            rest=scenario.judge.rest,
            period=self.period,
        )
        self._ended: dict[int, dict[str, Any]] = {}
        self._support = SupportSlack(robot)
        self._row = np.empty(0)
        self._acting: dict[int, tuple[Array, Array]] = {}
        self._closed = 0
        self._steps = StepCount()
        # Asking a protocol takes 40 us.
        self._predictor = controller if isinstance(controller, Predictor) else None
        self._regional = controller if isinstance(controller, Regional) and polygons else None
        self._pushes = PushColumns()
        self._motors = MotorLog(robot, scenario.ticks if joints else 0)

    @property
    def set_polygons(self) -> tuple[SetPolygon, ...]:
        """Outlines of the sets at the end of each push that left the regulator's set, and of those that end last."""
        return self._polygons + self._last_polygons

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the columns of a row."""
        return tuple(self._recorder.index)

    @property
    def row(self) -> Array:
        """(c,) the latest row, as it is now."""
        return self._row.copy()

    @property
    def acting(self) -> Mapping[int, tuple[Array, Array]]:
        """The pushes that acted in the latest tick: index -> (3,) mean force [N] or torque [N m], (3,) where [m]."""
        return self._acting

    def see(self, observation: Observation, condition: Condition, action: Action, seen: Observation) -> bool:
        """Write the state, the action and what was seen in this tick; True if the episode may end here.

        Joint targets say neither a ZMP, nor which foot is to stand: what stands is then what the floor carries.
        """
        at, row = self._at, self._recorder.row()
        self._row, self._acting = row, {}
        soles = None if at.seen is None else loaded_soles(observation, seen)
        stands = self._steps.standing(observation, action)
        if isinstance(action, BalanceCommand):
            command = in_the_world(action.zmp, soles) if self._drifts and soles is not None else action.zmp.tolist()
            phase = action.phase
        else:
            command, phase = _NO_POINT, Phase.STANDING if all(stands.values()) else Phase.STEPPING
        feet: list[float] = []
        for side in SIDES:
            foot = observation.feet[side]
            feet += (*foot.position.tolist(), foot.yaw, foot.force, stands[side])
        # In the order of the channels, for one assignment takes a tenth of the time of thirty.
        row[: at.effort] = (
            observation.time,
            *observation.cog.tolist(),
            *observation.cog_velocity.tolist(),
            *observation.zmp.tolist(),
            *command,
            *feet,
            condition.trunk_tilt,
            condition.other_contact,
            *_NO_FORCE,
            *_NOWHERE,
            phase.value,
            self._steps.see(stands),
            *(_NO_POINT if self._predictor is None else self._predictor.slacks),
            self._support.of(observation),
        )
        if at.seen is not None and soles is not None:
            row[at.seen : at.seen + _SEEN] = seen_row(observation, seen, soles, self._robot.omega)
        if at.root is not None:
            row[at.root :] = observation.configuration
        self._note_ended_pushes(observation, seen)
        return self._early.update(row)

    def push_added(self, scenario: Scenario) -> None:
        """Go on with a scenario that has one push more, which has not begun."""
        self._scenario = scenario
        self._early.postpone(max(push.end for push in scenario.pushes))
        self._last_polygons = ()

    def close(self, effort: Effort, plant: Plant) -> None:
        """Write how the tick went: the mean forces of the pushes, where they acted, and the motors."""
        at, row = self._at, self._row
        forces, points = [], []
        for index, impulse in plant.impulse_log.take().items():
            mean, point = impulse / self.period, plant.push_point(index)
            self._pushes.add(self._closed, index, mean, point)
            self._acting[index] = mean, point
            if self._scenario.pushes[index].torque is None:
                forces.append(mean)
                points.append(point)
        if forces:
            row[at.push : at.push + 3], row[at.push + 3 : at.push + 6] = combined(forces, points)
        row[at.effort] = effort.solver_failed
        self._closed += 1
        if effort.torque is not None and effort.speed is not None:
            self._motors.add(effort.torque, effort.speed)

    def trace(self, world: Mapping[str, Any]) -> Trace:
        """The record so far; `world` is what the metadata say of it beside the scenario."""
        self._recorder.fill(self._motors.channels())
        controller = CONTROLLERS.entry(self._scenario.controller.name)
        return self._recorder.trace(
            {
                "scenario": self._scenario.as_dict(),
                "robot": robot_facts(self._robot),
                "controller_source": controller.source,
                "controller_files": self._files,
                "versions": versions(controller.libraries),
                "commit": commit(),
                "seed": self._scenario.seed,
                **world,
            },
            self._pushes.columns(self._scenario.pushes, self._scenario.apart, len(self._recorder)),
        )

    def motors(self) -> MotorUse | None:
        """How much of the motors was used so far; None for the pendulum."""
        return self._motors.use(self.period)

    def pushes(self, plant: Plant, trace: Trace) -> list[PushRecord]:
        """What became of each push.

        Raises:
            InputError: if one that is over has not given the robot what was asked.
        """
        stepping = trace["phase"] == Phase.STEPPING.value
        records, pushes = [], self._scenario.pushes
        for index, (push, cut) in enumerate(zip(pushes, plant.impulse_log.scheduled, strict=True)):
            following = next_after(pushes, index)
            until = math.inf if following is None else pushes[following].start
            # From the tick in which it begins; one that was not reached finds the last.
            first = max(int(np.searchsorted(trace.time, push.start + 1e-9)) - 1, 0)
            during = stepping[first : max(int(np.searchsorted(trace.time, until)), first + 1)]
            delivered, ended = plant.impulse_log.delivered[index], self._ended.get(index)
            if ended is not None and cut.beyond <= self._closed * self._scenario.timing.substeps:
                check_delivered(index, push, self._robot.mass, delivered)
            chosen = (Phase.STEPPING if during.any() else Phase.STANDING).name.lower()
            records.append(push_record(push, self._robot, delivered, ended=ended, chosen=chosen))
        return records

    def _note_ended_pushes(self, observation: Observation, seen: Observation) -> None:
        pushes = self._scenario.pushes
        for index, push in enumerate(pushes):
            if index in self._ended or observation.time < push.end - 1e-9:
                continue
            ended: dict[str, Any] = {"velocity": tuple(observation.cog_velocity.tolist())}
            if self._predictor is not None:
                said = self._predictor.predict()
                ended |= {"regulator_slack": said.standing, "tracking_slack": said.stepping}
                if said.standing is None or not said.standing >= 0.0:
                    self._polygons += self._outlines(index, push, observation, seen)
                elif push.end >= max(other.end for other in pushes) - 1e-9:
                    self._last_polygons += self._outlines(index, push, observation, seen)
            self._ended[index] = ended

    def _outlines(self, index: int, push: Push, observation: Observation, seen: Observation) -> tuple[SetPolygon, ...]:
        """Outlines of the sets through the state that was seen, in the plane that the push goes along.

        They are about the feet as they are seen, and are drawn about the feet as they are.
        """
        if self._regional is None:
            return ()
        begin = time.perf_counter()
        plane = tuple(PLANES)[push.axis]
        found = admissible_polygons(self._regional, self._robot, seen.balance_state(), push=index + 1, planes=(plane,))
        shift = np.array([away(observation, seen)[push.axis], 0.0])
        found = tuple(replace(one, vertices=one.vertices + shift) for one in found)
        self.aside += time.perf_counter() - begin
        return found


class _Columns:
    """Where the blocks of a row begin."""

    def __init__(self, recorder: TraceRecorder, humanoid: bool) -> None:
        index = recorder.index
        self.push = index["push_fx"]
        self.effort = index["solver_failed"]
        self.seen = index.get("seen_cog_x")
        self.root = index["root_x"] if humanoid else None


def robot_facts(robot: Robot) -> dict[str, Any]:
    """What a reader of a trace needs to know of the robot; JSON types only."""
    return {
        "name": robot.name,
        "path": robot.path.name,
        "sha256": robot.sha256,
        "mass": robot.mass,
        "gravity": robot.gravity,
        "cog_height": robot.cog_height,
        "omega": robot.omega,
        "sole_vertices": {side: robot.sole_vertices[side].tolist() for side in SIDES},
    }


def decision_as_dict(decision: Decision) -> dict[str, Any]:
    """A decision of JSON types; NaN becomes null."""
    fields = asdict(decision) | {"phase": decision.phase.name.lower()}
    return {key: None if isinstance(value, float) and math.isnan(value) else value for key, value in fields.items()}
