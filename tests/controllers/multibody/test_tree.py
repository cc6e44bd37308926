"""Kinematics and momentum of trees of bodies against pinocchio's."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from controllers.multibody.tree import MOTION, hang, momentum
from controllers.whole_body.measured_body import bodies_of
from controllers.whole_body.placo_model import in_placo_order
from models.arena import SIDES
from models.robot import TRUNK

# Both sum a dozen terms of the order of ten, in different orders.
ROUNDING = 1e-11
LINKS = 9


def any_tree(seed: int) -> pinocchio.Model:
    """A floating trunk, and links that hang on any of those before them, by hinges about any axis."""
    rng, model = np.random.default_rng(seed), pinocchio.Model()
    trunk = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "trunk")
    model.appendBodyToJoint(trunk, pinocchio.Inertia.Random(), pinocchio.SE3.Identity())
    for i in range(LINKS):
        axis = rng.normal(size=3)
        hinge = pinocchio.JointModelRevoluteUnaligned(axis / np.linalg.norm(axis))
        on = int(rng.integers(1, model.njoints))
        joint = model.addJoint(on, hinge, pinocchio.SE3.Random(), f"joint_{i}")
        model.appendBodyToJoint(joint, pinocchio.Inertia.Random(), pinocchio.SE3.Identity())
    add_frame(model, TRUNK, 1, pinocchio.SE3.Identity())
    for side, joint in zip(SIDES, (LINKS, LINKS + 1), strict=True):
        add_frame(model, f"{side}_sole", joint, pinocchio.SE3.Random())
    return model


def add_frame(model: pinocchio.Model, name: str, joint: int, place: pinocchio.SE3) -> None:
    model.addFrame(pinocchio.Frame(name, joint, 0, place, pinocchio.FrameType.OP_FRAME))


@pytest.mark.parametrize("seed", range(6))
def test_any_tree_moves_as_in_pinocchio(seed: int) -> None:
    pinocchio.seed(seed)
    model = any_tree(seed)
    rng, data = np.random.default_rng(seed), model.createData()
    configuration, velocity = rng.normal(size=model.nq), rng.normal(size=model.nv)
    configuration[3:7] /= np.linalg.norm(configuration[3:7])
    bodies, soles = bodies_of(model)
    motions, found, moved = np.zeros(len(bodies), MOTION), np.zeros((3, 3)), np.zeros(2, MOTION)
    hang(bodies, soles, configuration, velocity, motions, moved)
    momentum(bodies, motions, found)

    q, qd = pinocchio.neutral(model), np.zeros(model.nv)
    in_placo_order(configuration, velocity, q, qd)
    true = pinocchio.computeCentroidalMomentum(model, data, q, qd)
    mass = sum(inertia.mass for inertia in model.inertias)
    expected = [data.com[0], true.linear / mass, true.angular]
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING)
    for side, sole in zip(SIDES, moved, strict=True):
        frame = model.getFrameId(f"{side}_sole")
        place = pinocchio.updateFramePlacement(model, data, frame)
        twist = pinocchio.getFrameVelocity(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(sole["R"], place.rotation, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(sole["p"], place.translation, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(sole["w"], twist.angular, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(sole["v"], twist.linear, rtol=0, atol=ROUNDING)


def test_a_slider_is_refused() -> None:
    model = any_tree(0)
    model.addJoint(1, pinocchio.JointModelPX(), pinocchio.SE3.Identity(), "slider")
    with pytest.raises(ValueError, match="every other joint must be a hinge"):
        bodies_of(model)
