"""placo gets the compiled body, and a robot's hash is of all that it is made of."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import placo
import pytest

from controllers.whole_body.placo_model import PlacoModel
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from tests.models.robot_files import replaced, with_includes


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def test_placo_s_model_is_that_of_the_file_bit_by_bit() -> None:
    robot = load_robot("utmu2")
    flat = PlacoModel(robot)
    direct = placo.RobotWrapper(str(robot.path), placo.Flags.mjcf + placo.Flags.ignore_collisions)
    rng = np.random.default_rng(5)
    state = direct.state
    state.q = np.concatenate([[0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], rng.normal(0, 0.3, 20)])
    state.qd = rng.normal(size=26)
    for wrapper in (direct, flat.wrapper):
        wrapper.state.q, wrapper.state.qd = state.q, state.qd
        wrapper.update_kinematics()
    for name in ("mass_matrix", "com_world", "non_linear_effects", "com_jacobian"):
        np.testing.assert_array_equal(getattr(direct, name)(), getattr(flat.wrapper, name)())
    for name in ("left_sole", "right_sole", "trunk"):
        np.testing.assert_array_equal(direct.get_T_world_frame(name), flat.wrapper.get_T_world_frame(name))
    for name in ("lowerPositionLimit", "upperPositionLimit", "armature", "damping"):
        np.testing.assert_array_equal(getattr(direct.model, name), getattr(flat.wrapper.model, name))


@pytest.mark.parametrize("layer", ["dynamics", "ik"])
def test_included_defaults_change_no_bit(layer: str, tmp_path: Path) -> None:
    push = {"start": 0.2, "direction": 30.0, "delta_v": 0.3}
    fields = load("quiet").as_dict() | {"duration": 0.8, "whole_body": layer, "pushes": [push]}
    mine = with_includes(tmp_path, write)
    own, shipped = (run_episode(Scenario.model_validate(fields | {"robot": name})) for name in (str(mine), "utmu2"))
    assert own.trace.channels == shipped.trace.channels
    np.testing.assert_array_equal(own.trace.values, shipped.trace.values)


def tetrahedron(size: float) -> bytes:
    """A binary STL file."""
    corners = size * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    triangles = (struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0) for face in faces)
    return bytes(80) + struct.pack("<I", len(faces)) + b"".join(triangles)


def test_the_hash_is_of_the_file_and_all_that_it_refers_to(tmp_path: Path) -> None:
    head = '<geom name="head" type="sphere" size="0.040" pos="0.004 0 0.208"/>'
    text = replaced(
        ("<default>\n    <geom", '<asset><mesh name="m" file="m.stl"/></asset><default>\n    <geom'),
        (head, '<geom name="head" type="mesh" mesh="m" pos="0.004 0 0.208"/>'),
    )
    hashes = set()
    for folder, text_now, size in (("a", text, 0.02), ("b", text, 0.021), ("c", text.replace("0.208", "0.209"), 0.02)):
        write(tmp_path / folder / "mine.xml", text_now)
        (tmp_path / folder / "m.stl").write_bytes(tetrahedron(size))
        hashes.add(load_robot(str(tmp_path / folder / "mine.xml")).sha256)
    assert len(hashes) == 3
    # Where it lies makes no difference, what it includes does.
    assert load_robot(str(with_includes(tmp_path / "d", write))).sha256 not in hashes
    defaults = tmp_path / "d" / "parts" / "defaults.xml"
    former = load_robot(str(tmp_path / "d" / "mine.xml")).sha256
    assert former == load_robot(str(with_includes(tmp_path / "e", write))).sha256
    defaults.write_text(defaults.read_text().replace('damping="0.02"', 'damping="0.03"'))
    assert former != load_robot(str(tmp_path / "d" / "mine.xml")).sha256


def test_a_trace_says_which_robot_and_which_controller_it_is_of(tmp_path: Path) -> None:
    source = tmp_path / "mine.py"
    source.write_text("from controllers.baselines.statue import Statue\n\n\nclass Mine(Statue):\n    pass\n")
    fields = load("quiet").as_dict() | {"duration": 0.1, "world": "pendulum"}
    named = {"statue": None, f"{source}:Mine": 64}
    for controller, length in named.items():
        result = run_episode(Scenario.model_validate(fields | {"controller": controller}))
        facts = result.trace.metadata
        assert facts["robot"]["sha256"] == load_robot("utmu2").sha256
        assert (None if length is None else len(facts["controller_source"])) == length
