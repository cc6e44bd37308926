"""Episodes of the whole body on the truth, with sensors beside it, and an estimator that runs along, open loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.estimation.beliefs import SensorFigures
from controllers.estimation.ekf import InvariantEkf
from controllers.estimation.options import EkfOptions
from controllers.interface import JointTargets, Observation
from controllers.senses import Reading
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import HumanoidPlant, make_plant
from sim.results.push_size import edge_distance
from sim.sensing.nominal_body import SimulatedBody
from sim.sensing.sensors import Sensors

Array = NDArray[np.float64]

PUSH = 0.5
FALLEN = 0.75  # of the COG's height


@dataclass
class Record:
    """What happened, a tick each; `targets` are those of the tick."""

    robot: Robot
    dt: float
    push: Array  # (3,) impulse [N s]
    readings: list[list[Reading]] = field(default_factory=list)
    truth: list[Observation] = field(default_factory=list)
    targets: list[JointTargets] = field(default_factory=list)


def pushed(size: float, direction: float, *, seed: int = 1, duration: float = 4.0, **sensing: Any) -> Scenario:
    """One push of `size` omega d on the trunk; the controllers see the truth unless `sensing` says otherwise."""
    robot = load_robot("utmu2")
    angle = math.radians(direction)
    distance = edge_distance(robot, np.array([math.cos(angle), math.sin(angle)]))
    push = {"start": PUSH, "direction": direction, "delta_v": size * robot.omega * distance}
    fields = {"description": "a push", "duration": duration, "seed": seed, "pushes": [push], "sensing": sensing}
    return Scenario.model_validate(fields)


@cache
def record(size: float, direction: float, preset: str = "typical", latency: float = 0.0) -> Record:
    return record_scenario(pushed(size, direction), preset=preset, latency=latency)


def record_scenario(scenario: Scenario, **sensing: Any) -> Record:
    """Run the scenario's controller on the truth, until it falls or rests, with the sensors of `sensing` beside it."""
    robot = load_robot(scenario.robot)
    plant = make_plant(scenario, robot)
    assert isinstance(plant, HumanoidPlant)
    physics = plant.world.physics
    worn = Scenario.model_validate(scenario.as_dict() | {"sensing": sensing})
    kept = Record(robot, scenario.timing.control, scenario.pushes[0].impulse_vector(robot.mass))
    episode = Episode(scenario, plant, make_controller(scenario, robot))
    sensors = Sensors(worn, robot, physics.model.ptr, physics.data.ptr)
    sensors.sample(0)
    physics.watch(sensors.sample)
    going = True
    while going:
        arrived = sensors.arrived(episode.ticks * scenario.timing.substeps, episode.time)
        going = episode.tick()
        if not going or episode.truth.cog[2] < FALLEN * robot.cog_height:
            break
        assert plant.targets is not None
        kept.readings.append(arrived)
        kept.truth.append(episode.truth)
        kept.targets.append(plant.targets)
    return kept


def estimator(robot: Robot, dt: float, *, at_drive: bool = False, **options: Any) -> InvariantEkf:
    found = InvariantEkf(robot, dt, EkfOptions(**options), SensorFigures(at_drive=at_drive))
    found.nominal_body = SimulatedBody(robot, at_drive=at_drive)
    return found


def follow(kept: Record, ekf: InvariantEkf) -> list[Observation]:
    """What the estimator makes of the readings, a tick each."""
    ekf.reset(kept.truth[0])
    targets = [None, *kept.targets]
    return [
        ekf.estimate(arrived, given, truth.time)
        for arrived, given, truth in zip(kept.readings, targets, kept.truth, strict=False)
    ]


@dataclass(frozen=True)
class Errors:
    """A row a tick from the push on; the DCM is told from the soles that carry, for place itself drifts."""

    velocity: Array  # (k, 3) of the COG [m/s]
    dcm: Array  # (k, 2) with the angular momentum about the COG [m]
    tilt: Array  # (k, 1) [rad]
    joints: Array  # (k, n) [rad/s]


def errors_of(kept: Record, found: list[Observation]) -> Errors:
    robot = kept.robot
    lever = robot.mass * robot.cog_height
    velocities, dcms, tilts, joints = [], [], [], []
    for true, seen in zip(kept.truth, found, strict=True):
        load = {side: true.feet[side].force for side in SIDES}
        total = sum(load.values())
        if true.time < PUSH or total < 0.1 * robot.mass * robot.gravity:
            continue
        drift = sum(load[side] * (seen.feet[side].position - true.feet[side].position) for side in SIDES) / total
        velocity = seen.cog_velocity - true.cog_velocity
        spin = seen.angular_momentum - true.angular_momentum
        moved = (seen.cog - true.cog - drift)[:2]
        velocities.append(velocity)
        dcms.append(moved + (velocity[:2] + np.array([spin[1], -spin[0]]) / lever) / robot.omega)
        # the sine of a small angle: an arc cosine near 1 is rounded off
        tilts.append([np.linalg.norm(np.cross(_down(true), _down(seen)))])
        joints.append(seen.velocity[6:] - true.velocity[6:])
    return Errors(np.array(velocities), np.array(dcms), np.array(tilts), np.array(joints))


def _down(observation: Observation) -> Array:
    """The vertical, seen from the trunk."""
    w, x, y, z = observation.configuration[3:7].tolist()
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


def rms(errors: Array) -> float:
    """Of the rows' lengths."""
    return math.sqrt(float((errors**2).sum(axis=1).mean()))


def peak(errors: Array) -> float:
    """The longest row."""
    return float(np.linalg.norm(errors, axis=1).max())
