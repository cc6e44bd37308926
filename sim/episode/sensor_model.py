"""What stands between the world and the controllers when a scenario disturbs their senses: delay and noise."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from controllers.interface import Observation
from scenarios.schema import Scenario

# Sets the noise apart from what else is drawn with the scenario's seed.
_STREAM = 1


class SensorModel:
    """Makes observations late and noisy, as the scenario's `[disturbance]` says; else it passes them on as they are.

    All that is measured comes late; noise is on position and velocity of the COG, which are what a humanoid has to
    estimate. Each component has its own white noise, drawn anew every tick.
    """

    def __init__(self, scenario: Scenario) -> None:
        disturbance = scenario.disturbance
        self._ticks = round(disturbance.delay / scenario.timing.control)
        self._position, self._velocity = disturbance.noise_position, disturbance.noise_velocity
        self._seed = scenario.seed
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self._past: deque[Observation] = deque(maxlen=self._ticks + 1)
        self._rng = np.random.default_rng([self._seed, _STREAM])

    def see(self, observation: Observation) -> Observation:
        """What the controllers see of the present; to be called once a tick.

        Before the first observation is old enough they see that one. The clock is never late.
        """
        if self._position or self._velocity:
            noise = self._rng.standard_normal((2, 3))
            observation = replace(
                observation,
                cog=observation.cog + self._position * noise[0],
                cog_velocity=observation.cog_velocity + self._velocity * noise[1],
            )
        if not self._ticks:
            return observation
        self._past.append(observation)
        return replace(self._past[0], time=observation.time)
