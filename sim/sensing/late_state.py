"""The true state, late and noisy: what a scenario may give the controllers without sensors and estimator."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from controllers.interface import Observation
from scenarios.schema import Scenario

# Sets the noise apart from what else is drawn with the scenario's seed.
_STREAM = 1


class LateState:
    """Makes true states late and noisy, as the scenario's `[sensing]` says; else it passes them on as they are.

    All that is seen comes late; noise is on position and velocity of the COG, which are what a humanoid has to
    estimate. Each component has its own white noise, drawn anew for every state.

    Attributes:
        phase: physics steps after the beginning of each tick at which a state is to be taken, so that it is of the
            right age at the beginning of a later one; 0 if that is the beginning of a tick, too.
    """

    def __init__(self, scenario: Scenario) -> None:
        sensing, substeps = scenario.sensing, scenario.timing.substeps
        self._steps = round(sensing.latency / scenario.timing.physics)
        self.phase = -self._steps % substeps
        self._noise = sensing.state_noise
        kept = math.ceil(self._steps / substeps)
        self._past: deque[Observation] = deque(maxlen=kept if self.phase else kept + 1)
        self._rng = np.random.default_rng([scenario.seed, _STREAM])

    def take(self, observation: Observation) -> None:
        """Take a true state: at the start, then `phase` steps after the beginning of each tick."""
        if self._noise.position or self._noise.velocity:
            noise = self._rng.standard_normal((2, 3))
            observation = replace(
                observation,
                cog=observation.cog + self._noise.position * noise[0],
                cog_velocity=observation.cog_velocity + self._noise.velocity * noise[1],
            )
        self._past.append(observation)

    def see(self, observation: Observation) -> Observation:
        """What the controllers see of the present; to be called once a tick.

        Before the first state is old enough they see that one. The clock is never late.
        """
        if not self.phase or not self._past:
            self.take(observation)
        seen = self._past[0]
        return replace(seen, time=observation.time) if self._steps else seen
