"""The episode as a Gymnasium environment: its own checks, seeds, rewards, and the record behind it."""

from __future__ import annotations

import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is missing: pip install 'okiagari[gym]'")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import sim.envs  # noqa: E402
from models.errors import InputError, OkiagariError  # noqa: E402
from scenarios.catalogue import load  # noqa: E402
from sim.record.outcome import Result  # noqa: E402
from tests.sim.renderer import needs_renderer  # noqa: E402

HOUSE = Path(__file__).resolve().parents[3]
NAME = "Okiagari/PushRecovery-v0"
PUSH = {"start": 0.2, "direction": 0.0, "delta_v": 0.1}


def made(**given: Any) -> Any:
    return gymnasium.make(NAME, **given).unwrapped


@pytest.mark.parametrize("action", ["joints", "torque", "zmp"])
def test_it_passes_gymnasium_s_own_checks(action: str) -> None:
    assert sim.envs.__all__
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        # Observations are of any size, as those of most robots are.
        warnings.filterwarnings("ignore", message=".*(minimum|maximum) value is -?infinity.*")
        check_env(made(action=action), skip_render_check=True)


def test_four_side_by_side() -> None:
    many = gymnasium.make_vec(NAME, num_envs=4, vectorization_mode="sync", action="joints")
    first, _ = many.reset(seed=3)
    assert len({tuple(row) for row in first["configuration"].round(9)}) == 4
    for _ in range(3):
        seen, reward, *_ = many.step(many.action_space.sample())
    assert reward.shape == (4,)
    assert all(np.isfinite(values).all() for values in seen.values())
    many.close()


def test_the_same_seed_gives_the_same_bits_and_another_does_not() -> None:
    env = made(action="joints")

    def run(seed: int) -> np.ndarray:
        rng = np.random.default_rng(0)
        env.reset(seed=seed)
        return np.array([env.step(rng.uniform(-0.1, 0.1, env.action_space.shape))[0]["velocity"] for _ in range(5)])

    assert np.array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def standing(env: Any) -> np.ndarray:
    low, high = env.robot.joint_range.T
    share: np.ndarray = 2.0 * (env.robot.stand[7:] - low) / (high - low) - 1.0
    return share


def test_a_stand_recovers_is_rewarded_and_recorded() -> None:
    scenario = load("quiet", {"duration": 3.0})
    env = made(scenario=scenario, reward={"effort": 0.5, "recovered": 7.0})
    _, info = env.reset(options={"pushes": [PUSH]})
    assert info == {}
    rewards, over = [], False
    while not over:
        _, reward, fell, over, info = env.step(standing(env))
        assert not fell
        rewards.append(reward)
    assert len(rewards) == 150
    assert all(0.5 < reward < 1.0 for reward in rewards[:-1])
    assert rewards[-1] > 7.5
    assert info["outcome"] == "recovered"
    result = env.episode.result()
    assert result.outcome.result is Result.RECOVERED
    (push,) = result.pushes
    assert push.delivered_impulse == pytest.approx(push.asked_impulse, abs=1e-9)
    assert len(result.trace) == scenario.ticks


def test_a_limp_robot_falls_and_that_ends_it() -> None:
    env = made(action="torque", scenario=load("quiet", {"duration": 3.0}))
    env.reset()
    fell = over = False
    while not (fell or over):
        seen, reward, fell, over, info = env.step(np.zeros(env.action_space.shape))
        assert all(np.isfinite(values).all() for values in seen.values())
    assert fell
    assert reward == 0.0
    assert info["outcome"] == "fell"


def test_the_zmp_is_moved_within_the_feet() -> None:
    env = made(action="zmp")
    env.reset()
    for _ in range(5):
        seen, *_ = env.step(np.array([0.2, 0.0]))
    assert 0.0 < seen["zmp"][0] - seen["left_foot"][0] < 0.03


@needs_renderer
def test_a_picture_shows_it() -> None:
    env = made(render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 10.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"action": "wish"}, "none of 'joints', 'torque', 'zmp'"),
        ({"frame_skip": 0}, "frame_skip: 0"),
        ({"reward": {"style": 1.0}}, "'style' is no term"),
        ({"scenario": load("quiet", {"world": "pendulum"})}, "allowed: 'humanoid'"),
    ],
)
def test_what_is_not_allowed_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(OkiagariError, match=words):
        made(**given)


def test_bad_actions_and_options_are_refused() -> None:
    env = made()
    env.reset()
    with pytest.raises(OkiagariError, match="finite"):
        env.step(np.full(env.action_space.shape, np.nan))
    with pytest.raises(OkiagariError, match="'weather' is not allowed"):
        env.reset(options={"weather": "fine"})
    with pytest.raises(InputError, match=r"pushes\[0\]\.direction"):
        env.reset(options={"pushes": [{"start": 0.2, "delta_v": 0.1}]})


def test_the_example_prints_what_its_page_says() -> None:
    example = HOUSE / "docs" / "gymnasium_policies.py"
    assert len([line for line in example.read_text().splitlines() if line.strip()]) <= 32
    done = subprocess.run([sys.executable, str(example)], cwd=HOUSE, capture_output=True, text=True, check=True)
    assert f"```\n{done.stdout}```" in (HOUSE / "docs" / "environments.md").read_text(encoding="utf-8")
