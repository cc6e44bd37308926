"""The rules of the house: who may import whom, and that what is public is explained."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parent.parent
# The rooms, from the bottom up: each may import those above it in this list, and itself. What stands side by side in
# one line does not know each other.
LAYERS: tuple[tuple[str, ...], ...] = (
    ("models",),
    ("controllers.compiled",),
    ("controllers.pendulum", "controllers.fields", "controllers.geometry"),
    ("controllers.multibody",),
    (
        "controllers.gains",
        "controllers.registry",
        "controllers.reference",
        "controllers.interface",
        "controllers.shown",
    ),
    ("controllers.senses",),
    ("controllers.options", "controllers.admissible", "controllers.whole_body", "controllers.learned"),
    ("controllers.nstep", "controllers.estimation"),
    ("controllers.stepping",),
    ("controllers.supervisor",),
    ("controllers.baselines",),
    ("scenarios",),
    ("sim.record", "sim.sensing"),
    ("sim.episode",),
    ("sim.envs", "sim.viz", "sim.results"),
    ("sim.analysis", "sim.sweep", "sim.set_study", "sim.policy_check", "sim.viewer"),
    ("sim.identify",),
    ("sim.presenter",),
    ("sim.report",),
    ("sim.cli",),
)
# Who of a lower layer is a stranger all the same.
FEWER = {
    "controllers.whole_body": {
        "models",
        "controllers.compiled",
        "controllers.fields",
        "controllers.geometry",
        "controllers.interface",
        "controllers.multibody",
        "controllers.registry",
    },
    "scenarios": {
        "models",
        "controllers.admissible",
        "controllers.geometry",
        "controllers.fields",
        "controllers.gains",
        "controllers.options",
        "controllers.pendulum",
        "controllers.registry",
    },
}
MUST_NOT_KNOW = {
    "models": {"placo", "pinocchio"},
    "controllers": {"mujoco", "dm_control", "dm_env"},
    "scenarios": {"mujoco", "dm_control", "dm_env", "placo", "pinocchio"},
    "sim": {"placo", "pinocchio"},
}
PACKAGES = ("models", "controllers", "scenarios", "sim")
# Examples are a user's files: they come in by the public faces.
FILES = [
    path for package in PACKAGES for path in sorted((HOUSE / package).glob("**/*.py")) if path.parent.name != "examples"
]


def room_of(module: str) -> str:
    """`controllers.nstep` of `controllers.nstep.build`; `models` of all that is in it."""
    parts = module.split(".")
    return parts[0] if parts[0] in ("models", "scenarios") else ".".join(parts[:2])


def modules(tree: ast.AST) -> set[str]:
    """Modules of the house that a file imports, wherever in the file it does."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in PACKAGES:
            whole = node.module in ("controllers", "sim")
            found |= {f"{node.module}.{alias.name}" for alias in node.names} if whole else {node.module}
    return found


def imported(tree: ast.AST) -> set[str]:
    """Top-level names of all modules that a file imports, wherever in the file it does."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "the house imports by full names"
            names.add((node.module or "").partition(".")[0])
    return names


def unexplained(tree: ast.Module) -> Iterator[str]:
    """Public modules, classes, functions and methods without a docstring."""
    if ast.get_docstring(tree) is None:
        yield "module"
    waiting: list[tuple[str, ast.stmt]] = [("", node) for node in tree.body]
    while waiting:
        prefix, node = waiting.pop()
        if not isinstance(node, ast.ClassDef | ast.FunctionDef) or node.name.startswith("_"):
            continue
        if ast.get_docstring(node) is None:
            yield prefix + node.name
        if isinstance(node, ast.ClassDef):
            waiting += [(f"{prefix}{node.name}.", child) for child in node.body]


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HOUSE)))
def test_file_keeps_the_rules(path: Path) -> None:
    tree, package = parsed(path), path.relative_to(HOUSE).parts[0]
    names = imported(tree)
    forbidden = MUST_NOT_KNOW[package] | {"tests"}
    if package == "controllers" and path.parent.name != "whole_body":
        forbidden |= {"placo", "pinocchio"}
    assert not names & forbidden
    assert list(unexplained(tree)) == []


def test_rooms_import_downwards_only() -> None:
    height = {room: level for level, rooms in enumerate(LAYERS) for room in rooms}
    upward = []
    for path in FILES:
        parts = path.relative_to(HOUSE).with_suffix("").parts
        own = room_of(".".join(parts))
        if parts[-1] == "__main__" or (len(parts) == 2 and parts[1] == "__init__"):
            continue
        assert own in height, f"{own} has no place in LAYERS"
        known = FEWER.get(own, {room for room, level in height.items() if level < height[own]}) | {own}
        upward += [f"{'.'.join(parts)} -> {name}" for name in modules(parsed(path)) if room_of(name) not in known]
    assert upward == []


def test_each_room_is_neither_a_closet_nor_a_heap_and_says_what_it_is() -> None:
    rooms = [room for layer in LAYERS for room in layer if (HOUSE / room.replace(".", "/")).is_dir()]
    for room in rooms:
        folder = HOUSE / room.replace(".", "/")
        files = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
        assert (1 if room == "sim.envs" else 2) <= len(files) <= 14, room
        said = ast.get_docstring(parsed(folder / "__init__.py")) or ""
        assert len(said) > 40, f"{room}: its docstring must say what it is for"
        assert not said.startswith("The room"), room
        for path in files:
            assert len(path.read_text(encoding="utf-8").splitlines()) <= 300, path


def test_each_package_is_looked_at() -> None:
    assert {path.relative_to(HOUSE).parts[0] for path in FILES} == set(PACKAGES)


def test_the_rules_can_be_broken() -> None:
    source = "def f():\n    import mujoco.mjx\n    from sim.record.trace import Trace\nclass A:\n    def g(self): ...\n"
    tree = ast.parse(source)
    assert imported(tree) == {"mujoco", "sim"}
    assert set(unexplained(tree)) == {"module", "f", "A", "A.g"}


def test_files_import_each_other_in_no_circle() -> None:
    known = {".".join(path.relative_to(HOUSE).with_suffix("").parts): path for path in FILES}
    needs: dict[str, set[str]] = {}
    for name, path in known.items():
        # What a type checker or a function imports is not needed to import the file.
        top = ast.Module(body=[node for node in parsed(path).body if isinstance(node, ast.ImportFrom)], type_ignores=[])
        needs[name] = {module for module in modules(top) if module in known}
    done: set[str] = set()
    while free := {name for name, wanted in needs.items() if name not in done and wanted <= done}:
        done |= free
    assert set(needs) - done == set()
