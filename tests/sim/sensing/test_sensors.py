"""Each sensor against the truth: its noise, its constant error, its rounding, its range, its rate and its latency."""

from __future__ import annotations

import math
from itertools import chain
from typing import Any

import numpy as np
import pytest

from controllers.senses import Reading
from models.arena import SIDES
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from scenarios.sensing import FootSensors, Imu, JointSensors
from sim.episode.humanoid_world import HumanoidWorld
from sim.sensing.encoder import Encoders
from sim.sensing.foot_force import FootForce
from sim.sensing.imu import InertialUnit
from sim.sensing.sensors import Sensors

ROBOT = load_robot("utmu2")
SAMPLES = 4000
# The standard deviation of 4000 samples is known to 1.1 % (one sigma), of 12000 to 0.6 %.
LOOSE = 0.06


def scenario(**sensing: Any) -> Scenario:
    return load("quiet", {"duration": 0.5, "pushes": [], "sensing": {"preset": "ideal"} | sensing})


def standing(**sensing: Any) -> HumanoidWorld:
    """A world in which the servos hold the robot up and it has come to rest."""
    world = HumanoidWorld(scenario(**sensing), ROBOT)
    world.physics.step(300)
    return world


def imu(world: HumanoidWorld, seed: int = 0, **figures: float) -> InertialUnit:
    return InertialUnit(Imu(**figures), ROBOT, world.physics.model.ptr, world.physics.data.ptr, seed)


def feet(world: HumanoidWorld, seed: int = 0, **figures: float) -> FootForce:
    return FootForce(FootSensors(**figures), ROBOT, world.physics.model.ptr, world.physics.data.ptr, seed)


def test_encoders_round_to_counts_and_keep_their_offset() -> None:
    true = np.random.default_rng(0).uniform(-1.0, 1.0, (SAMPLES, 20))
    count = 2 * math.pi / 2**14
    exact, rounded = Encoders(JointSensors(), 20, 0), Encoders(JointSensors(counts=2**14), 20, 0)
    np.testing.assert_array_equal(exact.measure(true), true)
    error = rounded.measure(true) - true
    assert np.abs(error).max() <= 0.5 * count * (1 + 1e-9)
    assert error.std() == pytest.approx(count / math.sqrt(12), rel=LOOSE)
    whole = rounded.measure(true) / count
    np.testing.assert_allclose(whole, np.round(whole), atol=1e-6)
    many = np.array([Encoders(JointSensors(offset=1e-3), 20, seed).offset for seed in range(200)])
    assert many.std() == pytest.approx(1e-3, rel=LOOSE)
    one = Encoders(JointSensors(offset=1e-3), 20, 7)
    np.testing.assert_allclose(one.measure(true) - true, np.broadcast_to(one.offset, true.shape), atol=1e-15)


def test_imu_has_its_noise_and_a_bias_that_is_constant() -> None:
    world = standing()
    ideal = imu(world).measure()
    unit = imu(world, gyro_noise=0.005, accelerometer_noise=0.05, gyro_bias=0.003, accelerometer_bias=0.2)
    error = np.array([unit.measure() for _ in range(SAMPLES)]) - ideal
    np.testing.assert_allclose(error.std(axis=0).mean(axis=1), [0.005, 0.05], rtol=LOOSE)
    # White: neighbours are not alike.
    centred = error - error.mean(axis=0)
    assert np.abs((centred[1:] * centred[:-1]).mean(axis=0) / centred.var(axis=0)).max() < 0.08
    first, second = error[: SAMPLES // 2].mean(axis=0), error[SAMPLES // 2 :].mean(axis=0)
    assert (np.abs(first - second) < 6 * np.array([[0.005], [0.05]]) / math.sqrt(SAMPLES / 2)).all()
    biases = np.array([imu(world, s, gyro_bias=0.003, accelerometer_bias=0.2).measure() for s in range(500)]) - ideal
    np.testing.assert_allclose(biases.std(axis=0).mean(axis=1), [0.003, 0.2], rtol=2 * LOOSE)


def test_imu_ends_at_its_range() -> None:
    unit = imu(standing(), gyro_noise=1.0, gyro_range=0.5, accelerometer_range=9.0)
    said = np.array([unit.measure() for _ in range(200)])
    assert np.abs(said[:, 0]).max() == 0.5
    assert (np.abs(said[:, 0]) < 0.5).any()
    np.testing.assert_array_equal(said[:, 1, 2], 9.0)


def test_accelerometer_at_rest_points_up_and_its_integral_is_the_velocity() -> None:
    push = {"start": 0.1, "direction": 30.0, "delta_v": 0.4}
    world = HumanoidWorld(scenario().model_copy(update={"pushes": load("quiet", {"pushes": [push]}).pushes}), ROBOT)
    data, unit = world.physics.data.ptr, imu(world)
    np.testing.assert_allclose(np.linalg.norm(unit.measure()[1]), ROBOT.gravity, rtol=1e-9)
    velocity = np.zeros(3)
    for _ in range(300):
        before = data.xmat[1].reshape(3, 3).copy()
        world.physics.step(1)
        rate, force = unit.measure()
        after = data.xmat[1].reshape(3, 3)
        np.testing.assert_array_equal(rate, data.qvel[3:6])
        velocity += 0.001 * (0.5 * (before + after) @ force - [0.0, 0.0, ROBOT.gravity])
    true = data.qvel[:3] + after @ np.cross(data.qvel[3:6], ROBOT.imu)
    assert np.linalg.norm(true) > 0.1
    # The attitude halfway is a chord's: 1 mm/s in 0.3 s.
    np.testing.assert_allclose(velocity, true, atol=1e-3)


def test_soles_feel_the_weight_and_where_it_presses() -> None:
    world = standing()
    truth, (force, cop) = world.observe(), feet(world).measure()
    assert sum(force.values()) == pytest.approx(ROBOT.mass * ROBOT.gravity, rel=0.02)
    data = world.physics.data.ptr
    pressed = np.zeros(2)
    for side in SIDES:
        site = data.site(f"{side}_sole")
        pressed += force[side] * (site.xpos + site.xmat.reshape(3, 3)[:, :2] @ cop[side])[:2]
    np.testing.assert_allclose(pressed / sum(force.values()), truth.zmp, atol=1e-4)


def test_soles_have_their_noise_and_scale() -> None:
    world = standing()
    true, at = feet(world).measure()
    sensor = feet(world, force_noise=0.5, cop_noise=0.001)
    said = [sensor.measure() for _ in range(SAMPLES)]
    half = 0.5 * ROBOT.mass * ROBOT.gravity
    for side in SIDES:
        force = np.array([one[0][side] for one in said])
        assert force.mean() == pytest.approx(true[side], abs=6 * 0.5 / math.sqrt(SAMPLES))
        assert force.std() == pytest.approx(0.5, rel=LOOSE)
        spread = (np.array([one[1][side] for one in said]) - at[side]).std()
        assert spread == pytest.approx(0.001 * half / true[side], rel=LOOSE)
    scales = [feet(world, seed, scale_error=0.03).measure()[0]["left"] / true["left"] for seed in range(500)]
    assert np.std(scales) == pytest.approx(0.03, rel=2 * LOOSE)


def test_a_sole_that_bears_too_little_has_no_centre_of_pressure() -> None:
    world = standing()
    force, cop = feet(world, least_force=100.0).measure()
    assert all(force[side] > 10.0 and np.isnan(cop[side]).all() for side in SIDES)


def said(seed: int = 0, ticks: int = 10, **sensing: Any) -> list[list[Reading]]:
    """What arrives in each of some ticks while the robot falls into its stand."""
    asked = scenario(**sensing).model_copy(update={"seed": seed})
    world = HumanoidWorld(asked, ROBOT)
    sensors = Sensors(asked, ROBOT, world.physics.model.ptr, world.physics.data.ptr)
    world.physics.watch(sensors.sample)
    sensors.sample(0)
    found = []
    for tick in range(ticks):
        found.append(sensors.arrived(tick * asked.timing.substeps, tick * asked.timing.control))
        world.physics.step(asked.timing.substeps)
    return found


@pytest.mark.parametrize("steps", [0, 1, 3, 4])
def test_latency_is_exact_to_the_physics_step(steps: int) -> None:
    prompt, late = said(), said(latency=steps / 1000)
    for tick, readings in enumerate(late):
        taken = [round(1000 * reading.taken) for reading in readings]
        newest = 2 * tick - steps
        assert taken == [ms for ms in (newest - 1, newest) if ms >= 0]
        assert all(reading.time == pytest.approx(0.002 * tick) for reading in readings)
    by_time = {round(1000 * one.taken): one for readings in prompt for one in readings}
    for one in (one for readings in late for one in readings):
        same = by_time[round(1000 * one.taken)]
        np.testing.assert_array_equal(one.joint_position, same.joint_position)
        np.testing.assert_array_equal(one.gyro, same.gyro)


def test_a_slow_sensor_holds_what_it_said() -> None:
    readings = [one for many in said(imu={"rate": 250.0}) for one in many]
    for one in readings:
        held = readings[4 * (round(1000 * one.taken) // 4)]
        np.testing.assert_array_equal(one.gyro, held.gyro)
    assert len({one.gyro.tobytes() for one in readings}) == math.ceil(len(readings) / 4)
    assert len({one.joint_position.tobytes() for one in readings}) == len(readings)
    slow = said(joint={"rate": 100.0}, imu={"rate": 100.0}, foot={"rate": 100.0})
    assert [len(many) for many in slow] == [1, 0, 0, 0, 0, 1, 0, 0, 0, 0]


@pytest.mark.parametrize(("physics", "readings"), [(0.0005, 10), (0.001, 10), (0.002, 5)])
def test_a_preset_s_sensors_are_read_a_thousand_times_a_second_if_the_physics_is_that_fine(
    physics: float, readings: int
) -> None:
    asked = load("quiet", {"sensing": {"preset": "typical"}, "timing": {"physics": physics}})
    world = HumanoidWorld(asked, ROBOT)
    sensors = Sensors(asked, ROBOT, world.physics.model.ptr, world.physics.data.ptr)
    world.physics.watch(sensors.sample)
    world.physics.step(round(0.01 / physics))
    found = sensors.arrived(round(0.01 / physics), 0.01)
    assert len(found) == len({one.gyro.tobytes() for one in found}) == readings


def test_the_seed_decides_and_no_sensor_disturbs_another() -> None:
    first, again, other = said(preset="typical"), said(preset="typical"), said(1, preset="typical")
    quiet = said(preset="typical", foot={"force_noise": 0.0})
    for one, same, else_, less in zip(*(chain(*x) for x in (first, again, other, quiet)), strict=True):
        np.testing.assert_array_equal(one.gyro, same.gyro)
        np.testing.assert_array_equal(one.accelerometer, same.accelerometer)
        assert one.force == same.force
        assert (one.gyro != else_.gyro).all()
        np.testing.assert_array_equal(one.gyro, less.gyro)
        assert one.force != less.force
