"""The episode as an environment of other libraries: dm_env, and Gymnasium if it is installed.

Importing this package tells Gymnasium of `Okiagari/PushRecovery-v0`.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.envs.dm_env import make_environment
    from sim.envs.gymnasium_env import PushRecoveryEnv

__all__ = ["PushRecoveryEnv", "make_environment"]

with contextlib.suppress(ModuleNotFoundError):  # it is optional
    import gymnasium

    gymnasium.register("Okiagari/PushRecovery-v0", entry_point="sim.envs.gymnasium_env:PushRecoveryEnv")


def __getattr__(name: str) -> Any:
    # The physics takes a second to import.
    if name == "make_environment":
        from sim.envs.dm_env import make_environment

        return make_environment
    if name == "PushRecoveryEnv":
        from sim.envs.gymnasium_env import PushRecoveryEnv

        return PushRecoveryEnv
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
