"""COG-ZMP inverted pendulum (1)-(8), held exactly over a control period."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from models.errors import OkiagariError


class PendulumError(OkiagariError):
    """The pendulum was given a height, gravity, frequency or period that no pendulum has."""


def _positive(name: str, value: float, unit: str) -> float:
    value = float(value)
    if not (math.isfinite(value) and value > 0.0):
        raise PendulumError(f"{name} must be a positive finite number of {unit}, got {value!r}")
    return value


@dataclass(frozen=True, slots=True)
class Pendulum:
    """Exact zero-order hold of the COG-ZMP pendulum with constant COG height.

    State x = [x_G, xd_G, y_G, yd_G] in m and m/s (4), input u = [x_Z, y_Z] in m (5), world frame.

    Attributes:
        omega: natural frequency (3) [1/s].
        dt: period over which the ZMP is held [s].
        A: (4, 4) transition matrix of (8).
        B: (4, 2) input matrix of (8).

    Raises:
        PendulumError: omega or dt is not a positive finite number.
    """

    omega: float
    dt: float
    A: np.ndarray = field(init=False, repr=False, compare=False)
    B: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "omega", _positive("omega", self.omega, "1/s"))
        object.__setattr__(self, "dt", _positive("dt", self.dt, "s"))
        a, b = self.axis(1)
        big_a, big_b = np.kron(np.eye(2), a), np.kron(np.eye(2), b[:, None])
        for name, value in (("A", big_a), ("B", big_b)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def from_height(cls, height: float, gravity: float, dt: float) -> Self:
        """Pendulum of a COG at `height` [m] under `gravity` [m/s^2], by (3) with zero vertical acceleration."""
        return cls(math.sqrt(_positive("gravity", gravity, "m/s^2") / _positive("height", height, "m")), dt)

    def axis(self, ticks: int) -> tuple[np.ndarray, np.ndarray]:
        """Transition of one axis while the ZMP is held for `ticks` periods.

        Returns:
            a (2, 2) and b (2,) with [p, pd](k + ticks) = a [p, pd](k) + b u.
        """
        phase = self.omega * self.dt * ticks
        ch, sh = math.cosh(phase), math.sinh(phase)
        a = np.array([[ch, sh / self.omega], [self.omega * sh, ch]])
        # 2 sinh^2(phase/2) instead of cosh - 1, which cancels at short periods.
        b = np.array([-2.0 * math.sinh(0.5 * phase) ** 2, -self.omega * sh])
        return a, b

    def step(self, x: ArrayLike, u: ArrayLike) -> np.ndarray:
        """State (4,) one period later, by (8)."""
        return self.A @ np.asarray(x, dtype=float) + self.B @ np.asarray(u, dtype=float)

    def dcm(self, x: ArrayLike) -> np.ndarray:
        """Divergent component of motion (..., 2) [m]: COG + COG velocity / omega."""
        x = np.asarray(x, dtype=float)
        if x.shape == (4,):
            # Every tick asks for one state: plain floats are three times as fast.
            px, vx, py, vy = x.tolist()
            return np.array([px + vx / self.omega, py + vy / self.omega])
        return x[..., 0::2] + x[..., 1::2] / self.omega

    def rest(self, position: ArrayLike) -> np.ndarray:
        """State (4,) at rest with the COG over `position` (2,) [m]."""
        px, py = np.asarray(position, dtype=float)
        return np.array([px, 0.0, py, 0.0])

    def rollout(self, x0: ArrayLike, mu: ArrayLike) -> np.ndarray:
        """States (m + 1, 4) from x0 (4,) under the ZMP sequence mu (m, 2), by (26).

        Runs on the divergent and the convergent mode, two scalar recursions, each in compiled code.
        """
        x0, mu = np.asarray(x0, dtype=float), np.asarray(mu, dtype=float)
        xi = np.empty((len(mu) + 1, 4))
        xi[0] = x0
        if len(mu) == 0:
            return xi
        from scipy.signal import lfilter  # half a second of importing, which reading a scenario does without

        modes = []
        for sign in (1.0, -1.0):
            start = x0[0::2] + sign * x0[1::2] / self.omega
            growth = math.exp(sign * self.omega * self.dt)
            gain = -math.expm1(sign * self.omega * self.dt)
            mode, _ = lfilter([gain], [1.0, -growth], mu, axis=0, zi=growth * start[None, :])
            modes.append(mode)
        xi[1:, 0::2] = 0.5 * (modes[0] + modes[1])
        xi[1:, 1::2] = 0.5 * self.omega * (modes[0] - modes[1])
        return xi
