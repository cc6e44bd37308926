"""What a push delivers is what was asked, in both worlds and however it falls on the physics steps."""

from __future__ import annotations

import numpy as np
import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import make_plant

# Sums of a few hundred forces of order 100 N over steps of 1 ms.
EXACT = 1e-9


def scenario(world: str, **push: object) -> Scenario:
    fields = {
        "description": "one push",
        "world": world,
        "controller": "statue",
        "duration": 0.6,
        "pushes": [{"start": 0.1, "direction": 30.0, "impulse": 0.7} | push],
    }
    return Scenario.model_validate(fields)


def episode_of(asked: Scenario) -> Episode:
    robot = load_robot("utmu2")
    return Episode(asked, make_plant(asked, robot), make_controller(asked, robot))


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
@pytest.mark.parametrize("shape", ["rectangular", "half_sine"])
@pytest.mark.parametrize(("start", "duration"), [(0.1, 0.1), (0.1003, 0.0617), (0.1, 0.0004), (0.10149, 0.20033)])
def test_delivered_impulse(world: str, shape: str, start: float, duration: float) -> None:
    asked = scenario(world, shape=shape, start=start, duration=duration)
    robot = load_robot("utmu2")
    episode = episode_of(asked)
    plant = episode.plant
    while episode.time < 0.4:
        episode.tick()
    assert plant.impulse_log.delivered[0] == pytest.approx(asked.pushes[0].impulse_vector(robot.mass), abs=EXACT)
    result = episode.result()
    (record,) = result.pushes
    assert record.delivered_impulse == pytest.approx(0.7, abs=EXACT)
    # The trace tells the same: force of each tick times its length.
    trace = result.trace
    force = np.column_stack([trace["push_fx"], trace["push_fy"], trace["push_fz"]])
    assert np.nansum(force, axis=0) * asked.timing.control == pytest.approx(plant.impulse_log.delivered[0], abs=EXACT)


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_a_run_that_loses_a_push_fails(world: str) -> None:
    episode = episode_of(scenario(world))
    while episode.time < 0.3:
        episode.tick()
    log = episode.plant.impulse_log
    log.delivered[0] *= 0.999
    with pytest.raises(InputError, match=r"^pushes\[0\]: asked \[.*\] N s, delivered \[.*\] N s; .* is not kept$"):
        episode.result()
    # While it lasts, a push may have given less.
    episode = episode_of(scenario(world))
    while episode.time < 0.15:
        episode.tick()
    (record,) = episode.result().pushes
    assert (record.reached, record.delivered_impulse) == (False, pytest.approx(0.35, abs=EXACT))


def test_the_body_takes_up_the_impulse_that_is_booked() -> None:
    """Momentum of the whole body: a push without floor contact changes it by the impulse."""
    asked = scenario("humanoid", direction=None, vector=[1.0, 2.0, -0.5], body="left_forearm", duration=0.0505)
    robot = load_robot("utmu2")
    episode = episode_of(asked)
    plant = episode.plant
    world = plant.world  # type: ignore[attr-defined]
    data, model = world.physics.data.ptr, world.physics.model.ptr
    data.qpos[2] += 1.0
    model.opt.gravity[:] = 0.0
    world.physics.forward()
    for _ in range(150):
        episode.tick()
    # implicitfast leaves Coriolis terms out of its velocity derivatives: measured 2e-4 of 0.7 N s.
    momentum = robot.mass * plant.observe().cog_velocity
    assert momentum == pytest.approx(asked.pushes[0].impulse_vector(robot.mass), abs=5e-4)


def test_a_push_off_the_com_turns_the_body_too() -> None:
    turned = {}
    for name, point in (("com", None), ("above", [0.0, 0.0, 0.2])):
        asked = scenario("humanoid", direction=0.0, point=point)
        episode = episode_of(asked)
        while episode.time < 0.2:
            episode.tick()
        turned[name] = episode.plant.condition().trunk_tilt
    assert turned["above"] > turned["com"] + 0.01


def test_no_force_is_left_over() -> None:
    asked = scenario("humanoid")
    episode = episode_of(asked)
    while episode.time < 0.3:
        episode.tick()
    world = episode.plant.world  # type: ignore[attr-defined]
    assert not world.physics.data.ptr.xfrc_applied.any()
    trace = episode.result().trace
    force, time = trace["push_fx"], trace.time
    assert (force[(time >= 0.1) & (time < 0.2)] > 0).all()
    assert not force[(time < 0.1) | (time > 0.2001)].any()
