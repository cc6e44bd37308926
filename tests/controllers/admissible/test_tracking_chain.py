from __future__ import annotations

import numpy as np
import pytest

from controllers.admissible.moa import regulator_set
from controllers.admissible.recursion import backward
from controllers.admissible.robust import ZmpError
from controllers.admissible.tracking_chain import along_normals
from controllers.gains import Gain, dcm
from controllers.geometry.linear_program import LinearProgram
from controllers.reference.reference import Reference
from tests.controllers.stances import GAINS, PENDULUM, STANCES, walk

WALK = walk()


def standing(m: int = 60) -> Reference:
    """A reference that stays where it is, on a support without coupled axes."""
    box = STANCES["box"]
    rest = PENDULUM.rest(box.centre)
    return Reference(
        pendulum=PENDULUM, xi=np.tile(rest, (m + 1, 1)), mu=np.tile(box.centre, (m, 1)), supports=(box,),
        support_of=np.zeros(m, dtype=int), final=box,
    )  # fmt: skip


@pytest.mark.parametrize("gain", ["lqr", "lqr complex", "double pole"])
def test_same_sets_as_the_backward_recursion_by_rows_of_it(gain: str) -> None:
    law = GAINS[gain]
    terminal = regulator_set(PENDULUM, law, WALK.final, WALK.xi[-1, 0::2] + [0.003, -0.002])
    found = along_normals(PENDULUM, law, WALK, terminal)
    assert found is not None
    S, a, start, sample, edge = found
    S_, a_, start_, sample_, edge_ = backward(PENDULUM, law, WALK, terminal)
    for k in (0, 15, 99, 155, 260, 400):
        here, there = slice(start[k], start[k + 1]), slice(start_[k], start_[k + 1])
        rows = {key: i for i, key in enumerate(zip(sample[here].tolist(), edge[here].tolist(), strict=True))}
        missing = []
        for i, key in enumerate(zip(sample_[there].tolist(), edge_[there].tolist(), strict=True), start=start_[k]):
            if key in rows:
                row = start[k] + rows[key]
                np.testing.assert_allclose(S[row], S_[i], atol=1e-11)
                assert a[row] == pytest.approx(a_[i], abs=1e-11)
            else:
                missing.append(i)
        # What only the recursion keeps follows from what was kept here.
        program = LinearProgram(S[here], a[here])
        for i in missing:
            assert S_[i] @ program.maximise(S_[i]) <= a_[i] + 1e-9


@pytest.mark.parametrize("gain", ["lqr", "lqr complex", "double pole"])
def test_every_phase_is_minimal_where_the_axes_are_not_coupled(gain: str) -> None:
    reference, law = standing(), GAINS[gain]
    terminal = regulator_set(PENDULUM, law, reference.final)
    found = along_normals(PENDULUM, law, reference, terminal)
    assert found is not None
    # Standing, the tracking sets are all the regulator's set.
    np.testing.assert_array_equal(np.diff(found[2]), len(terminal.a))
    ahead = found[3] - np.repeat(np.arange(61), len(terminal.a))
    assert ahead.min() == 0
    assert ahead.max() == terminal.t_star


def test_where_it_does_not_apply_the_recursion_is_left_to_do_it() -> None:
    law = GAINS["lqr complex"]
    end = WALK.xi[-1, 0::2]
    plain = regulator_set(PENDULUM, law, WALK.final, end)
    assert along_normals(PENDULUM, law, WALK, plain) is not None
    F = law.F.copy()
    F[0, 0] += 0.01
    others = [
        (GAINS["lqr"], plain),
        (Gain(F=F, name="uneven"), plain),
        (law, regulator_set(PENDULUM, law, WALK.final, end, bounds=(0.1, 0.6))),
        (law, regulator_set(PENDULUM, law, WALK.final, end, error=ZmpError.box(0.001))),
        (law, regulator_set(PENDULUM, dcm(PENDULUM, 1.5), WALK.final, end)),
    ]
    for gain, terminal in others:
        assert along_normals(PENDULUM, gain, WALK, terminal) is None
    # A reference right on an edge leaves a right side of zero, of which the argument above does not hold.
    touching = standing()
    mu = np.tile(touching.mu[0], (60, 1))
    box = STANCES["box"]
    shifted = Reference(
        pendulum=PENDULUM, xi=touching.xi, mu=mu, support_of=touching.support_of, final=box,
        supports=(type(box)(box.vertices - [box.vertices[:, 0].max() - box.centre[0], 0.0]),),
    )  # fmt: skip
    assert along_normals(PENDULUM, law, shifted, regulator_set(PENDULUM, law, box)) is None
