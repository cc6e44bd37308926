"""Episodes of the whole body in MuJoCo, recorded at 1 kHz, and what sensors with errors would have said."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from controllers.interface import JointTargets, Observation
from controllers.senses import Estimator, Reading
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.humanoid_world import HumanoidWorld
from sim.episode.plant import HumanoidPlant, make_plant
from sim.results.push_size import edge_distance

Array = NDArray[np.float64]

STEP = 0.001
TICK = 0.002


@dataclass(frozen=True)
class Sample:
    """The sensors without errors; force and CoP are one physics step older, in the sole's frame of then."""

    joint_position: Array
    gyro: Array
    accelerometer: Array
    force: dict[str, float]
    cop: dict[str, Array]
    velocity: Array = None  # (3,) of the IMU in the world
    rotation: Array = None


@dataclass
class Record:
    robot: Robot
    samples: list[Sample] = field(default_factory=list)  # at 0, 1, 2, ... ms
    truth: list[Observation] = field(default_factory=list)  # a tick
    targets: list[JointTargets] = field(default_factory=list)  # a tick
    push_start: float = 0.0


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """Standard deviations; what is not noise is drawn once an episode."""

    counts: int = 200_000  # of a joint's turn
    gyro_noise: float = 0.005
    gyro_bias: float = 0.003
    accelerometer_noise: float = 0.05
    accelerometer_bias: float = 0.05
    force_noise: float = 0.5
    force_scale: float = 0.03
    cop_noise: float = 0.001  # at 20 N, less above


TYPICAL = SensorErrors()


def pushed(size: float, direction: float, *, seed: int = 0, duration: float = 4.0, start: float = 0.5) -> Scenario:
    """One push of `size` omega d."""
    robot = load_robot("utmu2")
    angle = math.radians(direction)
    distance = edge_distance(robot, np.array([math.cos(angle), math.sin(angle)]))
    push = {"start": start, "direction": direction, "delta_v": size * robot.omega * distance}
    fields = {"description": "a push", "duration": duration, "seed": seed, "pushes": [push]}
    return Scenario.model_validate(fields)


@cache
def record(size: float, direction: float, seed: int = 0) -> Record:
    return record_scenario(pushed(size, direction, seed=seed))


def record_scenario(scenario: Scenario) -> Record:
    """Run the scenario's controller on the truth; until the robot falls or the episode is over."""
    robot = load_robot(scenario.robot)
    plant = make_plant(scenario, robot)
    assert isinstance(plant, HumanoidPlant)
    world = plant.world
    kept = Record(robot, push_start=scenario.pushes[0].start if scenario.pushes else 0.0)
    poses = _sole_poses(world)
    kept.samples.append(_sample(world, poses))
    step = world.physics.step

    def sampled(nstep: int = 1) -> None:
        for _ in range(nstep):
            before = _sole_poses(world)
            step(1)
            kept.samples.append(_sample(world, before))

    world.physics.step = sampled  # type: ignore[method-assign]
    controller = make_controller(scenario, robot)
    episode = Episode(scenario, plant, controller)
    while episode.tick():
        kept.truth.append(episode.truth)
        kept.targets.append(plant._targets)  # type: ignore[arg-type]
        if episode.truth.cog[2] < 0.75 * robot.cog_height:
            break
    return kept


def _sole_poses(world: HumanoidWorld) -> dict[str, tuple[Array, Array]]:
    data = world._data
    sites = {side: data.site(f"{side}_sole") for side in SIDES}
    return {side: (site.xpos.copy(), site.xmat.reshape(3, 3).copy()) for side, site in sites.items()}


def _sample(world: HumanoidWorld, poses: dict[str, tuple[Array, Array]]) -> Sample:
    data = world._data
    force, cop = {}, {}
    for side, (position, rotation) in poses.items():
        at = world._sole_at[side]
        _, fx, fy, fz, _, _, _, px, py, pz = data.sensordata[at : at + 10].tolist()
        force[side] = -float((rotation.T @ np.array([fx, fy, fz]))[2])
        cop[side] = (rotation.T @ (np.array([px, py, pz]) - position))[:2]
    return Sample(
        data.qpos[7:].copy(), data.sensor("gyro").data.copy(), data.sensor("accelerometer").data.copy(), force, cop,
        data.qvel[:3] + data.xmat[world._trunk].reshape(3, 3) @ np.cross(data.qvel[3:6], world.robot.imu), data.xmat[world._trunk].reshape(3, 3).copy()
    )


def readings(kept: Record, errors: SensorErrors | None, seed: int = 0, latency: float = 0.0) -> list[Reading]:
    """What the sensors say, 1 kHz; without errors if there are none."""
    rng = np.random.default_rng([seed, 17])
    bias = rng.standard_normal(6)
    scale = dict(zip(SIDES, rng.standard_normal(2), strict=True))
    said = []
    for k, sample in enumerate(kept.samples):
        q, gyro, specific = sample.joint_position, sample.gyro, sample.accelerometer
        force, cop = {}, {}
        noise = rng.standard_normal(12)
        if errors is not None:
            count = 2 * math.pi / errors.counts
            q = np.round(q / count) * count
            gyro = gyro + errors.gyro_bias * bias[:3] + errors.gyro_noise * noise[:3]
            specific = specific + errors.accelerometer_bias * bias[3:] + errors.accelerometer_noise * noise[3:6]
        for i, side in enumerate(SIDES):
            true, at = sample.force[side], sample.cop[side]
            if errors is not None and true > 0.0:
                at = at + errors.cop_noise * min(20.0 / true, 10.0) * noise[8 + 2 * i : 10 + 2 * i]
            if errors is not None:
                true = true * (1 + errors.force_scale * scale[side]) + errors.force_noise * noise[6 + i]
            force[side] = max(0.0, true)
            cop[side] = at if true > 1.0 else np.full(2, math.nan)
        taken = k * STEP
        arrives = math.ceil(round((taken + latency) / TICK, 6)) * TICK
        said.append(
            Reading(
                time=arrives, taken=taken, joint_position=q, gyro=gyro, accelerometer=specific, force=force, cop=cop
            )
        )
    return said


def follow(kept: Record, estimator: Estimator, said: list[Reading]) -> list[Observation]:
    """The estimator runs along, open loop: what it makes of the readings, a tick each."""
    estimator.reset(kept.truth[0])
    found, i = [], 0
    for tick, truth in enumerate(kept.truth):
        new = []
        while i < len(said) and said[i].time <= truth.time + 1e-9:
            new.append(said[i])
            i += 1
        targets = kept.targets[tick - 1] if tick else None
        found.append(estimator.estimate(new, targets, truth.time))
    return found


@dataclass(frozen=True)
class Errors:
    """Per tick from the push on; place is told relative to the soles that carry, as place itself drifts."""

    cog: Array  # (k, 2) [m]
    velocity: Array  # (k, 3) of the COG [m/s]
    dcm: Array  # (k, 2) with the angular momentum about the COG [m]
    tilt: Array  # (k,) [rad]
    joints: Array  # (k,) RMS over the joints [rad/s]


def errors_of(kept: Record, found: list[Observation]) -> Errors:
    robot, rows = kept.robot, []
    lever = robot.mass * robot.cog_height
    for true, seen in zip(kept.truth, found, strict=True):
        if true.time < kept.push_start:
            continue
        load = {side: true.feet[side].force for side in SIDES}
        total = sum(load.values())
        if total < 5.0:
            continue
        drift = sum(load[side] * (seen.feet[side].position - true.feet[side].position) for side in SIDES) / total
        cog = (seen.cog - true.cog - drift)[:2]
        velocity = seen.cog_velocity - true.cog_velocity
        spin = seen.angular_momentum - true.angular_momentum
        dcm = cog + (velocity[:2] + np.array([spin[1], -spin[0]]) / lever) / robot.omega
        joints = math.sqrt(float(np.mean((seen.velocity[6:] - true.velocity[6:]) ** 2)))
        rows.append((*cog, *velocity, *dcm, _tilt(true, seen), joints))
    table = np.array(rows)
    return Errors(table[:, :2], table[:, 2:5], table[:, 5:7], table[:, 7], table[:, 8])


def _tilt(true: Observation, seen: Observation) -> float:
    ups = []
    for observation in (true, seen):
        w, x, y, z = observation.configuration[3:7].tolist()
        ups.append(np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]))
    # the angle's sine: an arc cosine near 1 is rounded off
    return math.asin(min(1.0, float(np.linalg.norm(np.cross(*ups)))))


def rms(errors: Array) -> float:
    """Of the length of the rows."""
    return math.sqrt(float((errors**2).sum(axis=-1).mean())) if errors.ndim > 1 else math.sqrt(float((errors**2).mean()))


def peak(errors: Array) -> float:
    return float(np.linalg.norm(errors, axis=-1).max()) if errors.ndim > 1 else float(np.abs(errors).max())
