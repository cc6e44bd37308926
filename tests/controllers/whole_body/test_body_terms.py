"""Which bodies the terms of the equation of motion can be read of."""

from __future__ import annotations

import pinocchio
import pytest

from controllers.whole_body.body_terms import BodyTerms
from controllers.whole_body.placo_model import PlacoModel
from models.arena import SIDES
from models.robot import TRUNK, load_robot


def body(left: int, right: int, trunk: pinocchio.SE3 | None = None, waist: bool = False) -> pinocchio.Model:
    """A floating body with two legs of so many hinges; its trunk sits so on what floats, or on a waist's hinge."""
    model, here = pinocchio.Model(), pinocchio.SE3.Identity()
    hips = model.addJoint(0, pinocchio.JointModelFreeFlyer(), here, "floats")
    if waist:
        hips = model.addJoint(hips, pinocchio.JointModelRZ(), here, "waist")
    frames = [(TRUNK, hips, here if trunk is None else trunk)]
    for side, hinges in zip(SIDES, (left, right), strict=True):
        joint = hips
        for i in range(hinges):
            joint = model.addJoint(joint, pinocchio.JointModelRY(), here, f"{side}_{i}")
        frames.append((f"{side}_sole", joint, here))
    for name, joint, place in frames:
        model.addFrame(pinocchio.Frame(name, joint, 0, place, pinocchio.FrameType.OP_FRAME))
    return model


@pytest.mark.parametrize("hinges", [1, 6])
def test_legs_of_equally_many_joints_fit(hinges: int) -> None:
    assert BodyTerms.fit(body(hinges, hinges))


@pytest.mark.parametrize(("left", "right"), [(6, 5), (5, 6), (1, 2)])
def test_legs_that_are_not_alike_do_not(left: int, right: int) -> None:
    assert not BodyTerms.fit(body(left, right))


def test_a_trunk_that_is_not_what_floats_does_not() -> None:
    assert not BodyTerms.fit(body(6, 6, waist=True))
    leaning = pinocchio.SE3.Identity()
    leaning.rotation = pinocchio.rpy.rpyToMatrix(0.0, 0.1, 0.0)
    assert not BodyTerms.fit(body(6, 6, trunk=leaning))


def test_the_shipped_robot_fits() -> None:
    assert BodyTerms.fit(PlacoModel(load_robot("utmu2")).wrapper.model)
