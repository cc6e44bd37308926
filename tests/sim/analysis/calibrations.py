"""Pushes that are recovered by known laws, and such laws."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from sim.analysis.calibration import Calibration, Model
from tests.sim.analysis.sweep_tables import row

HASH = "a" * 64
TUNING: dict[str, Any] = {"seed": 1000, "robots": {"utmu2": HASH}}
LEVEL, SLOPE, UPRIGHT = 0.5, 0.8, 0.3


def pushed(
    stepping: float | None, standing: float | None, *, well: bool, number: int = 0, **parameters: Any
) -> dict[str, Any]:
    """An episode that ends a push with these slacks [m]."""
    one = row(lambda _: well, delta_v=0.1 + 1e-4 * number, **parameters)
    one |= {"tracking_slack_end": stepping, "regulator_slack_end": standing}
    one |= {"in_tracking_set_end": stepping is not None and stepping >= 0.0}
    return one | {"in_regulator_set_end": standing is not None and standing >= 0.0}


def drawn(count: int, seed: int, **parameters: Any) -> list[dict[str, Any]]:
    """Pushes that are recovered by a known law; every other one ends with a foot in the air."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        stepping, standing = rng.uniform(-6.0, 6.0), rng.uniform(-4.0, 4.0)
        known = number % 2 == 0
        odds = LEVEL + SLOPE * stepping + (UPRIGHT * standing if known else 0.0)
        well = bool(rng.random() < 1.0 / (1.0 + math.exp(-odds)))
        rows.append(pushed(0.01 * stepping, 0.01 * standing if known else None, well=well, number=number, **parameters))
    return rows


def simple(level: float = 0.0, slope: float = 1.0, **changes: Any) -> Model:
    """A law by the slack of steps alone."""
    made = Model(
        robot="utmu2",
        robot_hash=HASH,
        world="humanoid",
        controller="supervisor",
        source=None,
        senses="exact",
        terms=("stepping",),
        coefficients=(level, slope),
        covariance=((0.0, 0.0), (0.0, 0.0)),
        episodes=10,
        recovered=5,
        ridge=0.0,
    )
    return replace(made, **changes)


def of(*models: Model, suite_hash: str = "e" * 16) -> Calibration:
    return Calibration(
        suite="tuning", suite_hash=suite_hash, seed=1000, anyway=False, commit="0" * 40, models=tuple(models)
    )


def odds(p: float) -> float:
    """The slack of steps [m] to which `simple` gives a probability."""
    return 0.01 * math.log(p / (1.0 - p))
