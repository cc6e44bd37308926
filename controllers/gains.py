"""State feedback gains F of (18): LQR, pole placement, and feedback of the divergent component of motion."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from controllers.pendulum import Pendulum
from models.errors import OkiagariError

# A continuous pole this close to -omega (relative) leaves rows of the set that are parallel but for rounding.
_HIDDEN_POLE = 1e-6
# F is recognised as a DCM gain up to the rounding of k / omega, a few units in the last place.
_DCM_MATCH = 1e-12


class GainError(OkiagariError):
    """A feedback gain that cannot be used; the message tells what to change."""


class UnstableGainError(GainError):
    """The closed loop (20) does not converge."""


class UnobservableGainError(GainError):
    """The ZMP does not show the whole state (a closed-loop pole at -omega), so the 4-D set is unbounded."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Gain:
    """Feedback ubar = -F xbar (18).

    Attributes:
        F: (2, 4), ZMP [m] from [x_G, xd_G, y_G, yd_G], units [m/m, m/(m/s), ...].
        name: how reports call it.

    Raises:
        GainError: F is not a finite (2, 4) array.
    """

    F: np.ndarray
    name: str

    def __post_init__(self) -> None:
        F = np.array(self.F, dtype=float)
        if F.shape != (2, 4) or not np.isfinite(F).all():
            raise GainError(f"gain {self.name!r}: F must be a finite (2, 4) array, got {F.tolist()}")
        F.setflags(write=False)
        object.__setattr__(self, "F", F)

    @cached_property
    def axis(self) -> np.ndarray | None:
        """Row f (2,) when both axes are decoupled and alike, F = [[f, 0], [0, f]]; otherwise None."""
        (f0, f1, c0, c1), (d0, d1, g0, g1) = self.F.tolist()
        if (c0, c1, d0, d1) == (0.0, 0.0, 0.0, 0.0) and (f0, f1) == (g0, g1):
            return self.F[0, :2]
        return None

    def closed_loop(self, pendulum: Pendulum) -> np.ndarray:
        """Atilde = A - B F (4, 4), by (20)."""
        return pendulum.A - pendulum.B @ self.F

    def closed_loop_axis(self, pendulum: Pendulum) -> np.ndarray | None:
        """The (2, 2) block of `closed_loop` that both axes share, or None if they do not share it."""
        return None if self.axis is None else self.closed_loop(pendulum)[:2, :2]

    def spectral_radius(self, pendulum: Pendulum) -> float:
        """Largest modulus of a closed-loop pole; below 1 the closed loop converges."""
        loop = self.closed_loop_axis(pendulum)
        loop = self.closed_loop(pendulum) if loop is None else loop
        return float(np.abs(np.linalg.eigvals(loop)).max())

    def require_stable(self, pendulum: Pendulum) -> None:
        """Raise UnstableGainError unless the closed loop converges."""
        radius = self.spectral_radius(pendulum)
        if not radius < 1.0:
            raise UnstableGainError(
                f"gain {self.name!r} is unstable: spectral radius {radius:.6g} "
                f"at omega {pendulum.omega:.4g} 1/s, dt {pendulum.dt:g} s; "
                "it must be below 1 (choose slower poles, a larger r, or a smaller dt)"
            )

    def dcm_ratio(self, pendulum: Pendulum) -> float | None:
        """k if this is the gain of `dcm` for this pendulum and contracts monotonically, else None."""
        if self.axis is None:
            return None
        position, velocity = self.axis.tolist()
        k = -position
        if abs(velocity * pendulum.omega + k) > _DCM_MATCH * abs(k):
            return None
        return k if 0.0 < dcm_contraction(pendulum, k) < 1.0 else None


def dcm_contraction(pendulum: Pendulum, k: float) -> float:
    """lambda with which a period shrinks the DCM error under `dcm`: e^{w dt} - (e^{w dt} - 1) k."""
    return 1.0 - math.expm1(pendulum.omega * pendulum.dt) * (k - 1.0)


def dcm(pendulum: Pendulum, k: float) -> Gain:
    """u - u_C = k (xbar + xdbar / omega): feedback of the divergent component alone.

    Its MOA set is the support polygon shrunk by 1 / k about u_C, in the plane of the DCM.

    Raises:
        UnstableGainError: k does not exceed 1, or exceeds what the period allows.
    """
    k = float(k)
    most = 1.0 + 1.0 / math.expm1(pendulum.omega * pendulum.dt)
    if not 1.0 < k < most:
        raise UnstableGainError(
            f"DCM gain k must lie strictly between 1 and {most:.4g} at omega {pendulum.omega:.4g} 1/s, "
            f"dt {pendulum.dt:g} s, got {k:g}: below, the DCM diverges; above, it overshoots every sample"
        )
    return _both_axes(-np.array([k, k / pendulum.omega]), f"dcm k={k:g}")


def lqr(pendulum: Pendulum, q: tuple[float, float], r: float) -> Gain:
    """Gain that minimises sum of q0 p^2 + q1 pd^2 + r u^2 for each axis.

    Args:
        pendulum: the discrete plant (8).
        q: weights of position [1/m^2] and velocity [s^2/m^2], not negative.
        r: weight of the ZMP [1/m^2], positive.

    Raises:
        GainError: a weight is out of range, or the Riccati equation has no stabilising solution.
        UnobservableGainError: the weights put a pole at -omega (as q = (0, 0) does).
    """
    weights = np.array(q, dtype=float)
    if weights.shape != (2,) or not (np.isfinite(weights).all() and (weights >= 0.0).all()):
        raise GainError(f"LQR q must be two finite weights, (position, velocity), not negative; got {q!r}")
    if not (math.isfinite(r) and r > 0.0):
        raise GainError(f"LQR r must be a positive finite weight, got {r!r}")
    from scipy.linalg import solve_discrete_are  # long to import, and reading a scenario does without

    a, b = pendulum.A[:2, :2], pendulum.B[:2, :1]
    try:
        cost = solve_discrete_are(a, b, np.diag(weights), np.array([[float(r)]]))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise GainError(f"LQR with q={q!r}, r={r!r} has no solution ({error}); use weights nearer to 1") from error
    row = (b.T @ cost @ a / (r + b.T @ cost @ b))[0]
    gain = _both_axes(row, f"lqr q=({weights[0]:g}, {weights[1]:g}) r={r:g}")
    gain.require_stable(pendulum)
    _require_observable(pendulum, gain)
    return gain


def poles(pendulum: Pendulum, continuous: Sequence[complex]) -> Gain:
    """Gain that puts the two closed-loop poles of each axis at e^{p dt}.

    Args:
        pendulum: the discrete plant (8).
        continuous: two poles p [1/s] with negative real part: both real (they may be equal) or conjugate.

    Raises:
        GainError: not two finite poles, real or conjugate.
        UnstableGainError: a pole does not decay.
        UnobservableGainError: a pole at -omega; `dcm` is the gain that has one.
    """
    pair = [complex(p) for p in continuous]
    if len(pair) != 2 or not all(cmath.isfinite(p) for p in pair):
        raise GainError(f"poles must be two finite numbers in 1/s, got {list(continuous)!r}")
    first, second = pair
    if abs(first.imag + second.imag) > 1e-12 * abs(first) or (
        first.imag != 0.0 and abs(first.real - second.real) > 1e-12 * abs(first)
    ):
        raise GainError(f"poles must be both real or a conjugate pair, got {first:g} and {second:g}")
    if not (first.real < 0.0 and second.real < 0.0):
        raise UnstableGainError(f"poles must have a negative real part, got {first:g} and {second:g} 1/s")
    if abs(first.imag) * pendulum.dt >= math.pi:
        raise GainError(
            f"poles {first:g}, {second:g} 1/s turn faster than dt {pendulum.dt:g} s shows: use a smaller dt"
        )
    name = "poles " + ", ".join(f"{p.real:g}" if p.imag == 0.0 else f"{p:g}" for p in pair)
    for hidden, other in ((first, second), (second, first)):
        if _hidden(pendulum, hidden):
            raise _unobservable(pendulum, name, other)
    a, b = pendulum.A[:2, :2], pendulum.B[:2, :1]
    z1, z2 = cmath.exp(first * pendulum.dt), cmath.exp(second * pendulum.dt)
    # Ackermann's formula: exact for one input and two states.
    wanted = a @ a - (z1 + z2).real * a + (z1 * z2).real * np.eye(2)
    row = np.linalg.solve(np.hstack((b, a @ b)).T, np.array([0.0, 1.0])) @ wanted
    gain = _both_axes(row, name)
    gain.require_stable(pendulum)
    return gain


def _both_axes(row: np.ndarray, name: str) -> Gain:
    return Gain(F=np.kron(np.eye(2), row), name=name)


def _hidden(pendulum: Pendulum, pole: complex) -> bool:
    return abs(pole + pendulum.omega) <= _HIDDEN_POLE * pendulum.omega


def _require_observable(pendulum: Pendulum, gain: Gain) -> None:
    loop = gain.closed_loop_axis(pendulum)
    assert loop is not None
    first, second = (cmath.log(complex(z)) / pendulum.dt for z in np.linalg.eigvals(loop))
    for hidden, other in ((first, second), (second, first)):
        if _hidden(pendulum, hidden):
            raise _unobservable(pendulum, gain.name, other)


def _unobservable(pendulum: Pendulum, name: str, other: complex) -> UnobservableGainError:
    # Under dcm(k) the DCM error decays by lambda = 1 - (e^{w dt} - 1)(k - 1) a period: solve it for k.
    k = 1.0 + (1.0 - cmath.exp(other * pendulum.dt).real) / math.expm1(pendulum.omega * pendulum.dt)
    return UnobservableGainError(
        f"gain {name!r} has a pole at -omega = {-pendulum.omega:.6g} 1/s, which the ZMP does not show: "
        f"use dcm(pendulum, k={k:.6g}), which is this gain with a set of its own"
    )
