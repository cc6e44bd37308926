"""Whatever is wrong with a scenario's file is told in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from models.errors import InputError
from models.robot import load_robot
from scenarios.catalogue import load
from tests.scenarios.written import PUSH, written

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
    "a long push beyond the end, a short one within": (
        "duration = 4.0\n" + PUSH + "duration = 2.0\ndirection = 0\ndelta_v = 0.1\n"
        "[[pushes]]\nstart = 3.05\ndirection = 0\ndelta_v = 0.1\n",
        ["duration", "4.0", "beyond the end of the last push, 5 s"],
    ),
    "pushes out of order": (
        PUSH + "direction = 0\ndelta_v = 0.1\n[[pushes]]\nstart = 2.95\ndirection = 0\ndelta_v = 0.1\n",
        ["pushes[1].start", "2.95", "before the start of pushes[0], 3 s", "the order in which they begin"],
    ),
    "torque and direction": (PUSH + "torque = [0, 3, 0]\ndirection = 0\n", ["pushes[0].direction", "0.0", "torque"]),
    "torque and impulse": (PUSH + "torque = [0, 3, 0]\nimpulse = 1\n", ["pushes[0].impulse", "1.0", "torque"]),
    "torque from above": (PUSH + "torque = [0, 3, 0]\nheight = 0.1\n", ["pushes[0].height", "0.1", "torque"]),
    "torque at a point": (PUSH + "torque = [0, 3, 0]\npoint = [0, 0, 0]\n", ["pushes[0].point", "torque"]),
    "torque on all bodies": (PUSH + 'torque = [0, 3, 0]\nbody = "cog"\n', ["pushes[0].body", "'cog'", "name one"]),
    "torque of nothing": (PUSH + "torque = [0, 0, 1e-9]\n", ["pushes[0].torque", "1e-09", "at least 1e-06 N m"]),
    "torque beyond all": (PUSH + "torque = [0, 0, 1e9]\n", ["pushes[0].torque[2]", "1000000000.0", "<= 100000"]),
    "flat torque": (PUSH + "torque = [0, 3]\n", ["pushes[0].torque", "3 entries"]),
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
    "deaf": ("[sensing.state_noise]\nposition = 1e9\n", ["sensing.state_noise.position", "<= 1"]),
    "late": ("[sensing]\nlatency = 1e9\n", ["sensing.latency", "<= 1"]),
    "delay of old": ("[disturbance]\ndelay = 0.004\n", ["disturbance.delay", "0.004", "sensing.latency"]),
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
