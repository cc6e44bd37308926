"""Controllers at joint level: asked at their own rate, with their own servo gains, and judged like all others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controllers.interface import FootState, JointTargets, Observation
from models.errors import InputError
from models.robot import Robot, load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.cli.app import main
from sim.episode.episode import Episode, run_episode
from sim.episode.plant import make_plant
from sim.episode.step_count import StepCount
from sim.record.outcome import Result
from tests.controllers.sight import seen

PUSH = {"start": 0.3, "direction": 0.0, "delta_v": 0.05}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


class Stand:
    """The stand's angles, and a note of when it was asked and which seed it began with."""

    def __init__(self, robot: Robot, period: float = 0.02, **gains: Any) -> None:
        self.period, self._gains, self._robot = period, gains, robot
        self.asked: list[float] = []
        self.seed: int | None = None

    def reset(self, seed: int) -> None:
        self.asked, self.seed = [], seed

    def targets(self, observation: Observation) -> JointTargets:
        self.asked.append(observation.time)
        position = self._robot.stand[7:]
        return JointTargets(position=position, velocity=0 * position, torque=0 * position, **self._gains)


def pushed(**fields: Any) -> Scenario:
    return load("quiet", {"duration": 3.0, "pushes": [PUSH], "seed": 7} | fields)


def test_it_is_asked_at_its_own_rate_and_stands(robot: Robot) -> None:
    controller = Stand(robot)
    result = run_episode(pushed(), controller=controller, robot=robot, polygons=False)
    assert result.outcome.result is Result.RECOVERED
    assert controller.seed == 7
    assert np.diff(controller.asked) == pytest.approx(0.02)
    trace = result.trace
    assert np.isnan(trace["zmp_cmd_x"]).all()
    assert trace["left_stance"].all()
    assert result.outcome.steps_taken == 0
    # It has no sets, so nothing is said of them.
    assert result.pushes[0].in_regulator_set is result.pushes[0].in_tracking_set is None


def test_its_servo_gains_count_and_are_gone_with_it(robot: Robot) -> None:
    scenario = pushed()
    plant = make_plant(scenario, robot)

    def outcome(**gains: Any) -> tuple[Result, np.ndarray]:
        plant.reset(scenario)
        episode = Episode(scenario, plant, Stand(robot, **gains))
        while episode.tick():
            pass
        result = episode.result()
        return result.outcome.result, result.trace.values

    count = len(robot.joint_names)
    before = outcome()
    assert outcome(stiffness=np.zeros(count), damping=np.zeros(count))[0] is Result.FELL
    after = outcome()
    assert before[0] is after[0] is Result.RECOVERED
    assert np.array_equal(before[1], after[1], equal_nan=True)


@pytest.mark.parametrize("period", [0.003, 0.0, -0.02, float("nan"), None])
def test_a_period_must_be_whole_ticks(period: Any, robot: Robot) -> None:
    with pytest.raises(InputError, match=r"period: .* must be a number of seconds, a whole multiple"):
        run_episode(pushed(), controller=Stand(robot, period), robot=robot)


FILE = """import numpy as np
from controllers import JointTargets, Setting, Strict

class Mine:
    class Options(Strict):
        period: float = 0.02

    def __init__(self, setting: Setting, options: Options) -> None:
        self.period, self.stand = options.period, setting.robot.stand[7:]

    def reset(self, seed: int) -> None: ...

    def targets(self, seen):
        return {answer}
"""
GOOD = "JointTargets(position=self.stand, velocity=0 * self.stand, torque=0 * self.stand)"


def test_a_file_of_the_user_s_runs_by_its_path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(FILE.replace("{answer}", GOOD))
    (tmp_path / "mine.toml").write_text(
        'description = "x"\nduration = 1.0\n[controller]\nname = "mine.py:Mine"\nperiod = 0.01\n'
    )
    assert main(["run", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out"), "--no-video"]) == 0
    assert "mine.py:Mine" in capsys.readouterr().out
    (tmp_path / "mine.py").write_text(FILE.replace("{answer}", GOOD).replace("def reset", "def begin"))
    assert main(["run", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "with-no-reset"), "--no-video"]) == 0
    assert main(["run", str(tmp_path / "mine.toml"), "--world", "pendulum", "--no-video"]) == 2
    assert "moves joints, and the world 'pendulum' has none" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("None", "tick 0: targets is None; it must be a JointTargets"),
        (GOOD.replace("self.stand,", "self.stand[1:],", 1), "tick 0: position has shape"),
        (GOOD.replace("0 * self.stand)", "np.nan * self.stand)"), "is not finite"),
        (GOOD.replace("torque=", "stiffness=1.0, torque="), "stiffness is of the type float"),
        ("self.nothing", "tick 0: targets() raised AttributeError"),
    ],
)
def test_a_bad_answer_is_one_line(answer: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(FILE.replace("{answer}", answer))
    assert main(["run", "quiet", "--controller", f"{tmp_path / 'mine.py'}:Mine", "--no-video"]) == 2
    told = capsys.readouterr().err
    assert f"controller 'mine.py:Mine': {words}" in told or words in told
    assert told.count("\n") == 1


def test_steps_are_counted_from_contacts_and_bounces_are_none() -> None:
    count, zero = StepCount(), np.zeros(1)
    targets = JointTargets(position=zero, velocity=zero, torque=zero)

    def at(time: float, left: float) -> Observation:
        view = seen((0.0, 0.05), (0.0, -0.05))
        foot = view.feet["left"]
        feet = view.feet | {"left": FootState(position=foot.position, yaw=0.0, force=left)}
        return Observation(
            time=time, feet=feet, cog=view.cog, cog_velocity=view.cog_velocity, zmp=view.zmp,
            angular_momentum=view.angular_momentum, configuration=view.configuration, velocity=view.velocity,
        )  # fmt: skip

    def steps(first: int, beyond: int, left: float) -> int:
        return [count.see(count.standing(at(0.002 * i, left), targets)) for i in range(first, beyond)][-1]

    assert steps(0, 50, 20.0) == 0
    assert steps(50, 58, 0.0) == 0  # 16 ms
    assert steps(58, 100, 20.0) == 0
    assert steps(100, 150, 0.0) == 1
    assert steps(150, 200, 20.0) == 1
    assert steps(200, 250, 0.0) == 2
