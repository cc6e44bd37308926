"""Names and seeds of a suite's episodes, each from the suite's seed and the episode's own parameters alone."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from sim.sweep.pushes import canonical

# Parameters that there have not always been, and what they are where they are not said.
_UNSAID = {"sensing": "exact", "body_error": 0.0}


def episode_name(suite_seed: int, parameters: Mapping[str, Any]) -> str:
    """Short hash of the suite's seed and some parameters."""
    return hashlib.sha256(canonical([suite_seed, _as_first_called(parameters)])).hexdigest()[:12]


def episode_seed(suite_seed: int, parameters: Mapping[str, Any]) -> int:
    """Seed that depends on the suite's seed and some parameters, below 2^32."""
    digest = hashlib.sha256(canonical([suite_seed, "seed", _as_first_called(parameters)])).digest()
    return int.from_bytes(digest[:4])


def _as_first_called(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters by their first names, so that episodes that there have always been keep their names and seeds."""
    return {
        "delay" if name == "latency" else name: value
        for name, value in parameters.items()
        if name not in _UNSAID or value != _UNSAID[name]
    }
