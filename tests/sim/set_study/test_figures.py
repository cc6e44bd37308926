"""The set figures: what they draw is what the paper's text says of Fig. 4 to 7, and the numbers are written down."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from controllers.geometry.support_polygon import standing_feet, support_polygon
from controllers.interface import Phase
from models.arena import SIDES
from models.robot import load_robot
from sim.set_study.figures import NUMBERS, PICTURES, draw_set_figures
from sim.set_study.walk import PLANES, Walk, feet_course, plan_walk


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("figures")
    draw_set_figures(path, load_robot("utmu2"))
    return path


@pytest.fixture(scope="module")
def numbers(folder: Path) -> dict:
    return json.loads((folder / NUMBERS).read_text())


@pytest.fixture(scope="module")
def walk() -> Walk:
    return plan_walk(load_robot("utmu2"))


def areas(numbers: dict, figure: str, kind: str) -> list[float]:
    return [s["area"] for s in numbers["sets"] if s["figure"] == figure and s["kind"] == kind]


def middle(walk: Walk, k: int, plane: str) -> float:
    """Middle of the DCM over the set of phase k, seen in a plane [m]."""
    vertices = walk.sets.polytope(k).project(PLANES[plane])
    dcm = vertices[:, 0] + vertices[:, 1] / walk.pendulum.omega
    return float(0.5 * (dcm.min() + dcm.max()))


def test_every_picture_is_there_and_not_blank(folder: Path) -> None:
    for name in PICTURES:
        pixels = imread(folder / name)[..., :3]
        assert pixels.shape[0] >= 600
        assert pixels.shape[1] >= 1000
        # Axes and words alone cover about one in twenty.
        assert np.mean(pixels.min(axis=2) < 0.97) > 0.06


def test_numbers_tell_everything_behind_a_set(numbers: dict) -> None:
    assert {s["figure"] for s in numbers["sets"]} == {"2", "5a", "5b", "6"}
    for facts in numbers["sets"]:
        assert facts["kind"] in ("slice", "projection")
        assert facts["rows"] > 0
        assert facts["t_star"] >= 0
        assert facts["volume" if facts["figure"] == "2" else "area"] > 0.0
    assert {"regulator_set", "tracking_sets", "reference"} <= set(numbers["timings_ms"])
    assert all(value > 0.0 for value in numbers["timings_ms"].values())
    assert numbers["versions"]["numpy"] == np.__version__


def test_n_step_sets_grow_with_each_step(numbers: dict) -> None:
    """Not from one to two: a set of two steps need not hold that of one."""
    for left in {facts["time_left"] for facts in numbers["step_sets"]}:
        area = {facts["steps"]: facts["area"] for facts in numbers["step_sets"] if facts["time_left"] == left}
        assert len(area) >= 4
        assert np.all(np.diff([area[n] for n in sorted(area) if n > 1]) > 0.0)


def test_x_sets_are_larger_where_the_support_is_longer(numbers: dict) -> None:
    """Of Fig. 5(a): "the support polygon at t = 0.5 s, 1.0 s, 1.5 s is larger than t = 0 s, 2.0 s"."""
    start, *between, end = areas(numbers, "5a", "projection")
    assert min(between) > 1.5 * max(start, end)


def test_x_sets_shift_forward(walk: Walk) -> None:
    """Of Fig. 5(a): "shifts in +x direction as the robot walks forward"."""
    forward = [middle(walk, k, "x-xdot") for k in (0, 100, 200, 300, 400)]
    assert all(np.diff(forward) > 0.01)


def test_last_y_set_is_the_largest(numbers: dict) -> None:
    """Of Fig. 5(b): "the MOA set at t = 2.0 s is larger than other four"."""
    *earlier, last = areas(numbers, "5b", "projection")
    assert last > 1.5 * max(earlier)


def test_y_sets_roll_to_the_standing_side(walk: Walk) -> None:
    """Of Fig. 5(b): "shifts in y direction as the robot rolls to left and right", at steps of alternating sides."""
    after_right, after_left, after_right_again = (middle(walk, k, "y-ydot") for k in (100, 200, 300))
    assert after_right < -0.01
    assert after_left > 0.01
    assert after_right_again < -0.01


def test_slices_lie_within_projections(numbers: dict) -> None:
    for figure in ("5a", "5b"):
        for cut, shadow in zip(areas(numbers, figure, "slice"), areas(numbers, figure, "projection"), strict=True):
            # Equal where the axes do not couple, up to the rounding of two ways to find the corners.
            assert cut <= shadow * (1.0 + 1e-6)


def test_third_push_is_answered_by_the_step(numbers: dict) -> None:
    assert [push["in_regulator_set"] for push in numbers["pushes"]] == [True, True, False]
    assert numbers["pushes"][2]["in_tracking_set"]
    assert np.all(np.diff([push["delta_v"] for push in numbers["pushes"]]) > 0.0)
    assert numbers["outcome"] == "recovered"


def test_step_keeps_the_zmp_within_its_supports() -> None:
    from sim.set_study.push import run_pushes

    _, result = run_pushes(load_robot("utmu2"))
    # The pendulum clamps the ZMP: inside its sets the command is never clamped, but for the last bits of a double.
    for axis in "xy":
        assert np.abs(result.trace[f"zmp_{axis}"][1:] - result.trace[f"zmp_cmd_{axis}"][:-1]).max() < 1e-9
    tracked = result.trace["phase"] == Phase.STEPPING.value
    assert result.trace["time"][tracked][0] == pytest.approx(9.005)  # the tick after the third push
    assert tracked.sum() == 200  # two steps of 0.5 s
    assert result.outcome.steps_taken == 2


def test_feet_of_the_walk_span_its_supports(walk: Walk) -> None:
    course = feet_course(walk)
    for k in range(walk.reference.m):
        down = [walk.feet[side].moved(course.position[side][k, :2]) for side in SIDES if course.down[side][k]]
        vertices = support_polygon(down).vertices
        # Placed by the planner through sums of strides, by us through the corners of the hulls.
        assert np.abs(np.sort(vertices, axis=0) - np.sort(walk.reference.support(k).vertices, axis=0)).max() < 1e-9


def test_walk_starts_at_the_stand() -> None:
    robot = load_robot("utmu2")
    feet = standing_feet(robot)
    assert np.allclose(feet["left"].position, robot.sole_stance["left"][:2], rtol=0.0, atol=0.0)
