"""How likely a push is recovered from, by the slacks at its end: fitted to a sweep, and asked.

The logarithm of the odds is linear in the slack of steps and in that of standing [cm]. A slack that could not be asked,
as that of standing is while a foot is in the air, counts as 0, the rim of its set. More slack cannot make recovery less
likely: a slack that a few odd pushes make it seem so of says nothing, and is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import expit

from models.errors import InputError
from sim.analysis.frame import crashed, each_push, groups, is_finished, load_rows, recovered, reference_rows
from sim.analysis.statistics import fit_logistic, is_parted
from sim.results.table import read_sweep

Array = NDArray[np.float64]

TUNING_SEED = 1000
"""Seeds from this on are free to tune on."""
RIDGE = 0.1
"""Weight of the squared slopes [1/cm] where the slacks part the outcomes and there is no largest likelihood: as if each
slope were normal with a standard deviation of 3.2 per cm."""

FARTHEST = 20.0
"""Slacks beyond this [cm], among them that of no step within reach, say no more than it does."""

EXACT = "exact"
"""What `senses` calls the true state, of a body without errors."""

_WHO = ("robot", "world", "controller")
_SEEN = ("sensing", "latency", "noise_position", "noise_velocity", "body_error")
_TERMS = {"stepping": "tracking", "standing": "regulator"}
_CENTIMETRES = 100.0
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Model:
    """The law of a controller on a robot.

    Attributes:
        robot: its name.
        robot_hash: of its files.
        world: humanoid or pendulum.
        controller: its name.
        source: hash of the controller's file; None for one that is built in.
        senses: what the controllers saw in the pushes that it was fitted to, in the words of `senses`.
        terms: the slacks that it goes by, "stepping" or "standing".
        coefficients: of 1 and of each term [1/cm], in logarithms of odds.
        covariance: of the coefficients, as rows.
        episodes: pushes that it was fitted to.
        recovered: how many of them were.
        ridge: `RIDGE` if it was needed, else 0.
    """

    robot: str
    robot_hash: str
    world: str
    controller: str
    source: str | None
    senses: str
    terms: tuple[str, ...]
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    episodes: int
    recovered: int
    ridge: float

    def __post_init__(self) -> None:
        """Check that the numbers fit each other; raises `ValueError`."""
        named = (self.robot, self.robot_hash, self.world, self.controller, self.senses, self.source or "", *self.terms)
        counted = (self.episodes, self.recovered, self.ridge)
        if not all(isinstance(one, str) for one in named) or not all(isinstance(one, int | float) for one in counted):
            raise ValueError("a name is no text, or a count no number")
        size = 1 + len(self.terms)
        numbers = np.array([self.coefficients, *self.covariance], dtype=np.float64)
        if not self.terms or set(self.terms) - set(_TERMS) or numbers.shape != (1 + size, size):
            raise ValueError("terms, coefficients and covariance do not fit each other")
        if not np.isfinite(numbers).all() or np.linalg.eigvalsh(numbers[1:]).min() < -_ROUNDING:
            raise ValueError("coefficients or covariance are impossible")

    def design(self, frame: pd.DataFrame) -> Array:
        """What the coefficients multiply, (n, 1 + terms); rows of NaN where none of the slacks is known."""
        slacks = _slacks(frame)[[*self.terms]].to_numpy(float)
        rows = np.column_stack([np.ones(len(slacks)), np.nan_to_num(slacks)])
        rows[np.isnan(slacks).all(axis=1)] = np.nan
        return rows

    @property
    def who(self) -> tuple[str, str, str]:
        """Robot, world and controller."""
        return self.robot, self.world, self.controller

    def probability(self, design: Array) -> Array:
        """Of recovery, (n,), for rows of `design`."""
        return np.asarray(expit(design @ np.array(self.coefficients)), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What was fitted to a sweep.

    Attributes:
        suite: its name.
        suite_hash: of all that the suite says.
        seed: the suite's.
        anyway: whether the suite was one that is not for tuning.
        commit: of Okiagari when the sweep began.
        models: one for each robot, world, controller and what it saw.
    """

    suite: str
    suite_hash: str
    seed: int
    anyway: bool
    commit: str
    models: tuple[Model, ...]

    def __post_init__(self) -> None:
        """Check the names; raises `ValueError`."""
        if not all(isinstance(one, str) for one in (self.suite, self.suite_hash, self.commit)):
            raise ValueError("suite, suite_hash or commit is no text")


def calibrate(folder: Path, *, anyway: bool = False) -> Calibration:
    """Fit a sweep's recoveries by their slacks.

    Args:
        folder: of the sweep.
        anyway: whether it may be one that is not for tuning.

    Raises:
        InputError: if it is not finished or not for tuning, or no controller has both outcomes and a slack that speaks
            for recovery.
    """
    rows, sweep = load_rows(folder), read_sweep(folder)
    if not is_finished(rows, sweep):
        raise InputError(f"{str(folder)!r}: the sweep is not finished; repeat the command that began it to go on")
    why = _not_for_tuning(sweep)
    if why and not anyway:
        raise InputError(
            f"{str(folder)!r}: its suite {sweep['name']!r} {why}; calibrate by a suite of a seed from {TUNING_SEED} on "
            "that is not held out, or pass --anyway"
        )
    pushes = reference_rows(each_push(rows), sweep).copy()
    pushes["senses"] = senses(pushes)
    keys = [*_WHO, "senses"]
    found = [_fit(dict(zip(keys, values, strict=True)), members, sweep) for values, members in groups(pushes, keys)]
    models = tuple(model for model in found if model is not None)
    if not models:
        raise InputError(
            f"{str(folder)!r}: no controller was both recovered and lost, the more often the less slack; nothing to fit"
        )
    return Calibration(
        suite=str(sweep["name"]),
        suite_hash=str(sweep["suite_hash"]),
        seed=int(sweep["seed"]),
        anyway=bool(why),
        commit=str(sweep.get("commit")),
        models=models,
    )


def probabilities(frame: pd.DataFrame, calibrations: Iterable[Calibration]) -> pd.Series:
    """Of recovery, by the slacks at the end of the push; NaN for rows that no model speaks of, and for whole trains.

    Args:
        frame: of a sweep.
        calibrations: that fit it.
    """
    told = pd.Series(math.nan, frame.index)
    models = [model for one in calibrations for model in one.models]
    for model, own in zip(models, spoken_of(frame, models), strict=True):
        told[own] = model.probability(model.design(frame[own]))
    return told


def spoken_of(frame: pd.DataFrame, models: Sequence[Model]) -> list[pd.Series]:
    """Which rows (n,) each model speaks of, but for those that crashed.

    They are of its robot, world and controller, and were seen as the pushes that it was fitted to. What was seen as
    none of these models' pushes were is left to that of the exact state, or else to the first, for want of a better.
    """
    seen, whole = senses(frame), ~crashed(frame)
    mine = [
        (frame["robot"] == model.robot) & (frame["world"] == model.world) & (frame["controller"] == model.controller)
        for model in models
    ]
    found = []
    for model, own in zip(models, mine, strict=True):
        kin = [one for one in models if one.who == model.who]
        rows = seen == model.senses
        if model is next((one for one in kin if one.senses == EXACT), kin[0]):
            rows |= ~seen.isin([one.senses for one in kin])
        found.append(own & rows & whole)
    return found


def senses(frame: pd.DataFrame) -> pd.Series:
    """What the controllers saw in each row (n,) and of what body, in words: "typical, 4 ms late, body errors x 1".

    Estimators, drives and figures of sensors that replace the preset's are not told apart.
    """
    return frame[[*_SEEN, "dcm_error_rms"]].apply(_in_words, axis=1).astype(str) if len(frame) else pd.Series(dtype=str)


def _in_words(row: pd.Series) -> str:
    noise = f"{1e3 * row['noise_position']:g} mm", f"{1e2 * row['noise_velocity']:g} cm/s"
    late = [f"{1e3 * row['latency']:g} ms late"] if row["latency"] > 0.0 else []
    late += [f"{noise[0]} of noise"] if row["noise_position"] > 0.0 else []
    late += [f"{noise[1]} of noise"] if row["noise_velocity"] > 0.0 else []
    # Sensors without errors have no preset's name, and an estimator all the same.
    estimated = row["sensing"] == EXACT and not late and row["dcm_error_rms"] >= 0.0
    errors = [f"body errors x {row['body_error']:g}"] if row["body_error"] > 0.0 else []
    return ", ".join(["estimated" if estimated else str(row["sensing"]), *late, *errors])


def _not_for_tuning(sweep: Mapping[str, Any]) -> str:
    """Why a sweep may not be fitted to; empty if it may."""
    seed = sweep.get("seed") or 0
    if "held out" in (sweep.get("tuned_on") or ""):
        return "is held out"
    return f"has the seed {seed}" if seed < TUNING_SEED else ""


def _slacks(frame: pd.DataFrame) -> pd.DataFrame:
    """The slacks at the end of each push [cm], columns as `_TERMS`; NaN where a set could not be asked."""
    found = pd.DataFrame({term: frame[f"{rule}_slack_end"].astype(float) for term, rule in _TERMS.items()})
    # In a train no step within reach is null, and told by the membership alone.
    out_of_reach = found["stepping"].isna() & frame["in_tracking_set_end"].notna()
    found["stepping"] = found["stepping"].mask(out_of_reach, -math.inf)
    return (found * _CENTIMETRES).clip(-FARTHEST, FARTHEST)


def _fit(who: Mapping[str, Any], frame: pd.DataFrame, sweep: Mapping[str, Any]) -> Model | None:
    """The model of the pushes of a robot, world, controller and what it saw; None if they teach nothing."""
    slacks = _slacks(frame)[~crashed(frame)].dropna(how="all")
    well = recovered(frame)[slacks.index].to_numpy(float)
    terms = tuple(name for name in _TERMS if slacks[name].fillna(0.0).nunique() > 1)
    while terms and len(set(well)) > 1:
        design = np.column_stack([np.ones(len(slacks)), slacks[[*terms]].fillna(0.0)])
        ridge = RIDGE if is_parted(design, well) else 0.0
        coefficients, covariance = fit_logistic(design, well, ridge)
        slopes = coefficients[1:]
        if slopes.min() >= 0.0:
            return Model(
                robot=who["robot"],
                robot_hash=str((sweep.get("robots") or {}).get(who["robot"])),
                world=who["world"],
                controller=who["controller"],
                senses=who["senses"],
                source=((sweep.get("controllers") or {}).get(who["controller"]) or {}).get("source"),
                terms=terms,
                coefficients=tuple(coefficients.tolist()),
                covariance=tuple(map(tuple, covariance.tolist())),
                episodes=len(well),
                recovered=int(well.sum()),
                ridge=ridge,
            )
        terms = tuple(name for name, slope in zip(terms, slopes, strict=True) if slope > slopes.min())
    return None
