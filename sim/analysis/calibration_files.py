"""Calibrations in small files, and which of them fit a sweep."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from models.errors import InputError, one_line
from sim.analysis.calibration import Calibration, Model

_KIND, _VERSION = "okiagari calibration", 3
_SHIPPED = Path(__file__).resolve().parents[2] / "baselines"


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
