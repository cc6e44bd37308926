"""Whether an edit changed behaviour: hashes of every channel of a set of episodes, recorded before and compared after.

    python -m tests.benchmarks bits              # records out/bits.json
    (edit)
    python -m tests.benchmarks bits              # compares with it; exit code 1 if a bit differs

The bits are those of one machine and its libraries, so the record is made where it is compared, and not committed.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode

RECORD = Path("out/bits.json")
_WEAK = {"start": 0.5, "direction": 100.0, "delta_v": 0.2}
_STRONG = {"start": 2.5, "direction": 0.0, "delta_v": 0.45}
_PUSHED = {"duration": 6.0, "pushes": [_WEAK, _STRONG]}
_POINT = {"start": 0.5, "direction": -60.0, "impulse": 2.0, "body": "trunk", "point": [0.0, 0.02, 0.05]}
CASES: dict[str, dict[str, Any]] = {
    f"{controller}, {world}": _PUSHED | {"controller": controller, "world": world, "seed": 3}
    for controller in ("supervisor", "paper", "regulator", "statue")
    for world in ("humanoid", "pendulum")
} | {
    "supervisor, ik": _PUSHED | {"whole_body": "ik"},
    "paper, ik": _PUSHED | {"whole_body": "ik", "controller": "paper"},
    "regulator, lqr": _PUSHED | {"controller": "regulator", "gain": {"kind": "lqr", "q": [100.0, 1.0], "r": 1.0}},
    "supervisor, poles": _PUSHED | {"world": "pendulum", "gain": {"kind": "poles", "poles": [-8.0, [-4.0, 0.0]]}},
    "polygon rule": _PUSHED | {"stepping": {"rule": "polygon"}},
    "no planning anew": _PUSHED | {"stepping": {"replan": False, "max_steps": 2, "angular_momentum": False}},
    "at a point, half a sine": {"duration": 5.0, "pushes": [_POINT | {"shape": "half_sine", "duration": 0.2}]},
    "disturbed": _PUSHED
    | {"disturbance": {"mass_scale": 1.05, "friction": 0.6}}
    | {"sensing": {"latency": 0.004, "state_noise": {"velocity": 0.003}}},
    "sensed": _PUSHED | {"sensing": {"preset": "typical", "latency": 0.004}, "body": {"scale": 1.0}},
    "felled": {"duration": 5.0, "pushes": [{"start": 0.5, "direction": 45.0, "delta_v": 1.0}]},
    "on the COG": {"duration": 5.0, "pushes": [{"start": 0.5, "direction": 180.0, "delta_v": 0.4, "body": "cog"}]},
}


def hashes(result: EpisodeResult) -> dict[str, str]:
    """Of every channel of the trace, of the decisions, the outcome and the pushes' records."""
    found = {name: _digest(np.ascontiguousarray(result.trace[name]).tobytes()) for name in result.trace.channels}
    for name in ("decisions", "outcome", "pushes"):
        found[f"({name})"] = _digest(repr(getattr(result, name)).encode())
    return found


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def main() -> None:
    """Record, or compare with the record."""
    quiet = load("quiet").as_dict()
    now = {
        name: hashes(run_episode(Scenario.model_validate(quiet | case)))
        for name, case in track(CASES.items(), description="episodes", transient=True)
    }
    if not RECORD.exists():
        RECORD.parent.mkdir(parents=True, exist_ok=True)
        RECORD.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
        print(f"recorded {len(now)} episodes in {RECORD}")
        return
    then = json.loads(RECORD.read_text(encoding="utf-8"))
    differ = {
        name: [
            channel for channel in before | now.get(name, {}) if before.get(channel) != now.get(name, {}).get(channel)
        ]
        for name, before in then.items()
    }
    for name, channels in differ.items():
        if channels:
            print(f"{name}: {', '.join(channels)}")
    changed = sum(bool(channels) for channels in differ.values())
    print(f"{len(then) - changed} of {len(then)} episodes have the same bits as in {RECORD}")
    sys.exit(1 if changed else 0)


if __name__ == "__main__":
    main()
