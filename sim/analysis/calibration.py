"""How likely a push is recovered from, by the slacks at its end: fitted to a sweep, kept in a small file, and asked.

The logarithm of the odds is linear in the slack of steps and in that of standing [cm]. A slack that could not be asked,
as that of standing is while a foot is in the air, counts as 0, the rim of its set. More slack cannot make recovery less
likely: a slack that a few odd pushes make it seem so of says nothing, and is left out.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import expit

from models.errors import InputError, one_line
from sim.analysis.frame import crashed, each_push, groups, is_finished, load_rows, recovered, reference_rows
from sim.analysis.statistics import fit_logistic, is_parted
from sim.results.table import read_sweep

Array = NDArray[np.float64]

TUNING_SEED = 1000
"""Seeds from this on are free to tune on."""
RIDGE = 0.1
"""Weight of the squared slopes [1/cm] where the slacks part the outcomes and there is no largest likelihood: as if each
slope were normal with a standard deviation of 3.2 per cm."""

_KIND, _VERSION = "okiagari calibration", 1
_SHIPPED = Path(__file__).resolve().parents[2] / "baselines"
_TERMS = {"stepping": "tracking", "standing": "regulator"}
# Slacks beyond this [cm], among them that of no step within reach, say no more than it does.
_LIMIT = 20.0
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
    terms: tuple[str, ...]
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    episodes: int
    recovered: int
    ridge: float

    def __post_init__(self) -> None:
        """Check that the numbers fit each other; raises `ValueError`."""
        named = (self.robot, self.robot_hash, self.world, self.controller, self.source or "", *self.terms)
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

    def probability(self, design: Array) -> Array:
        """Of recovery, (n,), for rows of `design`."""
        return np.asarray(expit(design @ np.array(self.coefficients)), dtype=np.float64)

    def is_of(self, frame: pd.DataFrame) -> pd.Series:
        """Which rows (n,) it speaks of."""
        return (
            (frame["robot"] == self.robot)
            & (frame["world"] == self.world)
            & (frame["controller"] == self.controller)
            & ~crashed(frame)
        )


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What was fitted to a sweep.

    Attributes:
        suite: its name.
        suite_hash: of all that the suite says.
        seed: the suite's.
        anyway: whether the suite was one that is not for tuning.
        commit: of Okiagari when the sweep began.
        models: one for each robot, world and controller.
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
    pushes = reference_rows(each_push(rows), sweep)
    keys = ["robot", "world", "controller"]
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


def as_text(calibration: Calibration) -> str:
    """The file; the same calibration makes the same bytes."""
    content = {"kind": _KIND, "version": _VERSION, **asdict(calibration)}
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def read_calibration(path: Path) -> Calibration:
    """Read a file of `as_text`; raises `InputError` if it is missing or damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or (content.pop("kind", None), content.pop("version", None)) != (_KIND, _VERSION):
        raise InputError(f"{path}: not a calibration of this version of Okiagari; make one with 'okiagari calibrate'")
    try:
        models = tuple(
            Model(**one | {"terms": tuple(one["terms"]), "covariance": tuple(map(tuple, one["covariance"]))})
            for one in content.pop("models")
        )
        return Calibration(**content, models=models)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: damaged calibration: {one_line(error)}; make it anew with 'okiagari calibrate'"
        ) from None


def calibrations_for(sweep: Mapping[str, Any], path: Path | None = None) -> list[Calibration]:
    """The calibrations that fit a sweep's robots and controllers, each with those of its models that do.

    Args:
        sweep: what `sweep.json` says of it.
        path: of a calibration; None for those of the checkout.

    Raises:
        InputError: if the file cannot be read, or none of its models fits.
    """
    paths = sorted(_SHIPPED.glob("calibration-*.json")) if path is None else [path]
    fitting = []
    for one in map(read_calibration, paths):
        reasons = [_stranger(model, sweep) for model in one.models]
        models = tuple(model for model, why in zip(one.models, reasons, strict=True) if not why)
        if models:
            fitting.append(replace(one, models=models))
        elif path is not None:
            raise InputError(
                f"{path}: {reasons[0] if reasons else 'holds no model'}; make one of this robot and "
                "controller with 'okiagari calibrate'"
            )
    return fitting


def probabilities(frame: pd.DataFrame, calibrations: Iterable[Calibration]) -> pd.Series:
    """Of recovery, by the slacks at the end of the push; NaN for rows that no model speaks of, and for whole trains.

    Args:
        frame: of a sweep.
        calibrations: that fit it.
    """
    told = pd.Series(math.nan, frame.index)
    for model in (model for one in calibrations for model in one.models):
        own = model.is_of(frame)
        told[own] = model.probability(model.design(frame[own]))
    return told


def _stranger(model: Model, sweep: Mapping[str, Any]) -> str:
    """Why a model says nothing of a sweep; empty if it does."""
    robots, controllers = sweep.get("robots") or {}, sweep.get("controllers") or {}
    if model.robot not in robots:
        return f"is of the robot {model.robot!r}, the sweep of {', '.join(robots) or 'none that it names'}"
    if robots[model.robot] != model.robot_hash:
        return (
            f"is of the robot {model.robot!r} with the hash {model.robot_hash[:12]}, the sweep's has "
            f"{robots[model.robot][:12]}"
        )
    if model.controller not in controllers:
        return f"is of the controller {model.controller!r}, the sweep of {', '.join(controllers)}"
    source = controllers[model.controller].get("source")
    if source != model.source:
        then, now = (f"the hash {one[:12]}" if one else "no file" for one in (model.source, source))
        return f"is of the controller {model.controller!r} with {then}, the sweep's has {now}"
    return ""


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
    return (found * _CENTIMETRES).clip(-_LIMIT, _LIMIT)


def _fit(who: Mapping[str, Any], frame: pd.DataFrame, sweep: Mapping[str, Any]) -> Model | None:
    """The model of a robot's and controller's pushes; None if they teach nothing."""
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
