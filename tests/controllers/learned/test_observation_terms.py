"""Every term of an observation against what it is by hand; scales, limits and the past."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from controllers.interface import Observation
from controllers.learned.observation_terms import ObservationVector, Terms, View
from models.errors import InputError
from tests.controllers.sight import seen

JOINTS = ("a", "b", "c")
POSE = np.array([0.1, 0.2, 0.3])


def observed(q: Any = (0.0, 0.0, 0.0), speed: Any = (0.0, 0.0, 0.0)) -> Observation:
    view = seen((0.0, 0.05), (0.0, -0.05))
    return Observation(
        time=0.0, feet=view.feet, cog=view.cog, cog_velocity=view.cog_velocity, zmp=view.zmp,
        angular_momentum=view.angular_momentum,
        configuration=np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, *q]),
        velocity=np.array([1.0, 2.0, 3.0, 0.4, 0.5, 0.6, *speed]),
    )  # fmt: skip


def viewed(rotation: Any = None, **fields: Any) -> View:
    given = {
        "observation": observed((0.5, 0.7, 0.9), (7.0, 8.0, 9.0)),
        "rotation": np.eye(3) if rotation is None else np.array(rotation, dtype=float),
        "pose": POSE,
        "command": np.array([0.3, -0.2, 0.1]),
        "action": np.array([-1.0, 1.0]),
        "phase": np.array([0.0, math.pi / 2]),
    }
    return View(**(given | fields))


def vector(*terms: Any, **layout: Any) -> ObservationVector:
    given = {"joints": JOINTS, "action": ("c", "a"), "phases": 2, "stack": "terms", "newest_first": False}
    return ObservationVector(TypeAdapter(Terms).validate_python(list(terms)), **(given | layout))


# The base is turned left by 90 deg: its x axis is the world's y, its y axis the world's -x.
LEFT = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
# The base is pitched down by 90 deg: its x axis points to the floor, its z axis ahead.
DOWN = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]


@pytest.mark.parametrize(
    ("term", "rotation", "values"),
    [
        ("base_linear_velocity", None, [1, 2, 3]),
        ("base_linear_velocity", LEFT, [2, -1, 3]),
        ("base_angular_velocity", LEFT, [0.4, 0.5, 0.6]),
        ("projected_gravity", None, [0, 0, -1]),
        ("projected_gravity", LEFT, [0, 0, -1]),
        ("projected_gravity", DOWN, [1, 0, 0]),
        ("command", LEFT, [0.3, -0.2, 0.1]),
        ("joint_position", None, [0.6, 0.4]),
        ("joint_velocity", None, [9, 7]),
        ({"name": "joint_position", "joints": ["a", "b", "c"], "zero": ["b"]}, None, [0.4, 0, 0.6]),
        ({"name": "joint_velocity", "scale": 0.5}, None, [4.5, 3.5]),
        ({"name": "command", "scale": [2, 3, 4]}, None, [0.6, -0.6, 0.4]),
        ({"name": "joint_velocity", "clip": 8}, None, [8, 7]),
        ({"name": "base_linear_velocity", "scale": 2, "clip": [3, 5]}, None, [3, 4, 5]),
        ("last_action", None, [-1, 1]),
        ("phase", None, [1, 0, 0, 1]),
        ("phase_cos", None, [1, 0]),
        ("phase_sin", None, [0, 1]),
    ],
)
def test_a_term_is_what_it_is_by_hand(term: Any, rotation: Any, values: list[float]) -> None:
    assert vector(term).see(viewed(rotation)) == pytest.approx(values, abs=1e-12)


def test_terms_stand_in_their_order_and_say_where() -> None:
    both = vector("last_action", "command")
    assert both.see(viewed()) == pytest.approx([-1, 1, 0.3, -0.2, 0.1])
    assert [term.places.tolist() for term in both.terms] == [[0, 1], [2, 3, 4]]
    assert both.terms[0].components == ("c", "a")
    assert both.sizes() == "last_action 2, command 3"


def answers(view: ObservationVector, count: int) -> np.ndarray:
    return [view.see(viewed(action=np.array([i, 10.0 * i]))) for i in range(1, count + 1)][-1]


@pytest.mark.parametrize(
    ("layout", "values"),
    [
        ({}, [2, 20, 3, 30, 3, 30]),
        ({"newest_first": True}, [3, 30, 2, 20, 3, 30]),
    ],
)
def test_the_past_of_a_term(layout: dict[str, Any], values: list[float]) -> None:
    view = vector({"name": "last_action", "history": 2}, "last_action", **layout)
    assert answers(view, 3) == pytest.approx(values)
    view.reset()
    assert answers(view, 1) == pytest.approx([1, 10, 1, 10, 1, 10])  # as if it had always been so


def test_frames_are_stacked_whole() -> None:
    terms = ({"name": "last_action", "history": 2}, {"name": "last_action", "scale": 2, "history": 2})
    frames = vector(*terms, stack="frames")
    assert answers(frames, 2) == pytest.approx([1, 10, 2, 20, 2, 20, 4, 40])
    assert frames.terms[1].places.tolist() == [2, 3, 6, 7]
    assert frames.terms[1].components == ("c (1 back)", "a (1 back)", "c", "a")
    with pytest.raises(InputError, match="all terms must have one history"):
        vector(terms[0], "command", stack="frames")


@pytest.mark.parametrize(
    ("term", "words"),
    [
        ({"name": "joint_position", "joints": ["a", "d"]}, r"observation\[0\].joints: 'd' is no joint of the robot"),
        ({"name": "joint_position", "joints": ["a", "a"]}, "names 'a' twice"),
        ({"name": "joint_position", "zero": ["b"]}, r"zero: 'b' is no joint"),
        ({"name": "command", "scale": [1, 2]}, r"scale: has 2 numbers; 'command' has 3"),
    ],
)
def test_what_does_not_fit_the_robot_is_one_line(term: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        vector(term)


@pytest.mark.parametrize(
    ("term", "words"),
    [
        ({"name": "command", "joints": ["a"]}, "'command' is not of joints"),
        ({"name": "command", "clip": [1, 1]}, "neither a number above 0 nor a list of two"),
        ({"name": "command", "scale": "2"}, "neither a number nor a list of numbers"),
        ({"name": "command", "history": 0}, "greater than or equal to 1"),
        ("comand", "Input should be"),
    ],
)
def test_what_is_no_term_is_refused(term: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        vector(term)
