"""Accelerations in closed form, against dense solutions of the same by numpy and DAQP on placo's own terms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np
import placo
import pytest
from scipy.spatial.transform import Rotation

from controllers.interface import BalanceCommand, Observation
from controllers.multibody.holding import EXCHANGES
from controllers.multibody.motion_kernel import ROUNDS, moved
from controllers.multibody.motion_tasks import REGULARISATION
from controllers.multibody.torque_kernel import Weights, weights_of
from controllers.registry import NoOptions
from controllers.whole_body import dynamics_tasks as tasks
from controllers.whole_body.body_terms import BodyTerms
from controllers.whole_body.inverse_dynamics import DynamicsOptions, DynamicsWholeBody
from controllers.whole_body.inverse_kinematics import IkWholeBody
from controllers.whole_body.placo_model import PlacoModel
from models.arena import SIDES
from models.errors import InputError
from models.robot import Robot, load_robot
from tests.controllers.recorded_layer import recorded

Array = np.ndarray
Tick = tuple[Observation, BalanceCommand]


@dataclass(frozen=True)
class Motion:
    """An answer of the kernel."""

    found: bool
    x: Array
    wrenches: Array
    torque: Array
    shares: Array


class Asked:
    """The kernel on a tick, and what placo says of the body there."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.model = robot, PlacoModel(robot)
        pinocchio_model = self.model.wrapper.model
        self.terms, self.cog = BodyTerms(robot, pinocchio_model), tasks.CogTask(robot, pinocchio_model, 0.002)
        self.figures, self.joints = tasks.weights(robot, pinocchio_model), tasks.joints(robot)
        self.weights: Weights = weights_of(self.figures)
        self.feet = tasks.FeetTask()

    def motion(self, tick: Tick, rounds: int = ROUNDS, exchanges: int = EXCHANGES) -> Motion:
        seen, command = tick
        self.terms.read(seen.configuration, seen.velocity)
        self.feet.aim(command)
        left, right = self.terms.ankles
        terms, zmp = self.terms, tuple(command.zmp.tolist())
        return Motion(
            *moved(
                terms.mass, terms.jacobian, terms.bias, terms.q, terms.qd, *left, *right, terms.soles, terms.chains,
                self.joints, self.cog.acceleration(seen, command), zmp, self.feet.rows, self.figures, rounds, exchanges,
            )
        )  # fmt: skip

    def least_squares(self, tick: Tick) -> tuple[Array, Array]:
        """Rows and right side of all tasks, times the roots of their weights."""
        seen, command = tick
        self.model.set_state(seen.configuration, seen.velocity)
        wrapper, weights, n = self.model.wrapper, self.weights, len(self.joints)
        q, qd = wrapper.state.q, wrapper.state.qd
        rows, sides = [], []

        def ask(matrix: Array, wanted: Array, weight: float | Array) -> None:
            root = np.sqrt(np.broadcast_to(weight, (len(matrix),)))
            rows.append(root[:, None] * matrix)
            sides.append(root * wanted)

        for side, foot in zip(SIDES, self.feet.rows, strict=True):
            frame = f"{side}_sole"
            place, jacobian = wrapper.get_T_world_frame(frame), wrapper.frame_jacobian(frame, "local_world_aligned")
            drift = frame_drift(wrapper, frame) @ qd
            speed = jacobian @ qd
            turn = Rotation.from_euler("z", foot[1]) * Rotation.from_matrix(place[:3, :3]).inv()
            linear = foot[3] * (foot[7:10] - place[:3, 3]) + foot[4] * (foot[10:13] - speed[:3]) + foot[13:]
            # the error is told in the sole's own axes turned to the world's, which for one rotation are the same
            angular = foot[5] * turn.as_rotvec() - foot[6] * speed[3:]
            weight = np.repeat([foot[2], weights.orientation], 3)
            ask(jacobian, np.concatenate([linear, angular]) - drift, weight)
        attitude = Rotation.from_quat(q[3:7])
        mass, bias = wrapper.mass_matrix(), wrapper.non_linear_effects()
        force = attitude.as_matrix() @ mass[:3] / weights.mass
        ax, ay, az = self.cog.acceleration(seen, command)
        given = np.array([ax, ay, az + weights.gravity])
        ask(force, given - attitude.as_matrix() @ bias[:3] / weights.mass, weights.cog)
        upright = weights.trunk_stiffness * attitude.inv().as_rotvec() - weights.trunk_damping * qd[3:6]
        ask(np.eye(6 + n)[3:6], upright, weights.trunk)
        pull = weights.posture_stiffness * (self.joints[:, 0] - q[7:]) - weights.posture_damping * qd[6:]
        ask(np.eye(6 + n)[6:], pull, weights.posture * self.joints[:, 1])
        ask(np.eye(6 + n)[6:], np.zeros(n), REGULARISATION)
        return np.vstack(rows), np.concatenate(sides)


def frame_drift(wrapper: placo.RobotWrapper, frame: str) -> Array:
    """Time derivative of a frame's Jacobian in the world's axes, by moving a little along the motion."""
    state, h = wrapper.state, 1e-5
    q, qd = state.q.copy(), state.qd.copy()
    found = []
    for sign in (-1.0, 1.0):
        state.q = q
        state.qd = sign * qd
        wrapper.update_kinematics()
        wrapper.integrate(h)
        wrapper.update_kinematics()
        found.append(wrapper.frame_jacobian(frame, "local_world_aligned"))
    state.q, state.qd = q, qd
    wrapper.update_kinematics()
    drift: Array = (found[1] - found[0]) / (2.0 * h)
    return drift


@pytest.fixture(scope="module")
def asked() -> Asked:
    return Asked(load_robot("utmu2"))


@pytest.fixture(scope="module")
def ticks() -> list[Tick]:
    """A push that takes a step: standing, swing, landing."""
    push = {"start": 0.2, "direction": 80.0, "delta_v": 0.5}
    _, ticks = recorded({"duration": 1.2, "seed": 1000, "pushes": [push]})
    return [(tick.seen, tick.command) for tick in ticks]


def stands(tick: Tick) -> bool:
    return all(foot.stance for foot in tick[1].feet.values())


def test_without_limits_it_is_the_dense_least_squares(asked: Asked, ticks: list[Tick]) -> None:
    swinging = 0
    for tick in ticks[100::13]:
        x = asked.motion(tick, rounds=0).x
        rows, side = asked.least_squares(tick)
        wanted = np.linalg.lstsq(rows, side, rcond=None)[0]
        # Drift by differences, and normal equations whose condition is some 1e8; 1e-9 was found.
        assert np.abs(x - wanted).max() < 1e-7 * max(1.0, np.abs(wanted).max())
        swinging += not stands(tick)
    assert swinging > 3


def test_on_one_foot_what_is_held_is_that_of_the_quadratic_program(asked: Asked, ticks: list[Tick]) -> None:
    """Of the same least squares, with all limits as they are."""
    limited = 0
    for tick in [tick for tick in ticks if not stands(tick)][::5]:
        motion = asked.motion(tick)
        rows, side = asked.least_squares(tick)
        asked.model.set_state(tick[0].configuration, tick[0].velocity)
        wrapper, weights = asked.model.wrapper, asked.weights
        foot = next(side for side in SIDES if tick[1].feet[side].stance)
        jacobian = wrapper.frame_jacobian(f"{foot}_sole", "local")
        mass, bias = wrapper.mass_matrix(), wrapper.non_linear_effects()
        # the base's six rows of the equation of motion give the wrench
        given = np.linalg.inv(jacobian[:, :6].T)
        wrench, wrench0 = given @ mass[:6], given @ bias[:6]
        torque, torque0 = mass[6:] - jacobian[:, 6:].T @ wrench, bias[6:] - jacobian[:, 6:].T @ wrench0
        most = np.array([weights.friction, weights.friction, weights.half_width, weights.half_length])
        edges = np.zeros((8, 6))
        for i, part in enumerate((0, 1, 3, 4)):
            edges[2 * i : 2 * i + 2, part], edges[2 * i : 2 * i + 2, 2] = (1.0, -1.0), -most[i]
        stall = asked.robot.stall_torque
        A = np.vstack([torque, edges @ wrench])
        upper = np.concatenate([stall - torque0, -edges @ wrench0])
        lower = np.concatenate([-stall - torque0, np.full(8, -1e30)])
        x, _, flag, _ = daqp.solve(rows.T @ rows, -rows.T @ side, A, upper, lower)
        assert flag == 1
        wanted = torque @ x + torque0
        limited += bool((np.abs(np.abs(wanted) - stall) < 1e-6).any() or (edges @ (wrench @ x + wrench0) > -1e-6).any())
        # A limit that is held gives way by 1e-6 of what holding it does; 3e-5 N m and 1e-4 N were found.
        assert np.abs(motion.torque - wanted).max() < 1e-3
        np.testing.assert_allclose(motion.wrenches[SIDES.index(foot)], wrench @ x + wrench0, rtol=0, atol=2e-3)
    assert limited > 5


def test_on_one_foot_the_torques_are_those_of_dynamics_but_for_the_cost_of_the_moment_about_the_vertical(
    asked: Asked, ticks: list[Tick], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "YAW_MOMENT_WEIGHT", 0.0)
    ik, dynamics = layer(asked.robot), DynamicsWholeBody(asked.robot, 0.002, DynamicsOptions())
    swinging = [tick for tick in ticks if not stands(tick)]
    apart = [np.abs(ik.targets(*tick).torque - dynamics.targets(*tick).torque).max() for tick in swinging]
    # [N m]: dynamics keeps torques and forces small, too; at most 0.007 and a median of 0.003 were found
    assert len(apart) > 30
    assert max(apart) < 0.02
    assert np.median(apart) < 0.006


def test_the_wrench_is_inside_the_soles_and_moves_the_base(asked: Asked, ticks: list[Tick]) -> None:
    stall, weights = asked.robot.stall_torque, asked.weights
    corners = asked.robot.sole_vertices["left"]
    assert 2.0 * weights.half_length < np.ptp(corners[:, 0])
    assert 2.0 * weights.half_width < np.ptp(corners[:, 1])
    held = 0
    for tick in ticks[::3]:
        motion = asked.motion(tick)
        assert motion.found
        assert (np.abs(motion.torque) <= stall).all()
        held += bool((np.abs(motion.torque) > stall - 1e-6).any())
        asked.model.set_state(tick[0].configuration, tick[0].velocity)
        wrapper, floor = asked.model.wrapper, np.zeros(6)
        for side, (fx, fy, fz, mx, my, mz) in zip(SIDES, motion.wrenches, strict=True):
            # roundings of some ten N
            assert fz >= 0.0
            assert max(abs(fx), abs(fy)) <= weights.friction * fz + 1e-12
            assert abs(mx) <= weights.half_width * fz + 1e-12
            assert abs(my) <= weights.half_length * fz + 1e-12
            floor += wrapper.frame_jacobian(f"{side}_sole", "local")[:, :6].T @ [fx, fy, fz, mx, my, mz]
            if not tick[1].feet[side].stance:
                assert not np.any([fx, fy, fz, mx, my, mz])
        need = wrapper.mass_matrix()[:6] @ motion.x + wrapper.non_linear_effects()[:6]
        # what held limits give way by, 1e-6 of what holding them does, is cut off
        np.testing.assert_allclose(floor, need, rtol=0, atol=1e-3)
    assert held > 10


def test_a_torque_is_held_at_either_side(asked: Asked, ticks: list[Tick]) -> None:
    """At eight times the speed torques that are held at one side are driven past the other, but little is cut off."""
    for seen, command in [tick for tick in ticks if not stands(tick)]:
        fast = replace(seen, velocity=8.0 * seen.velocity, cog_velocity=8.0 * seen.cog_velocity)
        motion = asked.motion((fast, command))
        asked.model.set_state(fast.configuration, fast.velocity)
        wrapper = asked.model.wrapper
        need = wrapper.mass_matrix()[6:] @ motion.x + wrapper.non_linear_effects()[6:]
        for side, wrench in zip(SIDES, motion.wrenches, strict=True):
            need -= wrapper.frame_jacobian(f"{side}_sole", "local")[:, 6:].T @ wrench
        # limits give way by 1e-6 of forces of some 1e5; 0.2 N m was found, and 4.6 if only one side is held
        assert np.abs(need - motion.torque).max() < 0.5


def test_an_exchange_that_does_not_end_is_not_an_answer(asked: Asked, ticks: list[Tick]) -> None:
    given_up = 0
    for tick in ticks[::3]:
        motion, enough = asked.motion(tick, exchanges=1), asked.motion(tick)
        assert enough.found
        assert np.isfinite(motion.torque).all()
        assert not motion.found or np.array_equal(motion.torque, enough.torque)
        given_up += not motion.found
    assert given_up > 10


def test_in_the_air_the_floor_gives_nothing(asked: Asked, ticks: list[Tick]) -> None:
    seen, command = next(tick for tick in ticks if not stands(tick))
    lifted = {side: replace(foot, stance=False) for side, foot in command.feet.items()}
    motion = asked.motion((seen, replace(command, feet=lifted)))
    asked.model.set_state(seen.configuration, seen.velocity)
    wrapper = asked.model.wrapper
    need = wrapper.mass_matrix()[:6] @ motion.x + wrapper.non_linear_effects()[:6]
    assert motion.found
    assert not motion.wrenches.any()
    # six rows that give way by 1e-6 of the weight of the body, 54 N, and of what the legs swing with; 1e-4 N was found
    np.testing.assert_allclose(need, 0.0, atol=1e-3)


def layer(robot: Robot) -> IkWholeBody:
    return IkWholeBody(robot, 0.002, NoOptions())


@pytest.mark.parametrize("field", ["configuration", "velocity", "cog", "cog_velocity"])
def test_what_is_not_a_number_keeps_the_last_torque(asked: Asked, ticks: list[Tick], field: str) -> None:
    made, (seen, command) = layer(asked.robot), ticks[50]
    good = made.targets(seen, command)
    broken = getattr(seen, field).copy()
    broken[2] = np.nan
    changes: dict[str, Any] = {field: broken}
    failed = made.targets(replace(seen, **changes), command)
    assert failed.solver_failed
    assert not good.solver_failed
    assert np.array_equal(failed.torque, good.torque)
    again = made.targets(seen, command)
    assert not again.solver_failed
    assert np.array_equal(again.torque, good.torque)


def test_straight_legs_have_a_finite_answer_within_the_limits(asked: Asked, ticks: list[Tick]) -> None:
    seen, command = ticks[50]
    straight = seen.configuration.copy()
    legs = [7 + i for i, name in enumerate(asked.robot.joint_names) if name in asked.robot.leg_joints]
    straight[legs] = 0.0
    motion = asked.motion((replace(seen, configuration=straight), command))
    assert motion.found
    assert (np.abs(motion.torque) <= asked.robot.stall_torque).all()


def test_legs_that_are_not_alike_are_refused(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BodyTerms, "fit", staticmethod(lambda _: False))
    with pytest.raises(InputError, match="equally many joints"):
        layer(asked.robot)
