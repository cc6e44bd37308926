"""The whole-body layers: what they promise alike, and what they do when their solver finds no answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers.interface import BalanceCommand, FootReference, JointTargets, Observation, WholeBodyLayer
from controllers.registry import LAYERS
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.catalogue import load
from sim.episode.humanoid_world import HumanoidWorld

SOLVERS = ("dynamics", "placo", "ik")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


@pytest.fixture
def world(robot: Robot) -> HumanoidWorld:
    return HumanoidWorld(load("quiet", {"variation": {"pose": 0.0}}), robot)


def make_layer(name: str, robot: Robot) -> WholeBodyLayer:
    """A layer by its name; "placo" is `dynamics` solved by placo alone."""
    entry = LAYERS.entry("dynamics" if name == "placo" else name)
    options = entry.options.model_validate({"solver": "placo"} if name == "placo" else {})
    layer: WholeBodyLayer = entry.cls(robot, 0.002, options)
    return layer


def apply(world: HumanoidWorld, targets: JointTargets) -> None:
    world.set_targets(targets)
    world.physics.step(world.substeps)
    world.tick_done()


def stand(observation: Observation, zmp: np.ndarray | None = None) -> BalanceCommand:
    return BalanceCommand(
        zmp=observation.cog[:2].copy() if zmp is None else zmp,
        feet={side: FootReference.standing(observation.feet[side], observation.feet[side].yaw) for side in SIDES},
    )


@pytest.mark.parametrize("name", SOLVERS)
def test_standing_still_needs_the_weight_in_the_legs_and_no_motion(
    name: str, robot: Robot, world: HumanoidWorld
) -> None:
    layer = make_layer(name, robot)
    observation = world.observe()
    targets = layer.targets(observation, stand(observation))
    assert not targets.solver_failed
    assert targets.position == pytest.approx(robot.stand[7:], abs=5e-3)  # the soft tasks give way a little
    assert np.abs(targets.velocity).max() < 0.1
    torque = dict(zip(robot.joint_names, targets.torque, strict=True))
    # A bent knee holds half the weight over its lever: about 27 N times 3 to 8 cm.
    for side in SIDES:
        assert 0.8 < abs(torque[f"{side}_knee"]) < 2.2
    assert torque["left_knee"] == pytest.approx(torque["right_knee"], rel=0.02)


@pytest.mark.parametrize("name", SOLVERS)
def test_the_zmp_goes_where_it_is_told(name: str, robot: Robot, world: HumanoidWorld) -> None:
    layer = make_layer(name, robot)
    for tick in range(80):
        observation = world.observe()
        # Held over the COG to settle, then 15 mm ahead of it for a moment.
        ahead = np.array([0.015, 0.0]) if tick >= 60 else np.zeros(2)
        apply(world, layer.targets(observation, stand(observation, observation.cog[:2] + ahead)))
    observation = world.observe()
    assert observation.zmp[0] - observation.cog[0] == pytest.approx(0.015, abs=0.005)
    assert observation.zmp[1] - observation.cog[1] == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize("name", SOLVERS)
def test_of_a_foot_that_stands_only_the_heading_counts(name: str, robot: Robot, world: HumanoidWorld) -> None:
    observation = world.observe()
    told = stand(observation)
    nonsense = {
        side: replace(foot, position=np.zeros(3), velocity=np.ones(3), acceleration=np.full(3, 9.0))
        for side, foot in told.feet.items()
    }
    one, other = (
        make_layer(name, robot).targets(observation, command) for command in (told, replace(told, feet=nonsense))
    )
    assert not other.solver_failed
    assert np.array_equal(one.torque, other.torque)
    assert np.array_equal(one.position, other.position)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_failure_is_said_and_keeps_the_last_torque(name: str, robot: Robot, world: HumanoidWorld) -> None:
    layer = make_layer(name, robot)
    observation = world.observe()
    good = layer.targets(observation, stand(observation))
    impossible = replace(observation, cog=observation.cog * np.nan)
    failed = layer.targets(impossible, stand(observation))
    assert failed.solver_failed
    assert np.array_equal(failed.torque, good.torque)
    assert np.isfinite([failed.position, failed.velocity]).all()
    again = layer.targets(observation, stand(observation))
    assert not again.solver_failed


@pytest.mark.parametrize("name", SOLVERS)
def test_reset_forgets_everything(name: str, robot: Robot, world: HumanoidWorld) -> None:
    def torques(layer: WholeBodyLayer) -> list[np.ndarray]:
        layer.reset()
        world.reset()
        taken = []
        for _ in range(30):
            observation = world.observe()
            targets = layer.targets(observation, stand(observation))
            taken.append(targets.torque)
            apply(world, targets)
        return taken

    layer = make_layer(name, robot)
    first = torques(layer)
    assert np.array_equal(first, torques(layer))
