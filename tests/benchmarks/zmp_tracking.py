"""How well each whole-body layer realises a ZMP: gain and lag at two frequencies, standing on both feet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from controllers.geometry.support_polygon import standing_feet, support_polygon
from controllers.interface import BalanceCommand, FootReference, Observation
from models.arena import SIDES
from models.robot import Robot, load_robot
from scenarios.schema import Scenario
from sim.episode.plant import HumanoidPlant
from tests.benchmarks.timing import show, table

AMPLITUDE = 0.008  # [m]
FREQUENCIES = (1.0, 4.0)  # [Hz]
# Whole periods of both; what the start stirred up has decayed after the first seconds.
SETTLE, MEASURE = 2.0, 3.0
# Weak: it only keeps the pendulum, which no open loop can hold, on the motion that goes with the sine.
FEEDBACK = 1.2


class SineBrain:
    """Commands ZMP = middle + sine along one axis, both feet in stance.

    The pendulum falls under any given ZMP, so the DCM is held to the periodic one that goes with the sine.

    Attributes:
        decisions, steps: none.
    """

    def __init__(self, robot: Robot, axis: int, frequency: float) -> None:
        self._omega, self._turn = robot.omega, 2.0 * math.pi * frequency
        self._unit = np.eye(2)[axis]
        self._polygon = support_polygon(list(standing_feet(robot).values())).shrunk(0.003)

    def command(self, observation: Observation) -> BalanceCommand:
        """One control tick."""
        phase, still = self._turn * observation.time, np.zeros(3)
        # x_G of (1) under z sin(wt) is z w_0^2 / (w_0^2 + w^2) sin(wt).
        share = self._omega**2 / (self._omega**2 + self._turn**2)
        sway = AMPLITUDE * share * (math.sin(phase) + self._turn / self._omega * math.cos(phase))
        middle = 0.5 * (observation.feet["left"].position + observation.feet["right"].position)[:2]
        dcm = observation.cog[:2] + observation.cog_velocity[:2] / self._omega
        zmp = middle + AMPLITUDE * math.sin(phase) * self._unit + FEEDBACK * (dcm - middle - sway * self._unit)
        feet = {
            side: FootReference(
                stance=True, position=observation.feet[side].position, velocity=still, acceleration=still,
                yaw=observation.feet[side].yaw,
            )
            for side in SIDES
        }  # fmt: skip
        return BalanceCommand(zmp=self._polygon.nearest(zmp), feet=feet)


@dataclass(frozen=True, kw_only=True)
class Response:
    """Measured over commanded ZMP at one frequency.

    Attributes:
        gain: ratio of the amplitudes.
        lag: of the measured ZMP [s].
        rest: RMS of what the sine does not explain in the measured ZMP [m].
    """

    gain: float
    lag: float
    rest: float


def fit(time: np.ndarray, commanded: np.ndarray, measured: np.ndarray, frequency: float) -> Response:
    """Least squares of both signals (n,) on a sine of `frequency` [Hz] and a constant."""
    phase = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(time)])
    both, *_ = np.linalg.lstsq(basis, np.column_stack([commanded, measured]), rcond=None)
    command, answer = (complex(sine, cosine) for sine, cosine, _ in both.T)
    residue = measured - basis @ both[:, 1]
    ratio = answer / command
    lag = -math.atan2(ratio.imag, ratio.real) / (2.0 * math.pi * frequency)
    return Response(gain=abs(ratio), lag=lag, rest=float(np.sqrt(np.mean(residue**2))))


def track(whole_body: Literal["dynamics", "ik"], axis: int, frequency: float) -> Response:
    """Stand and sway: how the humanoid follows the sine along x (0) or y (1)."""
    scenario = Scenario(description="stand and sway", whole_body=whole_body, duration=SETTLE + MEASURE)
    robot = load_robot(scenario.robot)
    plant, controller = HumanoidPlant(scenario, robot), SineBrain(robot, axis, frequency)
    rows = []
    for _ in range(scenario.ticks):
        observation = plant.observe()
        command = controller.command(observation)
        rows.append((observation.time, command.zmp[axis], observation.zmp[axis]))
        plant.advance(observation, command)
    time, commanded, measured = np.array(rows).T
    late = time >= SETTLE
    return fit(time[late], commanded[late], measured[late], frequency)


def main() -> None:
    """Print the table."""
    made = table(
        f"ZMP tracking, standing: a sine of {1e3 * AMPLITUDE:g} mm (wanted: gain 0.8 to 1.2, lag below 10 ms)",
        "whole body", "axis", "frequency", "gain", "lag", "unexplained", "as wanted",
    )  # fmt: skip
    for whole_body in ("dynamics", "ik"):
        for axis in (0, 1):
            for frequency in FREQUENCIES:
                response = track(whole_body, axis, frequency)
                verdict = "no"
                if 0.8 <= response.gain <= 1.2 and response.lag < 0.010:
                    verdict = "yes" if response.lag > -0.010 else "yes, but it leads"
                made.add_row(
                    whole_body, "xy"[axis], f"{frequency:g} Hz", f"{response.gain:.2f}", f"{1e3 * response.lag:.1f} ms",
                    f"{1e3 * response.rest:.2f} mm", verdict,
                )  # fmt: skip
    show(made)


if __name__ == "__main__":
    main()
