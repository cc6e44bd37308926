"""Pictures of pushes that overlap, and of torques: each is drawn and named for itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import EpisodeResult, run_episode
from sim.viz.captions import Caption
from sim.viz.figures import episode_figure
from sim.viz.playback import Playback
from sim.viz.video import _aims, _ticks
from tests.sim.renderer import needs_renderer
from tests.sim.still_traces import ROBOT
from tests.sim.viz.test_video import film, pixel

TWIST = {"start": 0.1, "torque": [0.0, 0.0, 4.0], "duration": 0.2}
LEFT = {"start": 0.15, "direction": 90.0, "impulse": 1.0}
WORDS = ["torque 4 N m about z on trunk, 0.80 N m s", f"1.00 N s, {1.0 / ROBOT.mass:.2f} m/s"]


def run(*pushes: dict[str, Any]) -> EpisodeResult:
    fields = {"description": "at once", "controller": "statue", "duration": 0.6, "pushes": list(pushes)}
    asked = Scenario.model_validate(fields)
    return run_episode(asked, controller=make_controller(asked, ROBOT), robot=ROBOT, polygons=False)


@pytest.fixture(scope="module")
def both() -> EpisodeResult:
    return run(TWIST, LEFT)


def test_playback_tells_them_apart(both: EpisodeResult) -> None:
    playback = Playback(both.trace)
    twist, left = playback.pushes
    assert [push.words for push in playback.pushes] == WORDS
    torque, _ = playback.acted(twist)
    force, _ = playback.acted(left)
    tick = playback.tick(0.2)
    assert torque[tick] == pytest.approx([0.0, 0.0, 4.0])
    assert force[tick] == pytest.approx([0.0, 10.0, 0.0], abs=1e-12)
    assert playback.force[tick] == pytest.approx(force[tick])


def test_figure_names_each(both: EpisodeResult) -> None:
    texts = [text.get_text() for axes in episode_figure(both).axes for text in axes.texts]
    assert f"1: {WORDS[0]}\n2: {WORDS[1]}" in texts


def test_many_at_once_are_named_by_their_numbers() -> None:
    result = run(*(LEFT | {"start": 0.1 + 0.01 * i, "impulse": 0.05} for i in range(5)))
    texts = [text.get_text() for axes in episode_figure(result).axes for text in axes.texts]
    assert "1-5" in texts


def test_caption_names_all_that_act(both: EpisodeResult) -> None:
    playback = Playback(both.trace)
    caption = Caption(playback, (640, 480))
    named = {when: caption._push_words(playback.tick(when)) for when in (0.05, 0.12, 0.2, 0.4)}
    assert named[0.05] == []
    assert named[0.12] == [f"push 1: {WORDS[0]}"]
    assert named[0.2] == named[0.4] == [f"push 2: {WORDS[1]}", f"push 1: {WORDS[0]}"]


def test_caption_of_one_that_is_over_gives_way_to_the_next() -> None:
    playback = Playback(run(LEFT | {"start": 0.1, "duration": 0.05}, LEFT).trace)
    words = Caption(playback, (640, 480))._push_words(playback.tick(0.2))
    assert [line.partition(":")[0] for line in words] == ["push 2"]


def is_purple(frame: np.ndarray, place: tuple[int, int]) -> bool:
    """Whether a pixel within 2 of `place` has the hue of a push, however bright the light from above makes it."""
    row, column = place
    red, green, blue = frame[row - 2 : row + 3, column - 2 : column + 3].reshape(-1, 3).astype(int).T
    return bool(((red - green > 60) & (blue - green > 100)).any())


@needs_renderer
def test_film_shows_the_arc_of_the_torque_and_the_arrow_of_the_force(both: EpisodeResult, tmp_path: Path) -> None:
    frames, _ = film(both.trace, tmp_path, fps=20, camera="top")
    alone, together = frames[2], frames[4]  # 0.1 s and 0.2 s
    playback = Playback(both.trace)
    tick = playback.tick(0.1)
    centre = playback.acted(playback.pushes[0])[1][tick]
    radius = 4.0 / playback.weight * 2.0
    on_the_arc = [[np.cos(a), np.sin(a), 0.0] for a in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)]
    aims = _aims(playback, list(_ticks(playback, 20.0)), 20.0)
    hit = [is_purple(alone, pixel(centre + radius * np.array(way), "top", aims[2])) for way in on_the_arc]
    # Three quarters of a circle, and its arrow.
    assert 11 <= sum(hit) <= 14
    shaft = centre - [0.0, 0.1, 0.0]
    assert not is_purple(alone, pixel(shaft, "top", aims[2]))
    assert is_purple(together, pixel(shaft, "top", aims[4]))
