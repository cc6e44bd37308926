from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.footholds import StepLimits
from controllers.gait import plan_steps
from controllers.gait_program import PlanningError
from controllers.parametric_slice import admissible_slice
from controllers.pendulum import Pendulum
from controllers.polytope import polygon_area
from controllers.support import Foot
from models.robot import Side

OMEGA = math.sqrt(9.81 / 0.26)
PENDULUM = Pendulum(OMEGA, 0.002)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
BLUNT = np.array([[0.06, 0.0], [0.03, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.03, -0.036]])
LIMITS = StepLimits(max_stride=0.16, min_width=0.075, max_width=0.2, stance_width=0.084, swing_speed=2.0)
SEQUENCES: list[tuple[Side, ...]] = [(), ("left",), ("right", "left"), ("left", "right", "left")]
BOX = (0.15, 2.5)
AT = np.array([0.01, 0.1, 0.005, 0.05])
# Shares of the box. The outline is this exact; the plans' own solver stops 1e-10 m of ZMP short.
ACCURACY = 1e-6


def standing(ahead: float = 0.0, turn: float = 0.0, sole: np.ndarray = SOLE) -> dict[Side, Foot]:
    return {
        "left": Foot(position=np.array([ahead, 0.042]), yaw=turn, sole=sole),
        "right": Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=sole),
    }


FEET = {"level": standing(), "staggered": standing(0.06, 0.2), "blunt": standing(0.02, -0.1, BLUNT)}


@pytest.mark.parametrize("stance", FEET)
@pytest.mark.parametrize("swing", SEQUENCES)
@pytest.mark.parametrize("axes", [(0, 1), (2, 3), (0, 3)])
def test_slice_is_where_plans_exist(stance: str, swing: tuple[Side, ...], axes: tuple[int, int]) -> None:
    feet, free, rng = FEET[stance], list(axes), np.random.default_rng(1)
    middle = PENDULUM.rest(0.5 * (feet["left"].position + feet["right"].position))[free]
    vertices = admissible_slice(PENDULUM, feet, swing, 0.25, LIMITS, axes, AT, BOX, accuracy=ACCURACY)
    assert len(vertices) >= 3
    assert polygon_area(vertices) > 0.0
    units = np.array([BOX[i % 2] for i in axes])
    inside, outside = 0, 0
    for corner, following in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        for share in (0.0, rng.uniform(0.1, 0.9)):
            border, seen = corner + share * (following - corner), vertices.mean(axis=0)
            for factor in (1.0 - 1e-5, 1.0 + 1e-4):
                x = AT.copy()
                x[free] = seen + factor * (border - seen)
                if (np.abs((x[free] - middle) / units) > 1.0).any():
                    continue  # the box ends the outline here, not the set
                slack = plan_steps(PENDULUM, x, feet, swing, 0.25, LIMITS).slack
                assert (slack >= 0.0) == (factor < 1.0), (x, factor, slack)
                inside, outside = inside + (factor < 1.0), outside + (factor > 1.0)
    assert inside > 0
    assert outside > 0


def test_slice_of_a_step_under_way_with_a_margin() -> None:
    feet, now = standing(), np.array([0.03, 0.06])
    vertices = admissible_slice(
        PENDULUM, feet, ("left",), 0.25, LIMITS, (0, 1), AT, BOX,
        swing_time_left=0.08, swing_position=now, zmp_margin=0.004, accuracy=ACCURACY,
    )  # fmt: skip
    seen = vertices.mean(axis=0)
    for border in 0.5 * (vertices + np.roll(vertices, -1, axis=0)):
        for factor in (1.0 - 1e-5, 1.0 + 1e-4):
            x = np.concatenate((seen + factor * (border - seen), AT[2:]))
            if (np.abs(x[:2] / BOX) > 1.0).any():
                continue
            plan = plan_steps(
                PENDULUM, x, feet, ("left",), 0.25, LIMITS, swing_time_left=0.08, swing_position=now, zmp_margin=0.006
            )
            assert (plan.slack >= 0.004) == (factor < 1.0)


def test_slice_is_empty_where_no_plan_exists() -> None:
    falling = np.array([0.0, 0.0, 0.0, 3.0])
    assert admissible_slice(PENDULUM, standing(), ("left",), 0.25, LIMITS, (0, 1), falling, BOX).shape == (0, 2)
    # No polygon is 4 cm inside a foot of 7.2 cm.
    wide = admissible_slice(PENDULUM, standing(), ("left",), 0.25, LIMITS, (0, 1), AT, BOX, zmp_margin=0.04)
    assert wide.shape == (0, 2)


def test_bad_arguments_are_refused() -> None:
    feet = standing()
    for arguments in (((0, 0), AT, BOX), ((0, 1), AT * np.nan, BOX), ((0, 1), AT[:3], BOX), ((0, 1), AT, (0.0, 1.0))):
        with pytest.raises(PlanningError, match="slice needs"):
            admissible_slice(PENDULUM, feet, ("left",), 0.25, LIMITS, *arguments)
    with pytest.raises(PlanningError, match="finite times"):
        admissible_slice(PENDULUM, feet, ("left",), math.nan, LIMITS, (0, 1), AT, BOX)
