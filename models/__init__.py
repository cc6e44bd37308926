"""The body: robot descriptions (MJCF), the arena they stand in, and the facts read off the compiled model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from models.errors import InputError, OkiagariError

if TYPE_CHECKING:
    from models.robot import Robot, load_robot

__all__ = ["InputError", "OkiagariError", "Robot", "load_robot"]


def __getattr__(name: str) -> Any:
    # MuJoCo takes a third of a second to import, and must not be before `sim` has chosen how it renders.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from models import robot

    return getattr(robot, name)
