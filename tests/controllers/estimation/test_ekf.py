"""The estimator on whole-body episodes in MuJoCo, against the truth."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from controllers.estimation.ekf import InvariantEkf
from controllers.estimation.look_ahead import BodyState, Held
from controllers.estimation.options import LOOK_AHEAD, EkfOptions
from controllers.geometry.rotation import from_quaternion
from controllers.interface import Observation
from models.arena import SIDES
from models.errors import InputError, OkiagariError
from models.robot import Side
from tests.controllers.estimation.recorded import Array, Record, errors_of, estimator, follow, peak, record, rms

# A push that is stood, one that needs steps to the side, and one that needs some backward.
PUSHES = [(1.2, 22.5), (1.7, 247.5), (2.2, 157.5)]


def same(one: Observation, other: Observation) -> bool:
    pairs = [(getattr(one, name), getattr(other, name)) for name in ("cog", "zmp", "configuration", "velocity")]
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


@pytest.mark.parametrize(("size", "direction"), PUSHES)
def test_typical_sensors_show_the_state(size: float, direction: float) -> None:
    kept = record(size, direction)
    errors = errors_of(kept, follow(kept, estimator(kept.robot, kept.dt)))
    # 2 mm of DCM cost no recovery when they were added to the truth; 0.6 and 1.7 mm were the worst of 16 pushes.
    assert rms(errors.dcm) < 1e-3
    assert peak(errors.dcm) < 4e-3
    # A speed of 6 mm/s is 1 mm of DCM; 3 and 9 mm/s were the worst.
    assert rms(errors.velocity) < 6e-3
    assert peak(errors.velocity) < 25e-3
    # The accelerometer's bias alone, 0.05 m/s^2, is worth 5 mrad; the soles know better.
    assert rms(errors.tilt) < 2e-3
    # Half a count of the encoder a sample is 12 mrad/s; shocks of the joints add to it.
    assert np.sqrt((errors.joints**2).mean()) < 0.05


@pytest.mark.parametrize(("size", "direction"), PUSHES[1:])
def test_the_error_is_what_the_covariance_tells(size: float, direction: float) -> None:
    kept = record(size, direction)
    ekf = estimator(kept.robot, kept.dt)
    ekf.reset(kept.truth[0])
    ratios, deviations = [], []
    for arrived, given, truth in zip(kept.readings, [None, *kept.targets], kept.truth, strict=False):
        ekf.estimate(arrived, given, truth.time)
        state, rotation = ekf._filter, from_quaternion(truth.configuration[3:7])
        velocity = truth.velocity[:3] + rotation @ np.cross(truth.velocity[3:6], kept.robot.imu)
        off = state.rotation @ rotation.T
        found = np.concatenate(
            [[(off[2, 1] - off[1, 2]) / 2, (off[0, 2] - off[2, 0]) / 2], state.velocity - off @ velocity]
        )
        deviation = np.sqrt(np.diag(state.covariance))[[0, 1, 3, 4, 5]]
        ratios.append(np.abs(found) / deviation)
        deviations.append(deviation)
    # 99.7 % of normal errors are within three deviations; those of contacts are not white.
    assert (np.array(ratios) < 3.0).mean() > 0.98
    # ... and the covariance is no blanket: some mrad and mm/s.
    assert (np.median(deviations, axis=0) < [1e-3, 1e-3, 5e-3, 5e-3, 5e-3]).all()


def test_the_simulation_ahead_makes_up_for_the_latency() -> None:
    found = {}
    for predictor, (size, direction) in itertools.product(("none", "extrapolate", "simulate"), PUSHES):
        kept = record(size, direction, latency=0.004)
        errors = errors_of(kept, follow(kept, estimator(kept.robot, kept.dt, predictor=predictor)))
        found.setdefault(predictor, []).append((rms(errors.dcm), peak(errors.dcm)))
    # A push of 8 m/s^2 that nobody could know of moves the DCM by 5 mm in 4 ms; a foot that lands too early by more.
    assert np.max(found["simulate"], axis=0)[0] < 3e-3
    assert np.max(found["simulate"], axis=0)[1] < 20e-3
    means = {predictor: np.mean(rows, axis=0) for predictor, rows in found.items()}
    assert (means["simulate"] < 0.75 * means["none"]).all()
    assert means["simulate"][0] < means["extrapolate"][0] < means["none"][0]


def test_the_push_observer_helps_the_simulation() -> None:
    kept = record(1.7, 247.5, latency=0.004)
    with_push, without = (
        rms(errors_of(kept, follow(kept, estimator(kept.robot, kept.dt, push_threshold=threshold))).dcm)
        for threshold in (3.0, 1e6)
    )
    assert with_push < 0.9 * without


def test_an_assumed_latency_counts_in_place_of_the_stamps() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    right, stamped, none = (
        follow(kept, estimator(kept.robot, kept.dt, **options))
        for options in ({"latency": 0.004}, {}, {"predictor": "none"})
    )
    assert all(same(one, other) for one, other in zip(right[10:], stamped[10:], strict=True))
    short = follow(kept, estimator(kept.robot, kept.dt, latency=0.002))
    nothing, part, all_of_it = (rms(errors_of(kept, seen).dcm) for seen in (none, short, right))
    assert all_of_it < part < nothing


def test_of_the_state_now_the_balance_is_told_alone_or_with_the_whole_body() -> None:
    kept = record(1.7, 247.5, latency=0.004)
    part, whole, late = (
        follow(kept, estimator(kept.robot, kept.dt, **options))
        for options in ({"predicted": "balance"}, {"predicted": "body"}, {"predictor": "none"})
    )
    least, places = EkfOptions().contact_load * kept.robot.mass * kept.robot.gravity, []
    for one, now, then in list(zip(part, whole, late, strict=True))[10:]:
        for name in ("cog", "cog_velocity", "angular_momentum"):
            np.testing.assert_array_equal(getattr(one, name), getattr(now, name))
        for name in ("configuration", "velocity", "zmp"):
            np.testing.assert_array_equal(getattr(one, name), getattr(then, name))
        for side in SIDES:
            assert one.feet[side].force == now.feet[side].force
            stands = max(now.feet[side].force, then.feet[side].force) >= least
            wanted = now if stands else then
            np.testing.assert_array_equal(one.feet[side].position, wanted.feet[side].position)
            places.append(stands)
    assert any(places)
    assert not all(places)
    assert any(np.abs(now.velocity - then.velocity).max() > 0.1 for now, then in zip(whole, late, strict=True))


def touchdowns(observations: list[Observation], side: Side, least: float) -> list[int]:
    """Ticks at which a foot carries `least` [N] after it carried less for 30 ms."""
    loaded = [observation.feet[side].force >= least for observation in observations]
    return [tick for tick in range(15, len(loaded)) if loaded[tick] and not any(loaded[tick - 15 : tick])]


def test_a_touchdown_is_told_when_it_happens_and_not_two_ticks_late() -> None:
    kept = record(1.7, 247.5, latency=0.004)
    least = EkfOptions().contact_load * kept.robot.mass * kept.robot.gravity
    balance, late = (
        follow(kept, estimator(kept.robot, kept.dt, **options))
        for options in ({"predicted": "balance"}, {"predictor": "none"})
    )
    true, now, then = (
        [tick for side in SIDES for tick in touchdowns(told, side, least)] for told in (kept.truth, balance, late)
    )
    assert len(true) >= 3
    np.testing.assert_array_equal(np.subtract(then, true), 2)
    # a tick, for a height that is wrong by a millimetre is 3 ms of a foot that comes down by 0.3 m/s
    np.testing.assert_allclose(now, true, atol=1)


def test_joints_are_told_of_now_unless_drives_take_them_as_they_see_them() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    goals = replace(kept, targets=[replace(one, from_seen=False) for one in kept.targets])
    for case, at_drive, predicted in ((kept, True, "balance"), (kept, False, "body"), (goals, True, "body")):
        left_out, told = (
            follow(case, estimator(kept.robot, kept.dt, at_drive=at_drive, **options))
            for options in ({}, {"predicted": predicted})
        )
        assert all(same(one, other) for one, other in zip(left_out, told, strict=True)), predicted


def test_the_same_readings_give_the_same_bits_in_each_episode() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    ekf = estimator(kept.robot, kept.dt)
    once, again = follow(kept, ekf), follow(kept, ekf)
    assert all(same(one, other) for one, other in zip(once, again, strict=True))


def test_before_the_first_reading_the_robot_is_where_it_was_given() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    ekf = estimator(kept.robot, kept.dt)
    ekf.reset(kept.truth[0])
    seen = ekf.estimate([], None, 0.0)
    assert same(seen, kept.truth[0])
    assert ekf.estimate([], kept.targets[0], 0.002).time == 0.002


def test_more_latency_than_it_can_make_up_for_is_refused_and_not_cut_short() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    reading = next(one for arrived in kept.readings for one in arrived)
    ekf = estimator(kept.robot, kept.dt)
    ekf.reset(kept.truth[0])
    with pytest.raises(InputError, match=r"'ekf' are 0\.2 s old, and it makes up for 0\.1 s at most"):
        ekf.estimate([reading], kept.targets[0], reading.taken + 0.2)
    content = estimator(kept.robot, kept.dt, predictor="none")
    content.reset(kept.truth[0])
    content.estimate([reading], kept.targets[0], reading.taken + 0.2)


def slowed(kept: Record, every: int) -> Record:
    """The same readings with encoders that answer every few of them only."""
    found, i, held = Record(kept.robot, kept.dt, kept.push, [], kept.truth, kept.targets), 0, None
    for arrived in kept.readings:
        row = []
        for reading in arrived:
            held = reading.joint_position if i % every == 0 or held is None else held
            row.append(type(reading)(**{n: getattr(reading, n) for n in reading.__slots__} | {"joint_position": held}))
            i += 1
        found.readings.append(row)
    return found


def test_all_of_the_latency_is_simulated_by_targets_that_hold_for_long() -> None:
    kept, simulated = record(1.2, 22.5), []
    ekf = estimator(kept.robot, 4 * kept.dt, latency=LOOK_AHEAD)
    body = ekf.nominal_body
    assert body is not None

    class Watched:
        def forward(self, state: BodyState, held: Sequence[Held]) -> tuple[Array, Array, Array]:
            simulated.append(sum(one.duration for one in held))
            return body.forward(state, held)

    ekf.nominal_body = Watched()
    ekf.reset(kept.truth[0])
    for tick in range(4, 120, 4):
        readings = [one for arrived in kept.readings[tick - 3 : tick + 1] for one in arrived]
        ekf.estimate(readings, kept.targets[tick - 4], kept.truth[tick].time)
    np.testing.assert_allclose(simulated[20:], LOOK_AHEAD, rtol=1e-9)


def test_encoders_may_be_slower_than_the_imu() -> None:
    kept = record(1.2, 22.5)
    errors = errors_of(kept, follow(slowed(kept, 4), estimator(kept.robot, kept.dt)))
    # Joints at 250 Hz: their speeds are those of 2 ms ago, in the mean.
    assert rms(errors.dcm) < 4e-3


def test_the_predictor_simulate_needs_a_body() -> None:
    kept = record(1.2, 22.5)
    ekf = InvariantEkf(kept.robot, kept.dt, EkfOptions())
    with pytest.raises(OkiagariError, match="nominal_body"):
        ekf.reset(kept.truth[0])


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"predictor": "none", "latency": 0.004}, "latency"),
        ({"predictor": "none", "predicted": "balance"}, "predicted"),
        ({"predictor": "extrapolate", "push_threshold": 1.0}, "push_threshold"),
        ({"gyro": 0.0}, "gyro"),
        ({"contact_load": 1.5}, "contact_load"),
        ({"predictor": "guess"}, "predictor"),
        ({"unknown": 1.0}, "unknown"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, object], field: str) -> None:
    with pytest.raises(ValidationError, match=field):
        EkfOptions.model_validate(options)
