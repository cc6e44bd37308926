"""What the equation of motion of the whole body is made of, read from pinocchio at the measured state."""

from __future__ import annotations

import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.whole_body.placo_model import in_placo_order
from models.arena import SIDES
from models.robot import TRUNK, Robot

Array = NDArray[np.float64]


class BodyTerms:
    """Mass matrix, bias forces and Jacobian; all are views of pinocchio's memory, renewed by `read`.

    Attributes:
        q, qd: (7 + n,) and (6 + n,) state in pinocchio's order.
        mass: (6 + n, 6 + n) mass matrix [kg, kg m, kg m^2]; only its upper triangle is written.
        bias: (6 + n,) forces without acceleration: gravity, Coriolis and centrifugal [N, N m].
        jacobian: (6, 6 + n) spatial velocity of each joint, linear above angular, at the world's origin.
        ankles: rotation (3, 3) and position (3,) [m] of the last joint of the left and of the right leg.
        soles: (2, 12) of the left and of the right sole in that joint's frame: rotation by rows, position [m].
        chains: (2, joints of a leg) velocities from the trunk to the ankle, as indices into `qd`.
    """

    def __init__(self, robot: Robot, model: pinocchio.Model) -> None:
        """Find where the soles hang.

        Args:
            robot: the body.
            model: of it, as placo read it.
        """
        self._model, self._data = model, model.createData()
        data = self._data
        self.q, self.qd = pinocchio.neutral(model), np.zeros(model.nv)
        self.mass, self.bias, self.jacobian = data.M, data.nle, data.J
        frames = [model.frames[model.getFrameId(f"{side}_sole")] for side in SIDES]
        places = [data.oMi[frame.parentJoint] for frame in frames]
        self._places = places  # the views below live as long as these
        self.ankles = tuple((place.rotation, place.translation) for place in places)
        self.soles = np.array([[*f.placement.rotation.ravel(), *f.placement.translation] for f in frames])
        first = [[model.idx_vs[joint] for joint in model.supports[f.parentJoint] if joint > 1] for f in frames]
        self.chains = np.array(first, dtype=np.int64)

    @staticmethod
    def fit(model: pinocchio.Model) -> bool:
        """Whether a model is of the kind that is read here: the trunk floats, and its legs have as many joints."""
        trunk = model.frames[model.getFrameId(TRUNK)]
        ankles = [model.frames[model.getFrameId(f"{side}_sole")].parentJoint for side in SIDES]
        alike = len({len(model.supports[ankle]) for ankle in ankles}) == 1
        return alike and trunk.parentJoint == 1 and np.array_equal(trunk.placement.rotation, np.eye(3))

    def read(self, configuration: Array, velocity: Array) -> None:
        """Renew all terms at a configuration and velocity in MuJoCo's order (see `Observation`)."""
        in_placo_order(configuration, velocity, self.q, self.qd)
        # in the world's convention it leaves the Jacobian and the joints' places behind, too
        pinocchio.crba(self._model, self._data, self.q, pinocchio.Convention.WORLD)
        pinocchio.nonLinearEffects(self._model, self._data, self.q, self.qd)
