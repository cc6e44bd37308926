"""Films are real: every mark is where its point is in the picture, and a film that fails leaves nothing."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest

from models.arena import build_arena
from models.errors import InputError
from sim.record.palette import COG, DCM, PUSH, SEEN, SUPPORT, ZMP, rgb
from sim.viz.video import render_episode
from tests.sim.renderer import needs_renderer
from tests.sim.still_traces import ROBOT, during, scenario, still_trace

WIDTH, HEIGHT = 640, 480
# Light, antialiasing and the halved colour resolution of H.264 change a mark by up to about this much a channel;
# the colours of the palette are farther than twice that from each other and from robot and floor.
COLOUR = 60


def film(trace: Any, folder: Path, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
    """Render and read back: (frames, height, width, 3) and what ffmpeg says of the file."""
    path = folder / "film.mp4"
    render_episode(trace, path, **options)
    reader = imageio_ffmpeg.read_frames(str(path))
    facts = next(reader)
    width, height = facts["size"]
    return np.array([np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader]), facts


def pixel(point: Any, camera: str = "three_quarter", aim: Any = (0.0, 0.0, 0.0)) -> tuple[int, int]:
    """Row and column where a point of the world is in a picture, by the camera's own numbers."""
    model = build_arena(ROBOT.path).compile()
    eye = model.camera(camera)
    turn = model.cam_mat0[eye.id].reshape(3, 3)
    x, y, z = turn.T @ (np.asarray(point) - eye.pos - aim)
    focus = HEIGHT / 2 / math.tan(math.radians(float(eye.fovy[0])) / 2)
    return round(HEIGHT / 2 - focus * y / -z), round(WIDTH / 2 + focus * x / -z)


def shows(frame: np.ndarray, place: tuple[int, int], colour: str) -> bool:
    """Whether a pixel within 2 of `place` has about this colour."""
    row, column = place
    near = frame[row - 2 : row + 3, column - 2 : column + 3].astype(int)
    return bool((np.abs(near - rgb(colour)).max(axis=-1) < COLOUR).any())


@needs_renderer
def test_marks_are_drawn_where_they_are(tmp_path: Path) -> None:
    run = scenario(duration=0.3, pushes=[{"start": 0.1, "duration": 0.1, "direction": 90, "impulse": 3.0}])
    force = during(run, 0.1, 0.2, 30.0)
    trace = still_trace(
        run,
        zmp_x=0.02,
        zmp_y=-0.02,
        zmp_cmd_x=0.1,
        zmp_cmd_y=-0.1,
        cog_vx=0.15 * ROBOT.omega,
        push_fy=force,
        push_z=0.35,
    )
    frames, facts = film(trace, tmp_path, fps=20)
    assert len(frames) == 6  # 0.298 s
    assert facts["fps"] == 20
    before, pushed = frames[1], frames[3]
    assert shows(before, pixel([0, 0, ROBOT.cog_height]), COG)
    row, column = pixel([0, 0, ROBOT.cog_height / 2])
    plumb = before[row, column - 1 : column + 2].astype(int)  # two pixels wide: H.264 mixes their colour with the grey
    assert (plumb[:, 2] - plumb[:, 0]).max() > COLOUR
    assert shows(before, pixel([0.02, -0.02, 0]), ZMP)
    assert shows(before, pixel([0.1 + 0.014, -0.1, 0]), ZMP)  # the ring of the command
    assert np.ptp(before[pixel([0.1, -0.1, 0])]) < COLOUR  # and its hollow middle, grey like the floor
    assert shows(before, pixel([0.15, 0, 0]), DCM)
    corner = ROBOT.sole_vertices["right"].min(axis=0) + ROBOT.sole_stance["right"][:2]
    assert shows(before, pixel([*corner, 0]), SUPPORT)
    length = 0.4 * 30.0 / (ROBOT.mass * ROBOT.gravity)
    for along in (0.1, 0.5, 0.85):
        assert shows(pushed, pixel([0, -along * length, 0.35]), PUSH)
        assert not shows(before, pixel([0, -along * length, 0.35]), PUSH)
    assert not shows(pushed, pixel([0, -1.15 * length, 0.35]), PUSH)
    assert not shows(pushed, pixel([0, 0.15 * length, 0.35]), PUSH)


@needs_renderer
def test_the_arrow_fades_after_the_push(tmp_path: Path) -> None:
    run = scenario(duration=0.7, pushes=[{"start": 0.0, "duration": 0.1, "direction": 90, "impulse": 3.0}])
    frames, _ = film(still_trace(run, push_fy=during(run, 0.0, 0.1, 30.0), push_z=0.35), tmp_path, fps=10)
    row, column = pixel([0, -0.1, 0.35])
    red, green, blue = np.moveaxis(frames[:, row, column].astype(int), -1, 0)
    purple = (red + blue) / 2 - green  # 126 in the palette, about 0 in a grey
    # 0.3 s of fading: less at 0.2 s, less again at 0.3 s, gone from 0.4 s on
    assert purple[0] > 80
    assert purple[0] > purple[2] > purple[3] > purple[5] + 10
    assert purple[5] == purple[6] < 12


@needs_renderer
def test_support_is_what_carries_weight(tmp_path: Path) -> None:
    run = scenario(duration=0.2)
    lifted = during(run, 0.1, 0.2, 1.0) < 0.5
    force = np.where(lifted, ROBOT.mass * ROBOT.gravity / 2, 0.0)
    frames, _ = film(still_trace(run, right_force=force), tmp_path, fps=20)
    left, right = ([ROBOT.sole_stance[side][0] + 0.03, ROBOT.sole_stance[side][1], 0.0] for side in ("left", "right"))
    # green over a sole of another colour is a mixture: it only has to change when the foot no longer carries
    change = [np.abs(frames[0][pixel(p)].astype(int) - frames[3][pixel(p)]).max() for p in (left, right)]
    assert change[0] < 12  # the noise of the encoder
    assert change[1] > 30


@needs_renderer
def test_words_tell_who_is_in_charge(tmp_path: Path) -> None:
    run = scenario(duration=0.2)
    tracker = during(run, 0.1, 0.2, 1.0)
    frames, _ = film(still_trace(run, phase=tracker, steps=tracker, tracking_slack=0.004), tmp_path, fps=20)
    red, green_part, blue = np.moveaxis(frames[:, :80, :200].astype(int), -1, 0)
    # greener than the words' greys are after encoding; the pill of the tracker is by 109
    green = (green_part - np.maximum(red, blue) > COLOUR).sum(axis=(1, 2))
    assert green[0] == 0
    assert green[3] > 500


def coloured(frame: np.ndarray, colour: str) -> int:
    """How many pixels have about this colour."""
    return int((np.abs(frame.astype(int) - rgb(colour)).max(axis=-1) < 30).sum())


@needs_renderer
def test_a_fall_has_a_banner_and_is_held(tmp_path: Path) -> None:
    run = scenario(duration=0.2)
    fallen = still_trace(run, other_contact=during(run, 0.1, 0.2, 1.0))
    frames, _ = film(fallen, tmp_path, fps=20)
    red = [coloured(frame[HEIGHT * 2 // 3 :], "#c02020") for frame in frames]
    assert len(frames) == 4 + 20  # 0.198 s, and the last frame for a second
    assert max(red[:2]) < 100  # the mark of the ZMP
    assert min(red[2:]) > 500
    assert len(film(fallen, tmp_path, fps=20, span=(0.0, 0.1))[0]) == 3  # it goes on after that
    assert len(film(still_trace(run), tmp_path, fps=20)[0]) == 4


@needs_renderer
def test_the_words_of_a_push_stay_half_a_second(tmp_path: Path) -> None:
    run = scenario(duration=1.5, pushes=[{"start": 0.3, "duration": 0.1, "direction": 90, "impulse": 1.0}])
    frames, _ = film(still_trace(run), tmp_path, fps=10)
    shown = [coloured(frame[HEIGHT * 2 // 3 :], PUSH) > 500 for frame in frames]
    assert [i for i, words in enumerate(shown) if words] == list(range(3, 10))  # from 0.3 s to 0.9 s


@needs_renderer
def test_the_controller_is_named_at_the_foot(tmp_path: Path) -> None:
    one, other = (
        film(still_trace(scenario(duration=0.01, controller=name)), tmp_path)[0][0].astype(int)
        for name in ("supervisor", "statue")
    )
    differs = np.abs(one - other).max(axis=-1) > COLOUR
    rows = np.flatnonzero(differs.any(axis=1))
    assert rows.size
    assert rows.min() > HEIGHT * 0.9


@needs_renderer
def test_a_small_push_is_an_arrow_that_can_be_seen(tmp_path: Path) -> None:
    run = scenario(duration=0.2, pushes=[{"start": 0.0, "duration": 0.1, "direction": 90, "impulse": 0.01}])
    frames, _ = film(still_trace(run, push_fy=during(run, 0.0, 0.1, 0.1), push_z=0.35), tmp_path, fps=20)
    assert shows(frames[0], pixel([0, -0.12, 0.35]), PUSH)


def test_from_above_the_robot_fills_a_fifth_of_the_picture() -> None:
    left, right = (pixel([0.0, y, ROBOT.cog_height], "top") for y in (0.12, -0.12))
    assert math.dist(left, right) > WIDTH / 5


@needs_renderer
def test_what_the_controllers_see_is_a_ghost_where_they_see_it(tmp_path: Path) -> None:
    run = scenario(duration=0.1)
    off = 0.06  # far more than any estimator, so that it stands beside the true COG
    trace = still_trace(run, seen_cog_y=off, dcm_error_y=off)
    (frame, *_), _ = film(trace, tmp_path, fps=10)
    (plain, *_), _ = film(still_trace(run), tmp_path, fps=10)
    place = pixel([0.0, off, ROBOT.cog_height])
    # a translucent ball: the robot behind it takes on some of the ball's colour
    changed = frame[place].astype(int) - plain[place].astype(int)
    assert changed[0] < -20
    assert changed[0] < changed[1] - 10
    assert coloured(frame, SEEN) > coloured(plain, SEEN) + 20
    # One that is seen where it is keeps its colour: the ghost is a ring about it, as far as the picture goes.
    (right, *_), _ = film(still_trace(run, dcm_error_x=0.0), tmp_path, fps=10)
    assert coloured(right, COG) == pytest.approx(coloured(plain, COG), rel=0.1)  # H.264 moves a mark's edge
    assert coloured(plain, COG) > 50


@needs_renderer
def test_the_camera_follows_the_robot(tmp_path: Path) -> None:
    run = scenario(duration=0.05)
    here, _ = film(still_trace(run), tmp_path, fps=20, camera="side")
    there = still_trace(run, cog_x=1.0, root_x=ROBOT.stand[0] + 1.0, left_x=1.0, right_x=1.0, zmp_x=1.0, zmp_cmd_x=1.0)
    moved, _ = film(there, tmp_path, fps=20, camera="side")
    # 1 m is a whole number of the floor's 0.1 m lines; edges may differ by the rounding of single precision.
    assert (np.abs(here[0].astype(int) - moved[0]).max(axis=-1) > COLOUR).mean() < 2e-3


@needs_renderer
def test_a_pendulum_is_a_ball_on_a_rod_over_soles(tmp_path: Path) -> None:
    run = scenario(duration=0.05, world="pendulum")
    frames, _ = film(still_trace(run, zmp_x=0.03, right_force=0.0, right_z=0.03), tmp_path, fps=20)
    frame = frames[0].astype(int)
    ball = frame[pixel([0, 0, ROBOT.cog_height + 0.025])]
    floor = frame[pixel([0.35, 0.25, 0])]
    rod = frame[pixel([0.015, 0, ROBOT.cog_height / 2])]
    sole = frame[pixel([*ROBOT.sole_stance["right"][:2], 0.041])]
    assert shows(frame, pixel([0, 0, ROBOT.cog_height]), COG)
    assert np.abs(ball - floor).max() > 8
    assert np.abs(rod - floor).max() > 30
    assert sole[2] - sole[0] > 20  # bluish, the floor is grey
    assert abs(floor[2] - floor[0]) < 12


@needs_renderer
@pytest.mark.parametrize(("fps", "slow", "frames"), [(30, 1.0, 8), (30, 2.0, 15), (60, 0.5, 8)])
def test_frames_follow_from_time_fps_and_slow(tmp_path: Path, fps: int, slow: float, frames: int) -> None:
    seen: list[float] = []
    trace = still_trace(scenario(duration=0.25))
    images, facts = film(trace, tmp_path, size=(160, 240), fps=fps, slow=slow, progress=seen.append)
    assert images.shape == (frames, 240, 160, 3)  # one for every 1 / (fps slow) from 0 to 0.248 s
    assert facts["fps"] == fps
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@needs_renderer
def test_a_film_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    path.write_bytes(b"older film")

    def stop(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_episode(still_trace(scenario(duration=0.1)), path, size=(160, 160), progress=stop)
    assert path.read_bytes() == b"older film"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"camera": "rear"}, "three_quarter, side, front, top"),
        ({"size": (641, 480)}, "even"),
        ({"size": (64, 480)}, "from 160 to 3840"),
        ({"fps": 0.0}, "from 1 to 240"),
        ({"fps": math.nan}, "from 1 to 240"),
        ({"slow": -1.0}, "from 0.01"),
    ],
)
def test_bad_options_are_refused_in_one_line(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        render_episode(still_trace(scenario(duration=0.1)), tmp_path / "film.mp4", **options)
    assert "\n" not in str(refusal.value)
    assert not list(tmp_path.iterdir())


def test_without_egl_a_sentence_names_the_packages(tmp_path: Path) -> None:
    # GLVND reads its drivers from here: with none, EGL is there but cannot open a display.
    blind = os.environ | {"__EGL_VENDOR_LIBRARY_FILENAMES": str(tmp_path / "none.json")}
    code = "from sim.viz.video import missing_renderer; print(missing_renderer())"
    done = subprocess.run([sys.executable, "-c", code], env=blind, capture_output=True, text=True, check=True)
    assert "libegl1" in done.stdout
    assert "libgl1-mesa-dri" in done.stdout
    assert done.stdout.count("\n") == 1
    assert "Exception ignored" not in done.stderr
