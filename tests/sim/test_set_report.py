"""`okiagari sets` and `okiagari figures`: what they say is what the sets do."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from controllers.footholds import StepLimits
from controllers.limits import capturability
from controllers.pendulum import Pendulum
from models.robot import load_robot
from scenarios.library import load
from scenarios.schema import Scenario
from sim.cli import main
from sim.set_figures_walk import standing_feet
from sim.set_report import DIRECTIONS, set_report, step_limit
from sim.set_report_print import print_report


@pytest.fixture(scope="module")
def report() -> dict:
    return set_report(load("three_pushes"))


def test_certificates_hold(report: dict) -> None:
    assert report["regulator"]["holds"]
    assert report["tracking"]["holds"]
    assert report["tracking"]["phases"] > 100


def test_third_push_needs_a_step(report: dict) -> None:
    slacks = [push["regulator_slack"] for push in report["pushes"]]
    assert slacks[0] > slacks[1] > 0.0 > slacks[2]
    assert report["pushes"][2]["tracking_slack"] >= 0.0
    assert "front edge" in report["pushes"][2]["explanation"]
    assert report["tracking"]["plan"] == report["pushes"][2]["plan"]


def test_a_dcm_gain_reaches_one_over_k_of_the_no_step_limit(report: dict) -> None:
    robot = load_robot("utmu2")
    for facts in report["directions"]:
        # The middle of the feet is the centre of the box, so the law is exact but for rounding.
        assert facts["regulator_ratio"] == pytest.approx(1.0 / 1.5, rel=1e-9)
    edge = robot.sole_vertices["left"][:, 0].max()
    # The soles of the model lie within a nanometre of the origin.
    assert report["directions"][0]["no_step_limit"] == pytest.approx(robot.omega * edge, rel=1e-6)


def test_nothing_exceeds_its_limit(report: dict) -> None:
    assert [facts["direction_deg"] for facts in report["directions"]] == list(DIRECTIONS)
    for facts in report["directions"]:
        assert facts["regulator_delta_v"] < facts["no_step_limit"] <= facts["stepping_limit"]
        # A margin of the planner's tolerance: the forward limit is reached to a thousandth.
        assert facts["regulator_delta_v"] <= facts["stepping_delta_v"] <= facts["stepping_limit"] * (1.0 + 1e-3)


def test_a_robot_that_is_the_same_on_both_sides_is_reported_so(report: dict) -> None:
    by_angle = {facts["direction_deg"]: facts["stepping_delta_v"] for facts in report["directions"]}
    for left, right in ((45, 315), (90, 270), (135, 225)):
        # Found by halving a step of the grid of speeds ten times.
        assert by_angle[left] == pytest.approx(by_angle[right], abs=1e-3)


def test_step_limit_is_koolens_where_both_feet_step_alike() -> None:
    pendulum, feet = Pendulum(6.0, 0.005), standing_feet(load_robot("utmu2"))
    limits = StepLimits(max_stride=0.1, min_width=0.08, max_width=0.2, stance_width=0.084, swing_speed=2.0)
    centre = 0.5 * (feet["left"].position + feet["right"].position)
    reach = feet["left"].sole[:, 0].max() + feet["left"].position[0] - centre[0]
    for steps in range(4):
        forward = step_limit(pendulum, feet, limits, centre, 0.0, 0.3, steps)
        koolen = pendulum.omega * capturability(pendulum, reach, 0.1, 0.3, steps)
        assert forward == pytest.approx(koolen, rel=1e-9)


def test_stepping_sideways_does_not_cross_the_legs() -> None:
    """The left foot bounds a push to the left: only the right one could step, and it may not go beyond."""
    pendulum, feet = Pendulum(6.0, 0.005), standing_feet(load_robot("utmu2"))
    limits = StepLimits(max_stride=0.1, min_width=0.08, max_width=0.2, stance_width=0.084, swing_speed=2.0)
    none, three = (step_limit(pendulum, feet, limits, np.zeros(2), math.pi / 2, 0.4, steps) for steps in (0, 3))
    assert three == pytest.approx(none, rel=1e-9)


def test_an_lqr_gain_has_a_bounded_set_with_areas() -> None:
    quiet = load("quiet")
    given = quiet.as_dict() | {"gain": {"kind": "lqr", "q": [1.0, 1.0], "r": 1.0}, "timing": {"control": 0.005}}
    report = set_report(Scenario.model_validate(given))
    area = next(area for area in report["regulator"]["areas"] if area["plane"] == "x-xd")
    assert report["regulator"]["bounded"]
    # The feet side by side do not couple the axes; the corners are found in two ways.
    assert area["slice"] == pytest.approx(area["projection"], rel=1e-6)
    assert report["pushes"] == []
    assert "tracking" not in report


def test_tables_say_what_the_report_says(report: dict) -> None:
    console = Console(file=io.StringIO(), width=200)
    print_report(report, console)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    for facts in report["directions"]:
        assert f"{facts['stepping_delta_v']:.3f}" in text
    for push in report["pushes"]:
        assert f"{1e3 * push['regulator_slack']:+.1f} mm" in text
    assert "holds" in text
    assert "fails" not in text


def test_json_is_json(capsys: pytest.CaptureFixture[str], report: dict) -> None:
    assert main(["sets", "three_pushes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(report, allow_nan=False))


def test_figures_refuse_a_file_as_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "taken"
    taken.write_text("")
    assert main(["figures", "--out", str(taken)]) == 2
    assert "not a folder" in capsys.readouterr().err
    assert taken.read_text() == ""


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(["sets", "three_pushs"], "three_pushes"), (["figures", "--robot", "utmu"], "utmu2"), (["sets"], "SCENARIO")],
)
def test_bad_input_is_one_line(arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    message = capsys.readouterr().err
    assert complaint.lower() in message.lower()
    assert message.count("\n") == 1
