"""The shipped scenarios load, and whatever is wrong with one is told in one line."""

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

PUSH = "[[pushes]]\nstart = 3.0\n"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def written(folder: Path, text: str, *, description: str = 'description = "x"\n') -> Path:
    path = folder / "mine.toml"
    path.write_text(description + text)
    return path


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
            "step_times": [0.12, 0.15, 0.18],
            "max_steps": 8,
            "zmp_margin": 0.008,
            "zmp_error": 0.0,
            "max_stride": 0.28,
            "swing_height": 0.025,
            "replan": True,
            "early_trigger": 0.1,
            "angular_momentum": True,
        },
        "variation": {"pose": 0.002},
        "disturbance": {"mass_scale": 1.0, "delay": 0.0, "noise_position": 0.0, "noise_velocity": 0.0},
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


# What is written into the file, and what the line must hold: field, value, what is allowed.
WRONG = {
    "unknown field": ("sedd = 3\n", ["sedd", "'seed'"]),
    "unknown field of a push": (
        PUSH + "direction = 0\ndelta_v = 0.1\ndurtion = 1\n",
        ["pushes[0].durtion", "'duration'"],
    ),
    "unknown table": ("[timming]\nphysics = 0.001\n", ["timming", "'timing'"]),
    "field of another gain": ('[gain]\nkind = "lqr"\nq = [1, 1]\nr = 1\nk = 2\n', ["gain.k", "kind, q, r"]),
    "unknown gain": ('[gain]\nkind = "pid"\n', ["gain.kind", "'pid'", "'dcm', 'lqr', 'poles'"]),
    "weak gain": ("[gain]\nk = 1.0\n", ["gain.k", "1.0", "> 1"]),
    "unstable pole": ('[gain]\nkind = "poles"\npoles = [1.2, -4.9]\n', ["gain.poles", "1.2", "negative"]),
    "half a pair": ('[gain]\nkind = "poles"\npoles = [[-1, 1], -4.9]\n', ["gain.poles", "conjugate"]),
    "negative duration": ("duration = -1.0\n", ["duration", "-1.0", "> 0"]),
    "negative duration of a push": (
        PUSH + "direction = 0\ndelta_v = 0.1\nduration = -0.1\n",
        ["pushes[0].duration", "-0.1", ">= 0.0001"],
    ),
    "nan": (PUSH + "direction = 0\ndelta_v = nan\n", ["pushes[0].delta_v", "nan"]),
    "infinity": ("duration = inf\n", ["duration", "inf", "finite"]),
    "nan in a vector": (PUSH + "vector = [nan, 0, 0]\ndelta_v = 0.1\n", ["pushes[0].vector[0]", "nan", "finite"]),
    "no direction": (PUSH + "delta_v = 0.1\n", ["pushes[0].direction", "exactly one", "vector"]),
    "two directions": (
        PUSH + "direction = 0\nvector = [1, 0, 0]\ndelta_v = 0.1\n",
        ["pushes[0].direction", "exactly one"],
    ),
    "no size": (PUSH + "direction = 0\n", ["pushes[0].impulse", "exactly one", "delta_v"]),
    "two sizes": (PUSH + "direction = 0\nimpulse = 1\ndelta_v = 0.1\n", ["pushes[0].impulse", "exactly one"]),
    "no vector": (PUSH + "vector = [0, 0, 0]\ndelta_v = 0.1\n", ["pushes[0].vector", "[0, 0, 0]", "zero"]),
    "short vector": (PUSH + "vector = [1, 0]\ndelta_v = 0.1\n", ["pushes[0].vector", "[1, 0]", "3"]),
    "long point": (PUSH + "direction = 0\ndelta_v = 0.1\npoint = [0, 0, 0, 0]\n", ["pushes[0].point", "3"]),
    "number as text": ('duration = "15"\n', ["duration", "'15'", "number"]),
    "flag as number": ("duration = true\n", ["duration", "True", "number"]),
    "broken seed": ("seed = 1.5\n", ["seed", "1.5", "whole"]),
    "negative seed": ("seed = -1\n", ["seed", "-1", ">= 0"]),
    "unknown world": ('world = "pendulun"\n', ["world", "'pendulun'", "'humanoid' or 'pendulum'"]),
    "non-divisible periods": ("[timing]\ncontrol = 0.0015\n", ["timing.control", "0.0015", "0.001", "multiple"]),
    "control faster than physics": ("[timing]\ncontrol = 0.0005\n", ["timing.control", "0.0005", "multiple"]),
    "no step time": ("[stepping]\nstep_times = []\n", ["stepping.step_times", "at least 1"]),
    "push beyond the end": (
        "duration = 3.1\n" + PUSH + "direction = 0\ndelta_v = 0.1\n",
        ["duration", "3.1", "beyond the end of the last push"],
    ),
    "pushes at once": (
        PUSH + "direction = 0\ndelta_v = 0.1\n[[pushes]]\nstart = 3.05\ndirection = 0\ndelta_v = 0.1\n",
        ["pushes[1].start", "3.05", "3.1"],
    ),
    "pushes in one control period": (
        PUSH + "duration = 0.1005\ndirection = 0\ndelta_v = 0.1\n"
        "[[pushes]]\nstart = 3.101\ndirection = 0\ndelta_v = 0.1\n",
        ["pushes[1].start", "3.101", "one control period"],
    ),
    "one table of pushes": ("[pushes]\nstart = 3.0\n", ["pushes", "list"]),
    "no table": ("timing = 3\n", ["timing", "3", "table"]),
    "nameless robot": ('robot = ""\n', ["robot", "''", "not empty"]),
    # Numbers at the rim, which were lost, never ended, or asked for all memory.
    "push too short to be felt": (
        PUSH + "direction = 0\ndelta_v = 0.2\nduration = 1e-9\n",
        ["pushes[0].duration", "1e-09", ">= 0.0001"],
    ),
    "push at the end of time": (
        "[[pushes]]\nstart = 1.7e308\ndirection = 0\ndelta_v = 0.1\n",
        ["pushes[0].start", "1.7e+308", "<= 3600"],
    ),
    "push faster than anything": (PUSH + "direction = 0\ndelta_v = 1e8\n", ["pushes[0].delta_v", "<= 20"]),
    "push weaker than rounding": (PUSH + "direction = 0\nimpulse = 5e-324\n", ["pushes[0].impulse", ">= 1e-06"]),
    "push from afar": (PUSH + "direction = 0\ndelta_v = 0.1\nheight = 1e9\n", ["pushes[0].height", "<= 10"]),
    "whirling push": (PUSH + "direction = 1e300\ndelta_v = 0.1\n", ["pushes[0].direction", "<= 3600"]),
    "control of minutes": ("[timing]\ncontrol = 180\n", ["timing.control", "180", "<= 0.1"]),
    "physics of nothing": ("[timing]\nphysics = 5e-324\n", ["timing.physics", "5e-324", ">= 0.0001"]),
    "days": ("duration = 1e6\n", ["duration", "1000000.0", "<= 3600"]),
    "eons": ("duration = 1e308\n", ["duration", "1e+308", "<= 3600"]),
    "no time at all": ("duration = 5e-324\n", ["duration", "5e-324", "control period, 0.002 s"]),
    "massless": ("[disturbance]\nmass_scale = 1e-300\n", ["disturbance.mass_scale", "1e-300", ">= 0.1"]),
    "deaf": ("[disturbance]\nnoise_position = 1e9\n", ["disturbance.noise_position", "<= 1"]),
    "late": ("[disturbance]\ndelay = 1e9\n", ["disturbance.delay", "<= 1"]),
    "step of minutes": ("[stepping]\nstep_times = [1000.0]\n", ["stepping.step_times[0]", "1000.0", "<= 1"]),
    "steps by the dozen": (
        f"[stepping]\nstep_times = {[0.02 * i for i in range(1, 13)]}\n",
        ["stepping.step_times", "12 entries", "at most 10"],
    ),
    "clairvoyance": ("[stepping]\nearly_trigger = 1e300\n", ["stepping.early_trigger", "<= 1"]),
    "weight of everything": ('[gain]\nkind = "lqr"\nq = [1e300, 1]\nr = 1\n', ["gain.q[0]", "<= 1e+09"]),
    "seed of many digits": (f"seed = {2**63}\n", ["seed", "< 9.22337e+18"]),
    "nested lists": ("x = " + "[" * 2000 + "]" * 2000 + "\n", ["more than 20 deep"]),
    "nested tables": ("x" + ".x" * 2000 + " = 1\n", ["more than 20 deep"]),
}


NOWHERE = ["a\\u0000b", "x" * 5000, "y/" * 2100 + "z"]


@pytest.mark.parametrize("name", NOWHERE, ids=["nul", "long", "deep"])
def test_a_name_that_no_file_can_have_is_told(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mine\.toml: controller: .* there is no file"):
        load(written(tmp_path, f'controller = "{name}.py:Class"\n'))
    with pytest.raises(InputError, match=r"robot: no file"):
        load_robot(load(written(tmp_path, f'robot = "{name}.xml"\n')).robot)
    with pytest.raises(InputError, match=r"scenario: no file"):
        load(name + ".toml")


@pytest.mark.parametrize("what", WRONG)
def test_wrong_file_is_told_in_one_line(what: str, tmp_path: Path) -> None:
    text, words = WRONG[what]
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        load(path)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(f"{path}: ")
    for word in words:
        assert word in line


def test_missing_description_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"description: is missing"):
        load(written(tmp_path, "", description=""))


def test_description_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"description: 'a\\nb' is not one line of text"):
        load(written(tmp_path, "", description='description = "a\\nb"\n'))


def test_misspelt_field_is_told_before_the_field_that_is_missing_for_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"discription: unknown field; did you mean 'description'\?.*and 1 more"):
        load(written(tmp_path, 'discription = "x"\n', description=""))


def test_misspelt_scenario_gets_the_list_and_the_nearest() -> None:
    with pytest.raises(InputError, match=r"'three_push' is neither one of .*quiet.* did you mean 'three_pushes'\?"):
        load("three_push")


def test_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no file .*none\.toml"):
        load(tmp_path / "none.toml")


@pytest.mark.parametrize("content", [b"description = \n", b"\xff\xfe\x00", b"just words"])
def test_file_that_is_no_toml_is_told(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.toml: not a TOML file: ") as caught:
        load(path)
    assert "\n" not in str(caught.value)


def test_override_is_checked_like_the_file() -> None:
    assert load("quiet", {"seed": 5}).seed == 5
    with pytest.raises(InputError, match=r"quiet\.toml: controller: 'brace' is none of 'supervisor', 'paper', "):
        load("quiet", {"controller": "brace"})


def test_robot_s_path_is_relative_to_the_scenario(tmp_path: Path) -> None:
    assert load(written(tmp_path, 'robot = "bodies/mine.xml"\n')).robot == str(tmp_path / "bodies/mine.xml")


# The same for what only the robot can tell.
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
    scenario = load(written(tmp_path, "[variation]\npose = -0.0\n[disturbance]\nnoise_velocity = -0.0\n"))
    assert math.copysign(1.0, scenario.variation.pose) == 1.0
    assert math.copysign(1.0, scenario.disturbance.noise_velocity) == 1.0
