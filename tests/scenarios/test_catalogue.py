"""The shipped scenarios load, and say what the format promises; what their robot cannot do is told in one line."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
import tomli_w

from models.errors import InputError
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against, load, shipped
from scenarios.schema import Scenario
from tests.scenarios.written import PUSH, written


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def test_the_promised_scenarios_are_shipped() -> None:
    promised = {"three_pushes", "quiet", "push_back", "push_left", "push_diagonal", "push_that_fells"}
    assert promised <= set(shipped())


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenario_is_sound_and_described(name: str, robot: Robot) -> None:
    scenario = load(name)
    check_against(scenario, robot)
    assert 10 < len(scenario.description) < 90


@pytest.mark.parametrize("name", shipped())
def test_scenario_as_run_reads_back_equal(name: str, tmp_path: Path) -> None:
    scenario = load(name, {"seed": 7, "world": "pendulum"})
    path = tmp_path / "scenario.toml"
    path.write_text(tomli_w.dumps(scenario.as_dict()))
    assert load(path) == scenario


def test_three_pushes_are_the_paper_s() -> None:
    pushes = load("three_pushes").pushes
    assert [push.start for push in pushes] == [3, 6, 9]
    assert all(tuple(push.unit) == (1, 0, 0) for push in pushes)
    sizes = [push.delta_v for push in pushes]
    assert sizes == sorted(sizes)


def test_defaults_are_those_of_the_format(tmp_path: Path) -> None:
    scenario = load(written(tmp_path, PUSH + "direction = 0\ndelta_v = 0.1\n"))
    assert scenario.as_dict() == {
        "description": "x",
        "robot": "utmu2",
        "world": "humanoid",
        "controller": "supervisor",
        "whole_body": "dynamics",
        "duration": 15.0,
        "seed": 0,
        "timing": {"physics": 0.001, "control": 0.002},
        "gain": {"kind": "dcm", "k": 1.5},
        "stepping": {
            "rule": "sets",
            "max_steps": 8,
            "zmp_margin": 0.008,
            "zmp_error": 0.0,
            "max_stride": 0.28,
            "swing_height": 0.025,
            "replan": True,
            "early_trigger": 0.1,
            "steady_trigger": True,
            "angular_momentum": True,
        },
        "variation": {"pose": 0.002},
        "disturbance": {"mass_scale": 1.0},
        "sensing": {"preset": "exact", "latency": 0.0, "state_noise": {"position": 0.0, "velocity": 0.0}},
        "body": {
            "scale": 0.0,
            "mass": 0.05,
            "com": 0.002,
            "joint_friction": 0.3,
            "motor": 0.05,
            "floor_friction": 0.1,
        },
        "judge": {"rest": "still"},
        "pushes": [
            {
                "start": 3.0,
                "duration": 0.1,
                "direction": 0.0,
                "delta_v": 0.1,
                "body": "trunk",
                "height": 0.0,
                "shape": "rectangular",
            }
        ],
    }
    assert (scenario.timing.substeps, scenario.ticks) == (2, 7500)


@pytest.mark.parametrize(
    "gain",
    [
        'kind = "lqr"\nq = [1.0, 0.1]\nr = 2.0',
        'kind = "poles"\npoles = [-1.2, -4.9]',
        'kind = "poles"\npoles = [[-3, 1], [-3, -1]]',
        "k = 2.0",
    ],
)
def test_every_gain_can_be_asked_for(gain: str, tmp_path: Path) -> None:
    scenario = load(written(tmp_path, "[gain]\n" + gain))
    assert Scenario.model_validate(tomllib.loads(tomli_w.dumps(scenario.as_dict()))) == scenario


def test_poles_are_complex_numbers(tmp_path: Path) -> None:
    gain = load(written(tmp_path, '[gain]\nkind = "poles"\npoles = [[-3, 1], [-3, -1]]')).gain
    assert gain.kind == "poles"
    assert gain.poles == ((-3, 1), (-3, -1))


def test_override_is_checked_like_the_file() -> None:
    assert load("quiet", {"seed": 5}).seed == 5
    with pytest.raises(InputError, match=r"quiet\.toml: controller: 'brace' is none of 'supervisor', 'paper', "):
        load("quiet", {"controller": "brace"})


def test_robot_s_path_is_relative_to_the_scenario(tmp_path: Path) -> None:
    assert load(written(tmp_path, 'robot = "bodies/mine.xml"\n')).robot == str(tmp_path / "bodies/mine.xml")


# What is written into the file, and what the line must hold: field, value, what is allowed.
UNFIT = {
    "body that does not exist": (
        PUSH + 'direction = 0\ndelta_v = 0.1\nbody = "torso"\n',
        ["pushes[0].body", "'torso'", "trunk"],
    ),
    "step longer than the legs": ("[stepping]\nmax_stride = 0.5\n", ["stepping.max_stride", "0.5", "0.312"]),
    "step of half a tick": ("[stepping]\nstep_times = [0.12, 0.151]\n", ["stepping.step_times", "0.151", "0.002 s"]),
    "push beyond the mass": (
        PUSH + "direction = 0\nimpulse = 1e4\n",
        ["pushes[0].impulse", "10000.0", "5.53 kg", "20 m/s"],
    ),
    "more rows than memory": (
        "duration = 3600\n[timing]\ncontrol = 0.001\n",
        ["duration", "3600.0", "3600000 rows of 120", "at most 2083333 rows, 2 GB"],
    ),
    "foot lifted over the hip": ("[stepping]\nswing_height = 0.4\n", ["stepping.swing_height", "0.4", "0.312"]),
    "margin as wide as the sole": ("[stepping]\nzmp_margin = 0.04\n", ["stepping.zmp_margin", "0.04", "0.036"]),
    "pendulum turned": (
        'world = "pendulum"\n' + PUSH + "torque = [0, -3, 0]\n",
        ["pushes[0].torque", "torque 3 N m about -y on trunk", "point"],
    ),
    "torque beyond the mass": (
        PUSH + "torque = [0, 0, 1000]\n",
        ["pushes[0].torque", "1e+03 N m about z", "100 N m s", "at most 28.8 N m s"],
    ),
    "pendulum pushed up": (
        'world = "pendulum"\n' + PUSH + "vector = [1, 0, 1]\ndelta_v = 0.1\n",
        ["pushes[0].vector", "[1.0, 0.0, 1.0]", "horizontal"],
    ),
}


@pytest.mark.parametrize("what", UNFIT)
def test_what_the_robot_cannot_do_is_told_in_one_line(what: str, tmp_path: Path, robot: Robot) -> None:
    text, words = UNFIT[what]
    scenario = load(written(tmp_path, text))
    with pytest.raises(InputError) as caught:
        check_against(scenario, robot, source="mine.toml")
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith("mine.toml: ")
    for word in words:
        assert word in line


def test_minus_zero_is_zero(tmp_path: Path) -> None:
    scenario = load(written(tmp_path, "[variation]\npose = -0.0\n[sensing.state_noise]\nvelocity = -0.0\n"))
    assert math.copysign(1.0, scenario.variation.pose) == 1.0
    assert math.copysign(1.0, scenario.sensing.state_noise.velocity) == 1.0
