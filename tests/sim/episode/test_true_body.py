"""The true body differs from the robot's file as the seed draws it, and the controllers are not told."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from models.arena import FLOOR
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from sim.episode.humanoid_world import HumanoidWorld

ROBOT = load_robot("utmu2")
ALL = {"scale": 1.0}


def scenario(seed: int = 0, **body: Any) -> Scenario:
    push = {"start": 0.1, "direction": 90.0, "delta_v": 0.2}
    return load("quiet", {"duration": 0.3, "seed": seed, "body": body, "pushes": [push]})


def model_of(seed: int = 0, **body: Any) -> mujoco.MjModel:
    return HumanoidWorld(scenario(seed, **body), ROBOT).physics.model.ptr


def test_every_link_and_joint_differs_by_what_was_drawn() -> None:
    plain, world = model_of(), HumanoidWorld(scenario(**ALL), ROBOT)
    model, errors = world.physics.model.ptr, world.body.errors
    mass = np.array([errors["mass"][model.body(i).name] for i in range(1, model.nbody)])
    assert (mass != 1.0).all()
    np.testing.assert_allclose(model.body_mass[1:], plain.body_mass[1:] * mass, rtol=1e-14)
    np.testing.assert_allclose(model.body_inertia[1:], plain.body_inertia[1:] * mass[:, None], rtol=1e-14)
    np.testing.assert_allclose((model.body_ipos - plain.body_ipos)[1:], list(errors["com"].values()), atol=1e-15)
    friction = list(errors["joint_friction"].values())
    np.testing.assert_allclose(model.dof_frictionloss[6:], plain.dof_frictionloss[6:] * friction, rtol=1e-14)
    np.testing.assert_allclose(model.dof_damping[6:], plain.dof_damping[6:] * friction, rtol=1e-14)
    motor = list(errors["motor"].values())
    np.testing.assert_allclose(model.actuator_gainprm[:, 1], plain.actuator_gainprm[:, 1] * motor, rtol=1e-14)
    assert model.geom(FLOOR).friction[0] == plain.geom(FLOOR).friction[0] * errors["floor_friction"]
    # What MuJoCo derives follows.
    assert model.body_subtreemass[1] == pytest.approx(model.body_mass[1:].sum(), rel=1e-12)
    assert model.body_subtreemass[1] != pytest.approx(ROBOT.mass, rel=1e-4)


def test_figures_are_standard_deviations() -> None:
    world = HumanoidWorld(scenario(**ALL), ROBOT)
    drawn = []
    for seed in range(60):
        world.reset(scenario(seed, **ALL))
        drawn.append(world.body.errors)
    # 60 episodes of some 20 links: to 2 % (one sigma).
    assert np.std([list(one["mass"].values()) for one in drawn]) == pytest.approx(0.05, rel=0.1)
    assert np.std([list(one["com"].values()) for one in drawn]) == pytest.approx(0.002, rel=0.1)
    assert np.std(np.log([list(one["joint_friction"].values()) for one in drawn])) == pytest.approx(0.3, rel=0.1)
    assert np.std([list(one["motor"].values()) for one in drawn]) == pytest.approx(0.05, rel=0.1)
    assert np.std([one["floor_friction"] for one in drawn]) == pytest.approx(0.1, rel=0.35)


def test_the_seed_decides_whatever_was_before() -> None:
    world = HumanoidWorld(scenario(3, **ALL), ROBOT)
    first = world.physics.model.ptr.body_mass.copy()
    world.reset(scenario(4, **ALL))
    assert (world.physics.model.ptr.body_mass[1:] != first[1:]).all()
    world.reset(scenario(3, **ALL))
    np.testing.assert_array_equal(world.physics.model.ptr.body_mass, first)


def test_scale_scales_and_each_figure_is_its_own() -> None:
    one, two = (np.log(model_of(scale=scale).body_mass[1:] / model_of().body_mass[1:]) for scale in (1.0, 2.0))
    np.testing.assert_allclose(two, 2 * one, rtol=1e-9)
    rigid = model_of(scale=1.0, mass=0.0, com=0.0, motor=0.0, floor_friction=0.0)
    np.testing.assert_array_equal(rigid.body_mass, model_of().body_mass)
    assert (rigid.dof_damping[6:] != model_of().dof_damping[6:]).all()


def test_the_record_tells_what_was_drawn() -> None:
    plain, other = (run_episode(scenario(**body), polygons=False).trace for body in ({}, ALL))
    assert "body_errors" not in plain.metadata
    assert set(other.metadata["body_errors"]["mass"]) == set(ROBOT.body_names)
    assert plain.metadata["robot"] == other.metadata["robot"]
    assert plain["cog_x"].tobytes() != other["cog_x"].tobytes()
