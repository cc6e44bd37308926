"""The compiler of what every tick does: plain floats and small arrays, in functions without objects."""

from __future__ import annotations

import hashlib
import multiprocessing
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core import event as events

P = ParamSpec("P")
R = TypeVar("R")

COMPILING = "okiagari: compiling what is used for the first time; some seconds"
"""What the first runs after an installation are told."""

_config: Any = numba.config
_HOUSE = Path(__file__).resolve().parent.parent
_ROOMS = ("controllers", "sim")
_IMPORTED = re.compile(rb"^from ((?:controllers|models|sim)[\w.]*) import", re.MULTILINE)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function at its first call, and keep the code on disk for the runs to come.

    Nothing is reordered (no `fastmath`) and nothing runs in parallel, so the same input gives the same bits; a division
    by zero gives what numpy gives. Read-only arrays are another type than writable ones: a kernel that is called with
    both is compiled twice.
    """
    # numba looks at the function's own file alone: code that calls a kernel of another file, which was edited since,
    # would go on with the old one. So all is compiled anew when a source of any kernel has changed.
    theirs, _config.CACHE_DIR = _config.CACHE_DIR, str(_FOLDER)
    try:
        made: Any = numba.njit(cache=True, error_model="numpy")(function)
    finally:
        _config.CACHE_DIR = theirs
    return made


def sources_hash(house: Path) -> str:
    """Hash of numba's version and of all files of a house with compiled functions, and of those they import from."""
    texts = {path: path.read_bytes() for room in _ROOMS for path in sorted((house / room).rglob("*.py"))}
    kernels = {path: text for path, text in texts.items() if b"\n@compiled\n" in text}
    imported = {
        house.joinpath(*name.decode().split(".")) for text in kernels.values() for name in _IMPORTED.findall(text)
    }
    beside = {path for module in imported for path in (module.with_suffix(".py"), module / "__init__.py")}
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(kernels.keys() | {path for path in beside if path.is_file()}):
        digest.update(str(path.relative_to(house)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _folder() -> Path:
    """Where the code of these sources is kept: beside them, or where numba was told to; that of former ones goes."""
    name = f"okiagari-{sources_hash(_HOUSE)}"
    if _config.CACHE_DIR:
        return Path(_config.CACHE_DIR) / name
    beside = Path(__file__).resolve().parent / "__pycache__"
    if not (beside / name).is_dir():
        for former in beside.glob("okiagari-*"):
            shutil.rmtree(former, ignore_errors=True)
    return beside / name


_FOLDER = _folder()


class _Teller(events.Listener):
    """Says once on stderr what a first run after an installation waits for."""

    told = multiprocessing.parent_process() is not None  # a worker's caller has said it, or has nothing to wait for

    def on_start(self, event: events.Event) -> None:
        """A function is not on disk yet."""
        if not self.told:
            self.told = True
            print(COMPILING, file=sys.stderr)

    def on_end(self, event: events.Event) -> None:
        """Nothing is to be said."""


events.register("numba:compile", _Teller())
