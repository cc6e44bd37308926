"""The example scenarios of trained policies: what they say is understood; robot and policy are the user's to bring."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from controllers.learned.onnx_policy import OnnxPolicy
from models.adopt.hints import read_hints
from models.errors import InputError
from scenarios.catalogue import load

EXAMPLES = Path(__file__).resolve().parents[2] / "scenarios" / "examples" / "policies"


@pytest.mark.parametrize("name", ["t1", "bh"])
def test_an_example_is_read_once_its_files_are_there(name: str, tmp_path: Path) -> None:
    text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=rf"controller.policy: '{name}.onnx': there is no file"):
        load(tmp_path / "mine.toml")
    (tmp_path / f"{name}.onnx").write_bytes(b"")
    scenario = load(tmp_path / "mine.toml")
    assert scenario.controller.options["policy"] == str(tmp_path / f"{name}.onnx")
    assert scenario.robot.endswith(f"/{name}/{name}.xml")
    options = OnnxPolicy.Options.model_validate(scenario.controller.options)
    assert options.gait is not None
    assert (options.gait.standing is None) is (name == "bh")
    assert tomllib.loads(text)["judge"] == {"rest": "upright"}


@pytest.mark.parametrize("name", ["t1", "bh"])
def test_an_example_says_how_its_robot_is_adopted_and_pushed(name: str) -> None:
    hints = read_hints(EXAMPLES / f"{name}_robot.toml")
    assert (hints.name, hints.keyframe, hints.servos, hints.stand) == (name, "home", "file", "keyframe")
    suite = tomllib.loads((EXAMPLES / f"{name}_push.toml").read_text(encoding="utf-8"))
    assert suite["scenario"] == f"{name}.toml"
    assert suite["axes"]["controller"] == ["onnx", "supervisor", "statue"]
