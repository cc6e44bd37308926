"""Sets of several soles, reaches and errors that the tests of the N-step sets share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from controllers.nstep.step_sets import step_sets
from tests.controllers.nstep.stepping_plane import DIAMOND, HEAVY, LIMITS, OCTAGON, PENDULUM, SLOW, SOLE

TIMES = (0.15, 0.2)
NOMINAL = step_sets(PENDULUM, 1.5, SOLE, LIMITS, TIMES, 4, edge=0.002)
ROBUST = step_sets(PENDULUM, 1.5, SOLE, LIMITS, TIMES, 4, edge=0.002, zmp_error=0.003)
SETS = {
    "rectangle": NOMINAL,
    "slow foot": step_sets(PENDULUM, 1.2, SOLE, SLOW, TIMES, 3),
    "diamond": step_sets(PENDULUM, 2.5, DIAMOND, LIMITS, TIMES, 3),
    "octagon": step_sets(PENDULUM, 1.5, OCTAGON, SLOW, TIMES, 3, edge=0.003),
    "sideways": step_sets(PENDULUM, 2.0, SOLE, replace(LIMITS, max_stride=0.0), TIMES, 3),
}
# Its questions are of feet at rest: of one that flies it knows too little to be asked anew.
LIFTING = step_sets(PENDULUM, 1.5, SOLE, HEAVY, TIMES, 3, edge=0.002)
WITHSTANDING = {
    "rectangle": ROBUST,
    "diamond": step_sets(PENDULUM, 2.5, DIAMOND, LIMITS, TIMES, 3, zmp_error=0.002),
    "octagon": step_sets(PENDULUM, 1.5, OCTAGON, SLOW, TIMES, 3, zmp_error=0.003),
}
# The solver keeps its rows to 1e-9 and the DCM grows 3.4-fold over the longest step.
SOLVER = 1e-8
SWING = {"right": np.array([0.02, 0.1]), "left": np.array([0.02, -0.1])}
