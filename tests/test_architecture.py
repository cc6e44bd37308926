"""The rules of the house: who may import whom, and that what is public is explained."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parent.parent
# Whom of the house each package may import, and whom from outside it must not.
MAY_IMPORT = {
    "models": {"models"},
    "controllers": {"controllers", "models"},
    "scenarios": {"scenarios", "models"},
    "sim": {"sim", "scenarios", "controllers", "models"},
}
MUST_NOT_KNOW = {
    "models": {"placo", "pinocchio"},
    "controllers": {"mujoco", "dm_control", "dm_env", "pinocchio"},
    "scenarios": {"mujoco", "dm_control", "dm_env", "placo", "pinocchio"},
    "sim": {"placo", "pinocchio"},
}
FILES = [path for package in MAY_IMPORT for path in sorted((HOUSE / package).glob("**/*.py"))]


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
    assert names & set(MAY_IMPORT) <= MAY_IMPORT[package]
    forbidden = MUST_NOT_KNOW[package] | {"tests"}
    if package == "controllers" and path.parent.name != "whole_body":
        forbidden |= {"placo"}
    assert not names & forbidden
    assert list(unexplained(tree)) == []


def test_each_package_is_looked_at() -> None:
    assert {path.relative_to(HOUSE).parts[0] for path in FILES} == set(MAY_IMPORT)


def test_the_rules_can_be_broken() -> None:
    source = "def f():\n    import mujoco.mjx\n    from sim.record.trace import Trace\nclass A:\n    def g(self): ...\n"
    tree = ast.parse(source)
    assert imported(tree) == {"mujoco", "sim"}
    assert set(unexplained(tree)) == {"module", "f", "A", "A.g"}
