"""What a scenario disturbs is disturbed, by as much as it says, and the controllers are not told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from models.arena import FLOOR
from models.errors import InputError
from models.robot import load_robot
from scenarios.catalogue import check_against, load
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode
from sim.episode.humanoid_world import HumanoidWorld

ROBOT = load_robot("utmu2")


def scenario(push: dict[str, Any] | None = None, **fields: Any) -> Scenario:
    thrust = {"start": 0.1, "direction": 90.0, "delta_v": 0.2} | (push or {})
    return load("quiet", {"duration": 0.3, "pushes": [thrust]} | fields)


def run(**fields: Any) -> EpisodeResult:
    return run_episode(scenario(**fields), polygons=False)


def test_masses_and_what_follows_from_them_are_scaled() -> None:
    plain = HumanoidWorld(scenario(), ROBOT).physics.model.ptr
    heavy = HumanoidWorld(scenario(disturbance={"mass_scale": 1.1}), ROBOT).physics.model.ptr
    # One multiplication each: equal to within the rounding of double precision.
    np.testing.assert_allclose(heavy.body_mass, 1.1 * plain.body_mass, rtol=1e-14)
    np.testing.assert_allclose(heavy.body_inertia, 1.1 * plain.body_inertia, rtol=1e-14)
    assert heavy.body_subtreemass[0] == pytest.approx(1.1 * ROBOT.mass, rel=1e-12)
    # MuJoCo derives these from masses and rotor inertias, which stay: only the direction is known.
    assert (heavy.dof_invweight0 < plain.dof_invweight0).all()


def test_only_the_floor_s_sliding_friction_changes() -> None:
    plain = HumanoidWorld(scenario(), ROBOT).physics.model.ptr.geom_friction.copy()
    model = HumanoidWorld(scenario(disturbance={"friction": 0.4}), ROBOT).physics.model.ptr
    floor = model.geom(FLOOR).id
    assert model.geom_friction[floor, 0] == 0.4
    plain[floor, 0] = 0.4
    np.testing.assert_array_equal(model.geom_friction, plain)


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_disturbed_episode_differs_and_repeats_bit_for_bit(world: str) -> None:
    heavier = {"disturbance": {"mass_scale": 0.9}}
    plain, first, again = run(world=world), run(world=world, **heavier), run(world=world, **heavier)
    assert first.trace.values.tobytes() == again.trace.values.tobytes() != plain.trace.values.tobytes()


def test_heavier_pendulum_is_pushed_less_by_the_same_impulse() -> None:
    # Before the controller has answered: the push lasts one control period, so that the ZMP has not moved yet.
    short = {"duration": 0.002}
    light, heavy = (
        run(world="pendulum", push=short, variation={"pose": 0.0}, disturbance={"mass_scale": scale})
        for scale in (1.0, 2.0)
    )
    after = [result.pushes[0].cog_velocity_after for result in (light, heavy)]
    assert after[0] is not None
    assert after[1] is not None
    assert after[0][1] == pytest.approx(2 * after[1][1], rel=1e-9)  # exact but for rounding
    assert light.pushes[0].delivered_impulse == pytest.approx(heavy.pushes[0].delivered_impulse, rel=1e-12)


def spin(**push: Any) -> float:
    """How far the trunk turns about the x axis within a short, free push to the left [rad/s]."""
    world = HumanoidWorld(scenario(push={"start": 0.0, "duration": 0.001, **push}, variation={"pose": 0.0}), ROBOT)
    before = world.physics.data.ptr.qvel[3:6].copy()
    world.physics.step(1)
    return float((world.physics.data.ptr.qvel[3:6] - before)[0])


def test_push_on_the_cog_accelerates_all_bodies_alike() -> None:
    world = HumanoidWorld(scenario(push={"start": 0.0, "duration": 0.001, "body": "cog"}), ROBOT)
    seen = []
    world.physics.impulse_log.book = lambda index, force: seen.append(  # type: ignore[method-assign]
        (force.copy(), world.physics.data.ptr.xfrc_applied.copy())
    )
    world.physics.step(1)
    ((force, wrenches),) = seen
    asked = 0.2 * ROBOT.mass / 0.001
    np.testing.assert_allclose(force, [0, asked, 0], atol=1e-9 * asked)
    mass = world.physics.model.ptr.body_mass[1:]
    np.testing.assert_allclose(wrenches[1:, 1] / mass, asked / mass.sum(), rtol=1e-12)
    assert not wrenches[:, 3:].any()
    assert not world.physics.data.ptr.xfrc_applied.any()


def test_push_on_the_cog_spins_less_than_one_above_it() -> None:
    assert abs(spin(body="cog")) < abs(spin()) < abs(spin(height=0.05))


def test_height_is_a_lever() -> None:
    # A force to the left above the COM turns the trunk about -x, below about +x.
    assert spin(height=0.05) < spin() < spin(height=-0.05)


def test_point_of_a_high_push_is_above_the_com() -> None:
    plain, high = (HumanoidWorld(scenario(push={"height": h}), ROBOT).physics.push_point(0) for h in (0.0, 0.05))
    np.testing.assert_allclose(high - plain, [0, 0, 0.05], atol=1e-15)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"disturbance": {"noise_velocity": 0.01}}, "disturbance.noise_velocity: 0.01 is not allowed; it is sensing."),
        ({"disturbance": {"mass_scale": 0.0}}, "disturbance.mass_scale: 0.0 is not allowed; it must be >= 0.1"),
        ({"disturbance": {"mas_scale": 1.1}}, "did you mean 'mass_scale'?"),
        ({"world": "pendulum", "disturbance": {"friction": 0.5}}, "disturbance.friction"),
        ({"push": {"body": "cog", "height": 0.1}}, "pushes[0].height"),
        ({"push": {"body": "cog", "point": [0.0, 0.0, 0.1]}}, "pushes[0].point"),
    ],
)
def test_impossible_disturbances_are_refused_in_one_line(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        scenario(**fields)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_push_on_the_cog_fits_every_robot() -> None:
    check_against(scenario(push={"body": "cog"}), ROBOT)
