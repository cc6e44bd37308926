"""The episode as an environment of other libraries: dm_env."""

from sim.envs.dm_env import make_environment

__all__ = ["make_environment"]
