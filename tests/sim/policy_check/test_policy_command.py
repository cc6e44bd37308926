"""`okiagari policy` and episodes of a policy, on networks of one layer that stand, fall, swing or answer nonsense."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from controllers.learned.observation_terms import Name, TermOptions
from controllers.learned.onnx_policy import Gait, OnnxPolicy
from models.errors import InputError
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.cli.app import main
from sim.episode.build import make_controller
from sim.episode.episode import Episode, run_episode
from sim.episode.plant import HumanoidPlant
from sim.record.trace import load_trace
from sim.sweep.worker import makers_of
from tests.controllers.learned.tiny_network import TAKES, write_network

pytest.importorskip("onnxruntime", reason=TAKES)
pytest.importorskip("onnx", reason=TAKES)

COUNT = 20
TERMS = ["projected_gravity", "command", {"name": "joint_velocity", "clip": 0.02}, "last_action"]
SIZE = 3 + 3 + COUNT + COUNT
FILE = """description = "a policy"
duration = 4.0
seed = 3
[controller]
name = "onnx"
policy = "p.onnx"
observation = ["projected_gravity", "command", { name = "joint_velocity", clip = 0.02 }, "last_action"]
[[pushes]]
start = 1.0
direction = 0.0
delta_v = 3.0
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario whose policy holds the pose; the working folder is another one."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "p.toml").write_text(FILE)
    write_network(tmp_path / "mine" / "p.onnx", np.zeros((COUNT, SIZE)))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "mine"


def scenario(policy: Path, **fields: Any) -> Scenario:
    """An unpushed second of a policy; `options` are the controller's."""
    table = {"name": "onnx", "policy": str(policy), "observation": TERMS} | fields.pop("options", {})
    return load("quiet", {"duration": 1.0, "controller": table} | fields)


def test_a_policy_that_holds_the_pose_stands(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["policy", "mine/p.toml", "--seconds", "3", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["stands"]
    assert report["stood_for"] == pytest.approx(3.0, abs=0.01)
    assert report["questions"] == 150
    assert report["steps"] == 0
    assert report["cog_drift"]["greatest"] < 0.02
    assert report["not_shown"] is None
    terms = {term["name"]: term for term in report["terms"]}
    assert [terms[name]["size"] for name in terms] == [3, 3, COUNT, COUNT]
    assert terms["command"]["constant"] == ["vx", "vy", "wz"]
    assert terms["last_action"]["min"] == terms["last_action"]["max"] == 0.0
    gravity = {one["name"]: one for one in terms["projected_gravity"]["components"]}
    assert gravity["z"]["mean"] == pytest.approx(-1.0, abs=1e-3)
    speed = terms["joint_velocity"]
    assert -0.02 <= speed["min"] < speed["max"] <= 0.02
    assert speed["clip"] == [-0.02, 0.02]
    assert speed["at_clip"]
    assert all(0.0 < share < 1.0 for share in speed["at_clip"].values())
    assert report["action"] == {"size": COUNT, "rms": 0.0, "max": 0.0, "change_rms": 0.0, "change_max": 0.0}
    assert report["torque"]["saturated_share"] == 0.0


def test_it_is_told_in_words(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["policy", "mine/p.toml", "--seconds", "1"]) == 0
    told = capsys.readouterr().out
    assert "46 numbers, 50 questions, one in 0.02 s" in told
    assert "onnx stands to the end, 1.00 s; 0 steps" in told
    assert "torque at its limit in 0 % of the ticks" in told


def test_one_that_bends_its_knees_falls(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = load_robot("utmu2")
    bias = [1.5 if "knee" in name else 0.0 for name in robot.joint_names]
    write_network(here / "p.onnx", np.zeros((COUNT, SIZE)), bias)
    assert main(["policy", "mine/p.toml"]) == 1
    told = capsys.readouterr().out
    assert "onnx fell after" in told
    assert "stands" not in told


def test_action_and_its_change_are_what_the_network_answers(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # y = 0.01 - last y: 0.01, 0, 0.01, ...
    weight = np.hstack((np.zeros((COUNT, SIZE - COUNT)), -np.eye(COUNT)))
    write_network(here / "p.onnx", weight, 0.01)
    assert main(["policy", "mine/p.toml", "--seconds", "2", "--json"]) == 0
    action = json.loads(capsys.readouterr().out)["action"]
    assert action["rms"] == pytest.approx(0.01 / np.sqrt(2))
    assert action["max"] == action["change_max"] == pytest.approx(0.01)
    assert action["change_rms"] == pytest.approx(0.01)


def test_an_episode_repeats_bit_by_bit(here: Path) -> None:
    rng = np.random.default_rng(1)
    path = write_network(here / "p.onnx", 0.05 * rng.standard_normal((COUNT, SIZE)))
    one, other = (run_episode(scenario(path), polygons=False).trace.values for _ in range(2))
    assert one.tobytes() == other.tobytes()
    still = write_network(here / "still.onnx", np.zeros((COUNT, SIZE)))
    assert run_episode(scenario(still), polygons=False).trace.values.tobytes() != one.tobytes()


def test_a_run_can_be_run_again_from_its_folder(here: Path) -> None:
    (here / "p.toml").write_text(FILE.replace("duration = 4.0", "duration = 1.5"))
    for number, source in enumerate((here / "p.toml", Path("out0") / "scenario.toml")):
        assert main(["run", str(source), "--no-video", "--out", f"out{number}"]) == 0
    first, second = (load_trace(Path(f"out{number}") / "trace.parquet") for number in range(2))
    assert first.values.tobytes() == second.values.tobytes()
    assert first.metadata["versions"]["onnxruntime"] == second.metadata["versions"]["onnxruntime"] != "unknown"
    assert len(first.metadata["controller_files"]["policy"]) == 64


def test_its_gains_are_given_to_the_servos(here: Path) -> None:
    robot = load_robot("utmu2")
    gains = np.linspace(20.0, 40.0, COUNT)
    one = scenario(here / "p.onnx", options={"stiffness": gains.tolist(), "damping": {"*knee*": 7.0}})
    plant = HumanoidPlant(one, robot)
    episode = Episode(one, plant, make_controller(one, robot))
    assert episode.tick()
    model = plant.world.physics.model.ptr
    order = [model.actuator_trnid[:, 0].tolist().index(model.joint(name).id) for name in robot.joint_names]
    given = model.actuator_gainprm[order]
    assert given[:, 4] == pytest.approx(gains)
    knees = np.array(["knee" in name for name in robot.joint_names])
    assert given[:, 6] == pytest.approx(np.where(knees, 7.0, robot.servo_damping))


def test_a_network_that_answers_nan_is_refused_in_one_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_network(here / "p.onnx", np.zeros((COUNT, SIZE)), np.nan)
    assert main(["policy", "mine/p.toml"]) == 2
    told = capsys.readouterr().err
    assert "controller 'onnx': tick 0: position" in told
    assert "is not finite" in told
    assert told.count("\n") == 1
    assert main(["run", "mine/p.toml", "--no-video", "--out", "out"]) == 2
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"p.onnx"', '"nowhere.onnx"'), "controller.policy: 'nowhere.onnx': there is no file"),
        (('policy = "p.onnx"\n', ""), "controller.policy: is missing; it must be given"),
        (('"command"', '"comand"'), "controller.observation[1].name: 'comand' is not"),
        (("seed = 3", "[timing]\ncontrol = 0.003"), "a whole multiple of the control period, 0.003 s"),
        (("seed = 3", 'world = "pendulum"'), "'onnx' moves joints, and the world 'pendulum' has none"),
    ],
)
def test_what_is_wrong_is_one_line(
    change: tuple[str, str], words: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "p.toml").write_text(FILE.replace(*change))
    assert main(["policy", "mine/p.toml"]) == 2
    told = capsys.readouterr().err
    assert "mine/p.toml: " in told
    assert words in told
    assert told.count("\n") == 1


def test_who_is_no_policy_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["policy", "quiet"]) == 2
    assert "'supervisor' gives balance commands; a policy moves the joints itself" in capsys.readouterr().err
    with pytest.raises(InputError, match="nowhere"):
        scenario(Path("nowhere.onnx"))


MINE = """import numpy as np
from controllers import JointTargets
from controllers.shown import ObservationTerm

class Quiet:
    period = 0.02
    def __init__(self, setting, options): self.stand = setting.robot.stand[7:]
    def reset(self, seed): ...
    def targets(self, seen):
        return JointTargets(position=self.stand, velocity=0 * self.stand, torque=0 * self.stand)

class Open(Quiet):
    observation_terms = (ObservationTerm(name="speed", components=("x", "y"), places=np.array([1, 0])),)
    last_action = np.zeros(1)
    @property
    def last_input(self): return np.array([2.0, 1.0])

class Wrong(Open):
    last_input = np.zeros(3)
"""


def of_mine(folder: Path, cls: str, capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, str, str]:
    (folder / "mine.py").write_text(MINE)
    (folder / "own.toml").write_text(f'description = "x"\ncontroller = "mine.py:{cls}"\n')
    code = main(["policy", str(folder / "own.toml"), "--seconds", "0.5", *options])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_a_file_of_the_user_s_may_show_it_or_not(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = of_mine(here, "Quiet", capsys)
    assert code == 0
    assert "mine.py:Quiet does not show what it is given and what it answers: it lacks observation_terms" in out
    assert "mine.py:Quiet stands to the end" in out
    code, out, _ = of_mine(here, "Open", capsys, "--json")
    assert code == 0
    (term,) = json.loads(out)["terms"]
    assert [(one["name"], one["mean"]) for one in term["components"]] == [("x", 1.0), ("y", 2.0)]
    code, _, err = of_mine(here, "Wrong", capsys)
    assert code == 2
    assert "controller 'mine.py:Wrong': last_input has shape (3,); it must be an array of shape (2,)" in err
    assert err.count("\n") == 1


DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "policies.md"


def test_the_document_names_every_option_and_term() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    for model in (OnnxPolicy.Options, TermOptions, Gait):
        assert [name for name in model.model_fields if f"`{name}`" not in text and f" {name}" not in text] == []
    assert [name for name in get_args(Name) if f"`{name}`" not in text] == []


def test_the_document_s_own_controller_is_shown(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)[0]
    (here / "linear.py").write_text(code)
    np.savetxt(here / "gains.txt", np.zeros((COUNT, 3)))
    (here / "own.toml").write_text(
        'description = "x"\ncontroller = { name = "linear.py:Linear", gains = "gains.txt" }\n'
    )
    assert main(["policy", "mine/own.toml", "--seconds", "1", "--json"]) == 0
    assert [term["name"] for term in json.loads(capsys.readouterr().out)["terms"]] == ["gyro"]
    made = makers_of(load(here / "own.toml"))
    assert len(made["gains.txt"]) == len(made["linear.py:Linear"]) == 12
