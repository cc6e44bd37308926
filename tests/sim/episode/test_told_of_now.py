"""What an estimator tells of now: the balance alone, or the whole body where references would be late."""

from __future__ import annotations

from controllers.estimation.ekf import InvariantEkf
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_estimator
from sim.episode.episode import run_episode
from tests.sim.episode.test_senses import omega_d

ROBOT = load_robot("utmu2")


def test_the_estimator_knows_whether_the_drives_see_the_joints_themselves() -> None:
    worn = {"preset": "typical", "latency": 0.004}
    for sensing, at_drive in ((worn, True), (worn | {"servo": "drive"}, True), (worn | {"servo": "state"}, False)):
        made = make_estimator(load("quiet", {"sensing": sensing}), ROBOT)
        assert isinstance(made, InvariantEkf)
        assert made._at_drive is at_drive


def test_side_pushes_are_survived_by_the_balance_of_now_and_fewer_by_the_whole_body_of_now() -> None:
    survived = {"balance": 0, "body": 0}
    for predicted in survived:
        sensing = {"preset": "typical", "latency": 0.004, "estimator": {"name": "ekf", "predicted": predicted}}
        for direction in (96.0, 260.0, 280.0):
            push = {"start": 0.3, "direction": direction, "delta_v": 2.1 * omega_d(direction)}
            asked = {"seed": 1000, "sensing": sensing, "body": {"scale": 1.0}, "pushes": [push], "duration": 4.0}
            survived[predicted] += run_episode(load("quiet", asked), polygons=False).outcome.time_of_fall is None
    assert survived["balance"] == 3
    assert survived["body"] <= 1
