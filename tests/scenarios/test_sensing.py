"""What a scenario may say of senses and body, and what is refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from models.errors import InputError
from scenarios.catalogue import load
from scenarios.sensing import FOOT_PRESETS, IMU_PRESETS, JOINT_PRESETS
from tests.scenarios.written import written

WRONG = {
    "unknown preset": ('[sensing]\npreset = "chep"\n', ["sensing.preset", "'chep'", "did you mean 'cheap'?"]),
    "unknown estimator": ('[sensing]\nestimator = "efk"\n', ["sensing.estimator", "'efk'", "did you mean 'ekf'?"]),
    "option of ekf": (
        '[sensing.estimator]\nname = "ekf"\npredicter = "none"\n',
        ["sensing.estimator.predicter", "did you mean 'predictor'?"],
    ),
    "half a step": ("[sensing]\nlatency = 0.0005\n", ["sensing.latency", "0.0005 s", "physics step, 0.001 s"]),
    "half a period": (
        'world = "pendulum"\n[sensing]\nlatency = 0.003\n',
        ["sensing.latency", "0.003 s", "control period, 0.002 s"],
    ),
    "rate between": (
        '[sensing]\npreset = "ideal"\n[sensing.imu]\nrate = 300.0\n',
        ["sensing.imu.rate", "300.0", "1000"],
    ),
    "faster than physics": (
        '[sensing]\npreset = "ideal"\n[sensing.foot]\nrate = 2000.0\n',
        ["sensing.foot.rate", "2000.0"],
    ),
    "sensor that nobody reads": ("[sensing.imu]\ngyro_bias = 0.1\n", ["sensing.imu.gyro_bias", "'truth'"]),
    "sensors that nobody reads": (
        '[sensing]\npreset = "typical"\nestimator = "truth"\n',
        ["sensing.preset", "'typical'", "'truth'", "servo"],
    ),
    "longer than is looked ahead": (
        '[sensing]\npreset = "ideal"\nestimator = { name = "ekf", latency = 0.2 }\n',
        ["sensing.estimator.latency", "0.2", "0.1"],
    ),
    "unknown figure": (
        '[sensing]\npreset = "ideal"\n[sensing.joint]\ncount = 4096\n',
        ["sensing.joint.count", "'counts'"],
    ),
    "noise beside an estimator": (
        '[sensing]\npreset = "ideal"\n[sensing.state_noise]\nvelocity = 0.1\n',
        ["sensing.state_noise", "estimator"],
    ),
    "sensors of a pendulum": ('world = "pendulum"\n[sensing]\npreset = "typical"\n', ["sensing", "pendulum"]),
    "links of a pendulum": ('world = "pendulum"\n[body]\nscale = 1.0\n', ["body.scale", "1.0", "pendulum"]),
    "figure without scale": ("[body]\nmass = 0.1\n", ["body.mass", "scale"]),
    "figure too large": ("[body]\nscale = 1.0\nmass = 0.6\n", ["body.mass", "0.6", "<= 0.5"]),
    "old noise": (
        "[disturbance]\nnoise_velocity = 0.01\n",
        ["disturbance.noise_velocity", "sensing.state_noise.velocity"],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_senses_are_told_in_one_line(name: str, tmp_path: Path) -> None:
    text, words = WRONG[name]
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, text))
    line = str(caught.value)
    assert "\n" not in line
    for word in words:
        assert word in line


def test_files_of_former_runs_are_read() -> None:
    fields = {"disturbance": {"mass_scale": 1.1, "delay": 0.0, "noise_position": 0.0, "noise_velocity": 0.0}}
    assert load("quiet", fields).as_dict()["disturbance"] == {"mass_scale": 1.1}


def test_presets_and_what_they_bring() -> None:
    exact = load("quiet").sensing
    assert (exact.is_true, exact.estimates, exact.at_drive, exact.who.name) == (True, False, False, "truth")
    for preset in ("ideal", "typical", "cheap"):
        sensing = load("quiet", {"sensing": {"preset": preset}}).sensing
        assert (sensing.is_true, sensing.estimates, sensing.at_drive, sensing.who.name) == (False, True, True, "ekf")
        found = (sensing.joint_figures, sensing.imu_figures, sensing.foot_figures)
        assert found == (JOINT_PRESETS[preset], IMU_PRESETS[preset], FOOT_PRESETS[preset])


def test_a_preset_s_sensors_are_read_at_their_rate_however_short_the_steps() -> None:
    for preset in ("typical", "cheap"):
        assert {presets[preset].rate for presets in (JOINT_PRESETS, IMU_PRESETS, FOOT_PRESETS)} == {1000.0}


def test_cheaper_is_nowhere_better() -> None:
    for presets in (JOINT_PRESETS, IMU_PRESETS, FOOT_PRESETS):
        ideal, typical, cheap = (presets[name].model_dump() | {} for name in ("ideal", "typical", "cheap"))
        for name in set(typical) & set(cheap):
            if name == "counts" or name == "rate" or name.endswith("range"):
                assert cheap[name] <= typical[name]
            else:
                assert cheap[name] >= typical[name] >= ideal.get(name, 0.0)
