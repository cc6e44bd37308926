"""What an estimator tells of now: the COG alone, or the whole body where references would be late."""

from __future__ import annotations

from pathlib import Path

from controllers.estimation.ekf import InvariantEkf
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_estimator
from sim.episode.episode import run_episode
from tests.sim.episode.test_senses import omega_d

ROBOT = load_robot("utmu2")
AT_JOINTS = """
class Brain:
    period = 0.02
    def __init__(self, robot, pendulum, dt, options):
        pass
    def targets(self, observation):
        raise AssertionError
"""


def test_the_state_of_joints_and_feet_is_told_of_now_only_if_references_would_be_late(tmp_path: Path) -> None:
    worn = {"preset": "typical", "latency": 0.004}
    file = tmp_path / "brain.py"
    file.write_text(AT_JOINTS)
    own = f"{file}:Brain"
    for fields, whole in (
        ({"sensing": worn}, False),
        ({"sensing": worn | {"servo": "state"}}, True),
        ({"sensing": worn | {"estimator": {"name": "ekf", "predicted": "body"}}}, True),
        ({"sensing": worn, "controller": own}, True),
    ):
        estimator = make_estimator(load("quiet", fields), ROBOT)
        assert isinstance(estimator, InvariantEkf)
        assert estimator._whole is whole, fields


def test_side_pushes_are_survived_by_the_cog_of_now_and_lost_by_the_whole_body_of_now() -> None:
    for predicted, survives in (("cog", True), ("body", False)):
        sensing = {"preset": "typical", "latency": 0.004, "estimator": {"name": "ekf", "predicted": predicted}}
        for direction in (96.0, 260.0, 280.0):
            push = {"start": 0.3, "direction": direction, "delta_v": 2.1 * omega_d(direction)}
            asked = {"seed": 1000, "sensing": sensing, "body": {"scale": 1.0}, "pushes": [push], "duration": 4.0}
            result = run_episode(load("quiet", asked), polygons=False)
            assert (result.outcome.time_of_fall is None) is survives, (predicted, direction)
