"""Pushes that overlap act all at once, each booked for itself; a torque turns by the angular impulse asked."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode, EpisodeResult, run_episode
from sim.episode.plant import make_plant
from sim.episode.push_record import TorqueRecord, next_after
from sim.record.trace import Trace

ROBOT = load_robot("utmu2")
# Sums of a few hundred forces of order 100 N over steps of 1 ms.
EXACT = 1e-9
LONG = {"start": 0.1, "direction": 30.0, "impulse": 0.7, "duration": 0.2}
SHORT = {"start": 0.1503, "direction": -90.0, "impulse": 0.4, "duration": 0.05, "shape": "half_sine"}
ALL = {"start": 0.1601, "vector": [1.0, 0.0, 0.0], "impulse": 0.3, "duration": 0.1, "body": "cog"}
TWIST = {"start": 0.12, "torque": [0.3, 0.0, -1.2], "duration": 0.1307, "shape": "half_sine"}


def scenario(world: str, *pushes: dict[str, Any], **fields: Any) -> Scenario:
    given = {"description": "pushed", "world": world, "controller": "statue", "duration": 0.6, "pushes": list(pushes)}
    return Scenario.model_validate(given | fields)


def ended(asked: Scenario, time: float = 0.5) -> Episode:
    episode = Episode(asked, make_plant(asked, ROBOT), make_controller(asked, ROBOT))
    while episode.time < time:
        episode.tick()
    return episode


def vectors(trace: Trace, pattern: str) -> np.ndarray:
    return np.column_stack([trace[pattern.format(axis)] for axis in "xyz"])


@pytest.mark.parametrize(("world", "others"), [("humanoid", [TWIST, ALL]), ("pendulum", [ALL | {"body": "trunk"}])])
def test_each_is_booked_for_itself(world: str, others: list[dict[str, Any]]) -> None:
    asked = scenario(world, *sorted([LONG, SHORT, *others], key=lambda push: push["start"]))
    episode = ended(asked)
    result = episode.result()
    trace, control = result.trace, asked.timing.control
    forces = np.zeros((len(trace), 3))
    for i, (push, record) in enumerate(zip(asked.pushes, result.pushes, strict=True)):
        wanted = push.asked(ROBOT.mass)
        assert episode.plant.impulse_log.delivered[i] == pytest.approx(wanted, abs=EXACT)
        own = vectors(trace, f"push_{i + 1}_{'f' if push.torque is None else 't'}{{}}")
        assert own.sum(axis=0) * control == pytest.approx(wanted, abs=EXACT)
        if push.torque is None:
            forces += own
            assert record.delivered_impulse == pytest.approx(np.linalg.norm(wanted), abs=EXACT)
        else:
            assert isinstance(record, TorqueRecord)
            assert record.delivered_angular_impulse == pytest.approx(np.linalg.norm(wanted), abs=EXACT)
            assert (record.delivered_impulse, record.direction_deg) == (0.0, None)
        acts = own.any(axis=1)
        assert (np.isfinite(vectors(trace, f"push_{i + 1}_{{}}")).all(axis=1) >= acts).all()
    # The shared columns hold the sum of the forces; the last of them leaves nothing behind.
    assert vectors(trace, "push_f{}") == pytest.approx(forces, abs=EXACT)
    if world == "humanoid":
        assert not episode.plant.world.physics.data.ptr.xfrc_applied.any()  # type: ignore[attr-defined]


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_two_halves_at_once_are_the_whole(world: str) -> None:
    """Halves are exact in binary, so that the same force moves the robot bit for bit alike."""
    whole = run_episode(scenario(world, LONG, controller="supervisor", duration=3.0))
    half = LONG | {"impulse": 0.35}
    halves = run_episode(scenario(world, half, half, controller="supervisor", duration=3.0))
    own = [name for name in halves.trace.channels if name.startswith(("push_1", "push_2"))]
    assert len(own) == 12
    assert [name for name in halves.trace.channels if name not in own] == list(whole.trace.channels)
    for name in whole.trace.channels:
        if name not in ("push_x", "push_y", "push_z"):  # a mean of two equal points may differ in its last bit
            assert halves.trace[name].tobytes() == whole.trace[name].tobytes(), name


def test_only_pushes_that_need_them_have_columns_of_their_own() -> None:
    later = {"start": 0.4, "direction": 0.0, "impulse": 0.1, "duration": 0.05}
    asked = scenario("humanoid", LONG, SHORT, later, later | {"start": 0.46})
    assert asked.apart == (0, 1)
    # Two that share a control period overlap as far as a trace can tell.
    assert scenario("humanoid", later, later | {"start": 0.4505}).apart == ()
    assert scenario("humanoid", later | {"duration": 0.0505}, later | {"start": 0.451}).apart == (0, 1)
    # One within a long one, after another that was within it, too.
    assert scenario("humanoid", LONG, SHORT, SHORT | {"start": 0.21}).apart == (0, 1, 2)
    assert scenario("humanoid", TWIST).apart == (0,)
    names = ended(asked).result().trace.channels
    assert {name[:7] for name in names if name.startswith("push_") and name[5].isdigit()} == {"push_1_", "push_2_"}


@pytest.mark.parametrize("shape", ["rectangular", "half_sine"])
def test_the_body_takes_up_the_angular_impulse(shape: str) -> None:
    """In the air and without gravity nothing else turns it as a whole: the servos only turn parts against parts."""
    torque = [0.2, 0.5, -0.3]
    asked = scenario("humanoid", {"start": 0.01, "torque": torque, "duration": 0.0405, "shape": shape})
    episode = Episode(asked, make_plant(asked, ROBOT), make_controller(asked, ROBOT))
    world = episode.plant.world  # type: ignore[attr-defined]
    data, model = world.physics.data.ptr, world.physics.model.ptr
    data.qpos[2] += 1.0
    model.opt.gravity[:] = 0.0
    world.physics.forward()
    before = episode.plant.observe()
    for _ in range(40):
        episode.tick()
    mujoco.mj_forward(model, data)
    after = episode.plant.observe()
    wanted = np.array(torque) * 0.0405
    # The same limit of the integrator as for a force: measured 1e-4 of 0.025 N m s.
    assert after.angular_momentum - before.angular_momentum == pytest.approx(wanted, abs=5e-4)
    assert after.cog_velocity * ROBOT.mass == pytest.approx(before.cog_velocity * ROBOT.mass, abs=5e-4)


def test_a_torque_that_is_lost_fails() -> None:
    episode = ended(scenario("humanoid", TWIST))
    episode.plant.impulse_log.delivered[0] *= 0.999
    with pytest.raises(InputError, match=r"^pushes\[0\]: asked \[.*\] N m s, delivered \[.*\] N m s; .* is not kept$"):
        episode.result()


def told(*pushes: dict[str, Any], duration: float = 9.0) -> EpisodeResult:
    return run_episode(scenario("pendulum", *pushes, duration=duration, controller="supervisor"), polygons=False)


def test_those_that_overlap_share_an_answer() -> None:
    hard = {"start": 1.0, "direction": 0.0, "delta_v": 0.4}
    weak = {"start": 1.05, "direction": 0.0, "delta_v": 0.02, "duration": 0.5}
    later = {"start": 5.0, "direction": 0.0, "delta_v": 0.02}
    pushes = told(hard, weak, later).pushes
    assert [next_after(pushes, i) for i in range(3)] == [2, 2, None]
    assert [push.chosen for push in pushes] == ["stepping", "stepping", "standing"]
    # Each at its own end: the state at the end of the hard one is not yet that at the end of the weak one.
    assert pushes[0].cog_velocity_after != pushes[1].cog_velocity_after
    assert [push.chosen for push in told(weak, later).pushes] == ["standing", "standing"]


def test_episode_lasts_until_the_one_that_ends_last_is_over() -> None:
    long = {"start": 0.5, "direction": 0.0, "delta_v": 0.05, "duration": 2.0}
    short = {"start": 0.6, "direction": 0.0, "delta_v": 0.05}
    result = told(long, short)
    assert [push.reached for push in result.pushes] == [True, True]
    assert result.trace.time[-1] >= 3.5 - EXACT
    assert result.outcome.result.value == "recovered"


def test_torque_tips_the_trunk_the_way_its_axis_says() -> None:
    tilts = []
    for torque in ([0.0, 2.0, 0.0], [0.0, -2.0, 0.0]):
        episode = ended(scenario("humanoid", {"start": 0.05, "torque": torque, "duration": 0.1}), time=0.15)
        tilts.append(float(episode.plant.world.physics.data.ptr.qpos[5]))  # type: ignore[attr-defined]
    assert tilts[0] > 1e-3 > -1e-3 > tilts[1]


@pytest.mark.parametrize(
    ("torque", "words", "axis"),
    [
        ((0.0, 3.0, 0.0), "torque 3 N m about y on trunk", 0),
        ((-0.25, 0.0, 0.0), "torque 0.25 N m about -x on trunk", 1),
        ((3.0, 0.0, 4.0), "torque 5 N m about (0.60, 0.00, 0.80) on trunk", 1),
    ],
)
def test_words_of_a_torque(torque: tuple[float, float, float], words: str, axis: int) -> None:
    push = Push(start=0.0, torque=torque)
    assert (push.torque_words, push.axis) == (words, axis)
