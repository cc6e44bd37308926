"""From the world by sensors and an estimator to the controllers; and what drives make of late references."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controllers.interface import JointTargets
from models.errors import InputError
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.envs.dm_env import make_environment
from sim.episode.build import make_controller
from sim.episode.episode import Episode, EpisodeResult, run_episode
from sim.episode.plant import HumanoidPlant
from sim.results.push_size import edge_distance
from sim.sensing.drive import Drives

ROBOT = load_robot("utmu2")
OWN = '''
from controllers.fields import Strict


class Stubborn:
    """Believes that the robot stands as it stood."""

    class Options(Strict):
        raises: bool = False
        answers: str = "dict()"

    def __init__(self, robot, dt, options):
        self.options, self.readings, self.targets = options, 0, []

    def reset(self, observation):
        self.first = observation

    def estimate(self, readings, targets, time):
        from dataclasses import replace
        self.readings += len(readings)
        self.targets.append(targets)
        if self.options.raises and time > 0.01:
            raise RuntimeError("lost")
        names = {"first": self.first, "feet": self.first.feet, "replace": replace, "nan": float("nan")}
        return replace(self.first, **{"time": time} | eval(self.options.answers, names))


class Restless:
    def __init__(self, robot, dt, options):
        pass

    def estimate(self, readings, targets, time):
        pass
'''


def scenario(duration: float = 0.3, seed: int = 0, **sensing: Any) -> Scenario:
    push = {"start": 0.1, "direction": 90.0, "delta_v": 0.3}
    return load("quiet", {"duration": duration, "seed": seed, "sensing": sensing, "pushes": [push]})


def run(**sensing: Any) -> EpisodeResult:
    return run_episode(scenario(**sensing), polygons=False)


def own(folder: Path, cls: str = "Stubborn", **options: bool | str) -> dict[str, Any]:
    (folder / "own.py").write_text(OWN, encoding="utf-8")
    return {"name": f"{folder / 'own.py'}:{cls}"} | options


def test_exact_senses_are_the_truth_itself() -> None:
    asked = scenario()
    episode = Episode(asked, HumanoidPlant(asked, ROBOT))
    assert episode.observe() is episode.truth
    result = run()
    assert result.sight is None
    assert "seen_cog_x" not in result.trace.units
    assert "sensing" not in result.trace.metadata


def test_an_estimated_episode_repeats_and_tells_how_far_off_it_saw() -> None:
    first, again, other = run(preset="typical"), run(preset="typical"), run(preset="cheap")
    assert first.trace.values.tobytes() == again.trace.values.tobytes()
    assert first.trace["cog_y"].tobytes() != other.trace["cog_y"].tobytes()
    assert first.sight is not None
    assert 1e-5 < first.sight.rms < first.sight.peak < 0.02
    error = np.hypot(first.trace["dcm_error_x"], first.trace["dcm_error_y"])[first.trace.time >= 0.1 - 1e-9]
    assert first.sight.peak == error.max()
    assert first.sight.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    told = first.trace.metadata["sensing"]
    assert (told["preset"], told["estimator"], told["servo"]) == ("typical", "ekf", "drive")
    assert (told["imu"]["gyro_noise"], told["imu"]["rate"]) == (0.005, 1000.0)
    json.dumps(told, allow_nan=False)


def test_the_whole_scenario_can_be_read_again() -> None:
    asked = scenario(preset="cheap", imu={"gyro_noise": 0.0}, latency=0.003, servo="state")
    assert Scenario.model_validate(asked.as_dict()) == asked
    assert asked.as_dict()["sensing"]["imu"] == {"gyro_noise": 0.0}
    assert (asked.sensing.imu_figures.gyro_noise, asked.sensing.imu_figures.gyro_bias) == (0.0, 0.01)


def test_your_own_estimator_is_asked_every_tick(tmp_path: Path) -> None:
    asked = scenario(preset="ideal", latency=0.004, estimator=own(tmp_path))
    plant = HumanoidPlant(asked, ROBOT)
    given: list[JointTargets | None] = []

    def note(episode: Episode) -> None:
        given.append(plant.targets)
        assert episode.seen.cog is episode._senses._estimator.first.cog  # type: ignore[attr-defined]

    episode = Episode(asked, plant, make_controller(asked, ROBOT), on_tick=note)
    while episode.tick():
        pass
    estimator = episode._senses._estimator  # type: ignore[attr-defined]
    # At 1 kHz, from 0 to 4 ms before the last tick.
    assert estimator.readings == 2 * (episode.ticks - 1) - 4 + 1
    assert estimator.targets[0] is None
    assert estimator.targets[1:] == given[:-1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"raises": True}, "tick 6: estimate() raised RuntimeError: lost"),
        ({"answers": "dict(cog=first.cog[:2])"}, "tick 0: cog has shape (2,); it must be an array of shape (3,)"),
        ({"answers": "dict(time='now')"}, "tick 0: time is of the type str; it must be a number"),
        ({"answers": "dict(zmp=first.zmp.astype(str))"}, "tick 0: zmp is of <U32; it must be of numbers"),
        ({"answers": "dict(zmp=None)"}, "tick 0: zmp is None; it must be an array of shape (2,)"),
        ({"answers": "dict(zmp=abs(first.zmp) * [0, nan])"}, "tick 0: zmp [0.0, nan] is not finite"),
        ({"answers": "dict(zmp=first.cog)"}, "tick 0: zmp has shape (3,); it must be an array of shape (2,)"),
        (
            {"answers": "dict(feet=feet | {'right': 1})"},
            "tick 0: feet['right'] is of the type int; it must be a FootState",
        ),
        (
            {"answers": "dict(feet=feet | {'left': replace(feet['left'], position=feet['left'].position[:2])})"},
            "tick 0: feet['left'].position has shape (2,); it must be an array of shape (3,)",
        ),
        (
            {"answers": "dict(feet=feet | {'left': replace(feet['left'], force=None)})"},
            "tick 0: feet['left'].force is None; it must be a number",
        ),
        (
            {"answers": "dict(feet=feet | {'left': replace(feet['left'], yaw=nan)})"},
            "tick 0: feet['left'].yaw nan is not finite",
        ),
    ],
)
def test_what_is_wrong_with_it_is_told_in_one_line(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        run(preset="ideal", estimator=own(tmp_path, **options))
    assert f"estimator 'own.py:Stubborn': {words}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_where_it_believes_to_be_in_the_world_changes_no_record_but_that_of_what_was_seen(tmp_path: Path) -> None:
    push = {"start": 0.02, "direction": 0.0, "delta_v": 0.02, "duration": 0.02}
    records = []
    for away in (0.0, 0.3):
        moved = f"first.cog + [{away}, 0, 0]"
        feet = f"{{side: replace(foot, position=foot.position + [{away}, 0, 0]) for side, foot in feet.items()}}"
        place = f"first.configuration + ([{away}] + [0] * (len(first.configuration) - 1))"
        answers = f"dict(cog={moved}, feet={feet}, zmp=first.zmp + [{away}, 0], configuration={place})"
        sensing = {"preset": "ideal", "estimator": own(tmp_path, answers=answers)}
        records.append(run_episode(load("quiet", {"duration": 0.06, "pushes": [push], "sensing": sensing})))
    here, there = (record.trace for record in records)
    assert there["seen_cog_x"] - here["seen_cog_x"] == pytest.approx(0.3)
    assert there["seen_zmp_x"] - here["seen_zmp_x"] == pytest.approx(0.3)
    for name in ("zmp_cmd_x", "zmp_cmd_y", "dcm_error_x"):
        assert there[name] == pytest.approx(here[name], abs=1e-6), name
    assert np.abs(there["zmp_cmd_x"]).max() < 0.05
    (near, *_), (far, *_) = (record.set_polygons for record in records)
    assert len(near.vertices) > 2
    assert far.vertices == pytest.approx(near.vertices, abs=1e-6)


def test_in_the_air_it_may_know_no_zmp(tmp_path: Path) -> None:
    run(preset="ideal", estimator=own(tmp_path, answers="dict(zmp=first.zmp * nan)"))


def test_what_an_estimator_cannot_do_is_refused_before_it_begins(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown option of 'own\.py:Stubborn'; allowed: raises, answers"):
        run(preset="ideal", estimator=own(tmp_path, sleeps=True))
    with pytest.raises(InputError, match=r"sensing\.latency: 0\.2 s is more than the 0\.1 s that 'ekf' makes up for"):
        run(preset="typical", latency=0.2)
    run(preset="typical", latency=0.2, estimator={"name": "ekf", "predictor": "none"})
    with pytest.raises(InputError, match=r"'own.py:Restless' is no estimator: it has no method reset\(\)"):
        run(preset="ideal", estimator=own(tmp_path, "Restless"))


def test_driven_from_outside_the_senses_are_the_same() -> None:
    asked = scenario(preset="typical", latency=0.003)
    plain = run_episode(asked, polygons=False).trace
    environment = make_environment(asked)
    for _ in range(2):  # the second time after a reset
        environment.reset()
        controller = make_controller(asked, ROBOT)
        episode = environment.task.episode
        for _ in range(len(plain)):
            episode.begin(controller.command(episode.seen))  # type: ignore[union-attr]
            environment.physics.step(2)
            episode.end()
            episode.observe()
        found = episode.result().trace
        for name in ("cog_x", "cog_y", "seen_cog_vx", "dcm_error_x"):
            assert found[name].tobytes() == plain[name].tobytes(), name


def references(*, from_seen: bool, **sensing: Any) -> np.ndarray:
    """What a drive that stands at 0.5 rad makes of 0.1 rad, where 0.2 rad is seen."""
    asked = scenario(**sensing)
    episode = Episode(asked, HumanoidPlant(asked, ROBOT))
    seen, n = episode.observe(), len(ROBOT.joint_names)
    seen.configuration[7:], seen.velocity[6:] = 0.2, 0.0
    still = np.zeros(n)
    targets = JointTargets(position=np.full(n, 0.1), velocity=still, torque=still, from_seen=from_seen)
    return Drives(asked, ROBOT).reference(targets, seen, np.full(n, 0.5), still).position


def test_a_drive_takes_what_is_seen_from_its_own_encoder() -> None:
    np.testing.assert_allclose(references(from_seen=True, preset="typical"), 0.4, atol=1e-15)
    np.testing.assert_allclose(references(from_seen=True, preset="exact", servo="drive"), 0.4, atol=1e-15)
    np.testing.assert_array_equal(references(from_seen=True, preset="exact"), 0.1)
    np.testing.assert_array_equal(references(from_seen=False, preset="typical"), 0.1)


def test_an_encoder_s_offset_moves_references_that_are_angles() -> None:
    off = references(from_seen=False, preset="typical", joint={"offset": 0.01})
    assert np.std(off - 0.1) == pytest.approx(0.01, rel=0.5)
    np.testing.assert_allclose(references(from_seen=True, preset="typical", joint={"offset": 0.01}), 0.4, atol=1e-15)


def test_at_4_ms_hard_pushes_are_survived_by_drives_on_their_own_encoders() -> None:
    recovered = {"state": 0, "drive": 0}
    for servo in recovered:
        for direction in (67.5, 112.5, 247.5):
            push = {"start": 0.3, "direction": direction, "delta_v": 1.7 * omega_d(direction)}
            asked = {"sensing": {"latency": 0.004, "servo": servo}, "pushes": [push], "duration": 4.0}
            result = run_episode(load("quiet", asked), polygons=False)
            recovered[servo] += result.outcome.time_of_fall is None
    assert recovered["drive"] == 3
    assert recovered["state"] <= 1


def test_by_sensors_4_ms_late_on_a_body_that_is_not_the_model_hard_pushes_are_survived_by_the_estimator() -> None:
    plain = {"preset": "typical", "latency": 0.004}
    for sensing, survives in (
        (plain, True),
        (plain | {"servo": "state", "estimator": {"name": "ekf", "predictor": "none"}}, False),
    ):
        for direction in (67.5, 112.5, 247.5):
            push = {"start": 0.3, "direction": direction, "delta_v": 1.7 * omega_d(direction)}
            asked = {"seed": 1000, "sensing": sensing, "body": {"scale": 1.0}, "pushes": [push], "duration": 4.0}
            result = run_episode(load("quiet", asked), polygons=False)
            assert (result.outcome.time_of_fall is None) is survives, (sensing, direction)


def omega_d(direction: float) -> float:
    angle = np.radians(direction)
    return ROBOT.omega * edge_distance(ROBOT, np.array([np.cos(angle), np.sin(angle)]))
