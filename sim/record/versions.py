"""Which versions of everything made a result: MuJoCo promises the same numbers only within one version."""

from __future__ import annotations

import functools
import json
import platform
import subprocess
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

_LIBRARIES = ("okiagari", "mujoco", "dm_control", "placo", "numpy", "scipy", "numba", "daqp")


def versions(brought: Iterable[str] = ()) -> dict[str, str]:
    """Version of Python, Okiagari and the libraries that a result depends on; "unknown" if not installed.

    Each is looked up once in a process, which imports a library once.

    Args:
        brought: libraries that only its controller depends on.
    """
    return {"python": platform.python_version()} | {name: _version(name) for name in (*_LIBRARIES, *brought)}


@functools.lru_cache
def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "unknown"


@functools.lru_cache(maxsize=1)
def commit() -> str:
    """The commit that runs: from git in a checkout, else from the record of `pip install git+...`, else "unknown".

    It is looked up once in a process, whose code is that of its start.
    """
    root = Path(__file__).resolve().parents[2]
    # An installed copy may lie inside a checkout of something else: only the house's own .git counts.
    if (root / ".git").exists():
        command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            return "unknown"
    try:
        record = metadata.distribution("okiagari").read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        return "unknown"
    return str(json.loads(record or "{}").get("vcs_info", {}).get("commit_id", "unknown"))
