"""Where a name becomes a class: ours by a short name, a package's by its entry point, a user's by file and class."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import os
import re
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from controllers.fields import Strict, file_hash
from models.errors import InputError, with_kind

_BY_PATH = re.compile(r"(?P<file>.+\.py):(?P<cls>[A-Za-z_]\w*)")


class NoOptions(Strict):
    """The options of a class that brings none."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A class that a scenario can name.

    Attributes:
        name: as it was looked up; a file by its absolute path.
        cls: the class.
        source: SHA-256 of its file, if it was named by file.
        is_shipped: whether it is one of ours.
    """

    name: str
    cls: Any
    source: str | None
    is_shipped: bool = False

    @property
    def short(self) -> str:
        """What tables, titles and folders call it."""
        return short(self.name)

    @property
    def at_joints(self) -> bool:
        """Whether it is a controller at joint level."""
        return not hasattr(self.cls, "command")

    @property
    def options(self) -> type[Strict]:
        """The model of its options."""
        found: type[Strict] = getattr(self.cls, "Options", NoOptions)
        return found

    @property
    def libraries(self) -> tuple[str, ...]:
        """The libraries that it brings, whose versions count for its results: an attribute of the class."""
        found: tuple[str, ...] = getattr(self.cls, "libraries", ())
        return found

    @property
    def appearance(self) -> dict[str, str | None]:
        """Label, colour ("#rrggbb") and marker (of matplotlib) that it brings, and its source; null if none."""
        brought = {key: getattr(self.cls, key, None) for key in ("label", "colour", "marker")}
        return brought | {"source": self.source}


@dataclass(frozen=True, kw_only=True)
class Registry:
    """All classes of one kind.

    Attributes:
        kind: what they are, for messages.
        group: the group of entry points that installed packages add theirs by.
        shipped: short name -> "module:Class" of ours.
        methods: of which every class must have one.
        required: of which every class must have all.
    """

    kind: str
    group: str
    shipped: Mapping[str, str]
    methods: tuple[str, ...]
    required: tuple[str, ...] = ()

    def names(self) -> tuple[str, ...]:
        """The short names there are."""
        return (*self.shipped, *(name for name in _installed(self.group) if name not in self.shipped))

    def absolute(self, name: str, folder: Path) -> str:
        """The same name wherever it is read: a file is relative to `folder`.

        Raises:
            InputError: if it is neither a short name nor `path/to/file.py:Class` of a file that exists.
        """
        match = _BY_PATH.fullmatch(name)
        if match is None:
            if name in self.names():
                return name
            close = get_close_matches(name, self.names(), n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise InputError(
                f"{name!r} is none of {', '.join(map(repr, self.names()))}, nor path/to/file.py:Class{hint}"
            )
        path = folder / match["file"]
        if not os.path.isfile(path):  # False, too, for a name that no system can have
            raise InputError(f"{name!r}: there is no file {os.path.abspath(path)!r}")
        return f"{path.resolve()}:{match['cls']}"

    def entry(self, name: str) -> Entry:
        """The class of a name as `absolute` gives it.

        Raises:
            InputError: if it cannot be imported, or is not of this kind.
        """
        match = _BY_PATH.fullmatch(name)
        if match is not None:
            path = Path(match["file"])
            source = file_hash(path)
            module, cls = _module_of_file(path, source), match["cls"]
            if not hasattr(module, cls):
                raise InputError(f"{short(name)!r}: {str(path)!r} has no class {cls!r}")
            return self._checked(Entry(name=name, cls=getattr(module, cls), source=source))
        if name in self.shipped:
            module_name, _, cls = self.shipped[name].partition(":")
            found = getattr(importlib.import_module(module_name), cls)
            return Entry(name=name, cls=found, source=None, is_shipped=True)
        point = _installed(self.group).get(name)
        if point is None:
            raise InputError(f"{name!r} is none of {', '.join(map(repr, self.names()))}")
        try:
            return self._checked(Entry(name=name, cls=point.load(), source=None))
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"{name!r} ({point.value}) cannot be imported: {_told(error)}") from error

    def _checked(self, entry: Entry) -> Entry:
        cls, options = entry.cls, getattr(entry.cls, "Options", NoOptions)
        if not isinstance(cls, type) or not any(callable(getattr(cls, name, None)) for name in self.methods):
            wanted = " nor ".join(f"{name}()" for name in self.methods)
            raise InputError(f"{entry.short!r} is no {self.kind}: it has no method {wanted}")
        for name in self.required:
            if not callable(getattr(cls, name, None)):
                raise InputError(f"{entry.short!r} is no {self.kind}: it has no method {name}()")
        if not (isinstance(options, type) and issubclass(options, Strict)):
            raise InputError(f"{entry.short!r}: its Options must be a subclass of controllers.fields.Strict")
        return entry


def short(name: str) -> str:
    """A name without folders: `file.py:Class`, or the short name as it is."""
    match = _BY_PATH.fullmatch(name)
    return name if match is None else f"{Path(match['file']).name}:{match['cls']}"


@functools.cache
def _installed(group: str) -> dict[str, Any]:
    return {point.name: point for point in entry_points(group=group)}


@functools.cache
def _module_of_file(path: Path, source: str) -> Any:
    """The module of a file, imported once for each content; its neighbours can be imported while it is."""
    name = f"okiagari_by_path_{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:8]}_{source[:8]}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    # Last, so that a neighbour cannot stand in for a module of ours or of a library.
    sys.path.append(str(path.parent))
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InputError(f"{str(path)!r} cannot be imported: {_told(error, path)}") from error
    finally:
        sys.path.remove(str(path.parent))
    return module


def _told(error: Exception, path: Path | None = None) -> str:
    """An error in one line, with the line of the file that it came from."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    where = f"line {lines[-1]}: " if lines else ""
    return where + with_kind(error)


CONTROLLERS = Registry(
    kind="controller",
    group="okiagari.controllers",
    methods=("command", "targets"),
    shipped={
        "supervisor": "controllers.supervisor.supervisor:Supervisor",
        "paper": "controllers.baselines.paper:PaperSupervisor",
        "regulator": "controllers.baselines.regulator_alone:RegulatorAlone",
        "statue": "controllers.baselines.statue:Statue",
        "onnx": "controllers.learned.onnx_policy:OnnxPolicy",
    },
)
LAYERS = Registry(
    kind="whole-body layer",
    group="okiagari.whole_body",
    methods=("targets",),
    required=("reset",),
    shipped={
        "dynamics": "controllers.whole_body.inverse_dynamics:DynamicsWholeBody",
        "ik": "controllers.whole_body.inverse_kinematics:IkWholeBody",
        "hold": "controllers.whole_body.held_pose:HeldPose",
    },
)
ESTIMATORS = Registry(
    kind="estimator",
    group="okiagari.estimators",
    methods=("estimate",),
    required=("reset",),
    shipped={
        "truth": "controllers.senses:Truth",
        "ekf": "controllers.estimation.ekf:InvariantEkf",
    },
)
