"""Scenario files that tests write."""

from __future__ import annotations

from pathlib import Path

PUSH = "[[pushes]]\nstart = 3.0\n"
"""The beginning of a push, to be gone on with."""


def written(folder: Path, text: str, *, description: str = 'description = "x"\n') -> Path:
    """A scenario's file: its description, and what is asked."""
    path = folder / "mine.toml"
    path.write_text(description + text)
    return path
