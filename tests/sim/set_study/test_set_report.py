"""`okiagari sets` and `okiagari figures`: what they say is what the sets do."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from controllers.admissible.limits import capturability_steps
from controllers.geometry.support_polygon import standing_feet
from controllers.nstep.step_limits import StepLimits
from controllers.pendulum import Pendulum
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.cli.app import main
from sim.presenter.render import print_sections
from sim.presenter.set_sections import set_sections
from sim.set_study.set_reach import reaches, step_limit
from sim.set_study.set_report import DIRECTIONS, set_report, standing


@pytest.fixture(scope="module")
def report() -> dict:
    return set_report(load("three_pushes"))


def test_certificates_hold(report: dict) -> None:
    # From the scenario's to the softest, which the steps end in.
    assert report["exact"]["regulators"][0]["gain"] == "dcm k=1.5"
    assert report["exact"]["regulators"][-1]["gain"] == f"dcm k={report['exact']['stepping']['gain_k']:g}"
    assert all(facts["holds"] for facts in report["exact"]["regulators"])
    for facts in report["exact"]["directions"]:
        assert [one["steps"] for one in facts["steps"]] == list(range(1, report["exact"]["stepping"]["max_steps"] + 1))
        # Of the states on either side of each rim; forward every number of steps adds something.
        assert all(one["certificate"]["holds"] for one in facts["steps"])


def test_third_push_needs_a_step(report: dict) -> None:
    slacks = [push["regulator_slack"] for push in report["pushes"]]
    assert slacks[0] > slacks[1] > 0.0 > slacks[2]
    third = report["pushes"][2]
    assert third["stepping_slack"] >= 0.0
    assert third["certificate"]["member"]
    assert third["certificate"]["holds"]
    assert "recovers in" in third["certificate"]["words"]
    assert "front edge" in third["explanation"]


def test_a_push_beyond_all_steps_is_certified_as_lost() -> None:
    hard = load("three_pushes").as_dict() | {"pushes": [{"start": 1.0, "direction": 0.0, "delta_v": 3.0}]}
    push = set_report(Scenario.model_validate(hard))["pushes"][0]
    assert push["stepping_slack"] < 0.0
    assert not push["certificate"]["member"]
    assert push["certificate"]["holds"]


def test_a_dcm_gain_reaches_one_over_k_of_the_no_step_limit(report: dict) -> None:
    robot = load_robot("utmu2")
    for facts in report["exact"]["directions"]:
        # The middle of the feet is the centre of the box, so the law of the softest is exact but for rounding.
        assert facts["regulator_ratio"] == pytest.approx(1.0 / report["exact"]["stepping"]["gain_k"], rel=1e-9)
    edge = robot.sole_vertices["left"][:, 0].max()
    # The soles of the model lie within a nanometre of the origin.
    assert report["exact"]["directions"][0]["no_step_limit"] == pytest.approx(robot.omega * edge, rel=1e-6)


def test_nothing_exceeds_its_limit(report: dict) -> None:
    assert [facts["direction_deg"] for facts in report["exact"]["directions"]] == list(DIRECTIONS)
    for facts in report["exact"]["directions"]:
        assert facts["regulator_delta_v"] < facts["no_step_limit"]
        reached = [facts["regulator_delta_v"], *(one["delta_v"] for one in facts["steps"])]
        assert np.all(np.diff(reached) >= 0.0)
        assert all(one["delta_v"] <= one["limit"] for one in facts["steps"])
        # One step adds much everywhere, the others only where a later one is not hemmed in by the speed of the feet.
        assert reached[1] > 1.2 * reached[0]


@pytest.mark.parametrize("degrees", [0, 60, 90, 200])
def test_the_reach_is_what_the_supervisors_own_choice_says(degrees: int) -> None:
    """Every push up to it is held by the best of the steps, and one just beyond it is not."""
    supervisor, sets = standing(load("three_pushes"), load_robot("utmu2"))
    regulator = supervisor.regulator
    assert regulator is not None
    direction = math.radians(degrees)
    reach = reaches(sets, regulator, direction)[-1]
    rest = sets.pendulum.rest(regulator.bank.centre)
    unit = np.array([0.0, math.cos(direction), 0.0, math.sin(direction)])

    def held(speed: float) -> bool:
        x = rest + speed * unit
        return regulator.slack(x) >= 0.0 or supervisor.best_step(x).slack >= 0.0

    # A micrometre of DCM at either side of the rim.
    aside = 1e-6 * sets.pendulum.omega
    assert all(held(speed) for speed in np.linspace(0.0, reach.delta_v - aside, 60))
    assert not held(reach.delta_v + aside)


def test_a_robot_that_is_the_same_on_both_sides_is_reported_so(report: dict) -> None:
    by_angle = {
        facts["direction_deg"]: [one["delta_v"] for one in facts["steps"]] for facts in report["exact"]["directions"]
    }
    for left, right in ((45, 315), (90, 270), (135, 225)):
        # The soles of the model are mirrored to within a nanometre.
        assert by_angle[left] == pytest.approx(by_angle[right], rel=1e-6)


def test_step_limit_is_koolens_where_both_feet_step_alike() -> None:
    pendulum, feet = Pendulum(6.0, 0.005), standing_feet(load_robot("utmu2"))
    limits = StepLimits(max_stride=0.1, min_width=0.08, max_width=0.2, stance_width=0.084, swing_speed=2.0)
    centre = 0.5 * (feet["left"].position + feet["right"].position)
    reach = feet["left"].sole[:, 0].max() + feet["left"].position[0] - centre[0]
    for steps in range(4):
        forward = step_limit(pendulum, feet, limits, centre, 0.0, 0.3, steps)
        koolen = pendulum.omega * capturability_steps(pendulum, reach, 0.1, 0.3, steps)[-1]
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
    area = next(area for area in report["exact"]["regulators"][0]["areas"] if area["plane"] == "x-xd")
    assert report["exact"]["regulators"][0]["bounded"]
    # The feet side by side do not couple the axes; the corners are found in two ways.
    assert area["slice"] == pytest.approx(area["projection"], rel=1e-6)
    assert report["pushes"] == []


def test_torques_are_counted_and_left_out() -> None:
    given = load("push_and_twist").as_dict() | {"stepping": {"max_steps": 1}}
    report = set_report(Scenario.model_validate(given))
    assert [push["start"] for push in report["pushes"]] == [3.1]
    console = Console(file=io.StringIO(), width=200)
    print_sections(set_sections(report), console)
    assert "1 torque is left out: a torque changes no velocity" in console.file.getvalue()  # type: ignore[attr-defined]


def test_tables_say_what_the_report_says(report: dict) -> None:
    console = Console(file=io.StringIO(), width=200)
    print_sections(set_sections(report), console)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    for facts in report["exact"]["directions"]:
        assert f"{facts['steps'][-1]['delta_v']:.3f}/{facts['steps'][-1]['limit']:.3f}" in text
    for push in report["pushes"]:
        assert f"{1e3 * push['regulator_slack']:+.1f} mm" in text
    assert "holds" in text
    assert "fails" not in text


@pytest.fixture(scope="module")
def firm() -> dict:
    """With an error of the ZMP and a delay."""
    return set_report(load("quiet"), zmp_error=0.005, delay=0.004)


def test_sets_that_withstand_an_error_hold_less_and_say_so(report: dict, firm: dict) -> None:
    robust = firm["robust"]
    assert list(robust["left_out"]) == []
    assert all(facts["holds"] for facts in robust["regulators"])
    for exact, less in zip(report["exact"]["directions"], robust["directions"], strict=True):
        assert less["regulator_delta_v"] < 0.85 * exact["regulator_delta_v"]
        for one, other in zip(exact["steps"], less["steps"], strict=True):
            assert other["delta_v"] < one["delta_v"]
            assert other["certificate"] is None or other["certificate"]["holds"]
    # The softest gain is the one whose set is the largest under the error: it reaches c - 2 w of the c without one.
    edge = load_robot("utmu2").sole_vertices["left"][:, 0].max() - 0.008
    assert robust["stepping"]["gain_k"] == pytest.approx((edge - 0.005) / (edge - 0.01), rel=0.2)


def test_a_late_zmp_costs_every_gain_some_of_its_set(firm: dict) -> None:
    late = firm["late"]
    assert [facts["gain"] for facts in late["regulators"]] == [one["gain"] for one in firm["exact"]["regulators"]]
    for facts in late["regulators"]:
        for one, exact in zip(facts["directions"], firm["exact"]["directions"], strict=True):
            assert 0.0 < one["delta_v"] < exact["regulator_delta_v"]


def test_errors_and_delays_that_cannot_be_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for option, value, words in (
        ("--delay", "0.003", "whole multiple of the control period, 0.002 s"),
        ("--delay", "-1", "-1"),
        ("--delay", "nan", "nan"),
        ("--zmp-error", "0.02", "leaves nothing of utmu2's sole"),
        ("--zmp-error", "-0.1", "-0.1"),
        ("--zmp-error", "inf", "inf"),
    ):
        assert main(["sets", "quiet", option, value]) == 2
        told = capsys.readouterr().err
        assert told.startswith("okiagari: ")
        assert option.removeprefix("--").replace("-", "") in told.replace("-", "").replace("_", "")
        assert words in told
        assert told.count("\n") == 1


@pytest.mark.parametrize("width", [80, 200])
def test_no_number_is_cut(width: int, firm: dict) -> None:
    console = Console(file=io.StringIO(), width=width)
    print_sections(set_sections(firm), console)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "…" not in text
    for facts in firm["robust"]["directions"]:
        assert f"{facts['steps'][-1]['delta_v']:.3f}/{facts['steps'][-1]['limit']:.3f}" in text


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
