"""A referential trajectory (26) with the supports it was planned on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum
from models.errors import OkiagariError

# (26) is re-evaluated tick by tick, so only rounding of one tick separates both sides.
_DYNAMICS = 1e-9
# A planner's solver leaves this much [m]; a thousandth of the ZMP margin that a body can use.
_ZMP = 1e-6
_REST = 1e-6


class ReferenceViolation(OkiagariError):
    """A referential trajectory breaks one of the requirements of Section IV-A."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Reference:
    """Referential states xi_0..xi_m and ZMPs mu_0..mu_{m-1}, with the support of each tick.

    Requirements, checked here: (26) holds, M mu_k <= v in the support of tick k, and the COG rests over the
    final support at xi_m. A reference with `admissible=False` is the least violated motion where no admissible
    one exists: all but the ZMP is checked, and it lies outside every tracking set.

    Attributes:
        pendulum: model and period of the reference.
        xi: (m + 1, 4) states [m, m/s], world frame.
        mu: (m, 2) ZMPs [m].
        supports: the different support polygons that occur.
        support_of: (m,) index into `supports` for each tick.
        final: support polygon after the end.

    Raises:
        ReferenceViolation: shapes do not fit, or a requirement is broken.
    """

    pendulum: Pendulum
    xi: np.ndarray
    mu: np.ndarray
    supports: tuple[SupportPolygon, ...]
    support_of: np.ndarray
    final: SupportPolygon
    _margins: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        xi, mu = np.array(self.xi, dtype=float), np.array(self.mu, dtype=float)
        support_of = np.array(self.support_of, dtype=np.intp)
        self._check_shapes(xi, mu, support_of)
        drift = np.abs(xi[1:] - xi[:-1] @ self.pendulum.A.T - mu @ self.pendulum.B.T)
        scale = 1.0 + float(np.abs(xi).max())
        if drift.size and drift.max() > _DYNAMICS * scale:
            k = int(drift.max(axis=1).argmax())
            raise ReferenceViolation(f"the pendulum equation (26) is broken by {drift[k].max():.2g} at tick {k}")
        margins = np.empty(len(mu))
        for index, polygon in enumerate(self.supports):
            ticks = support_of == index
            margins[ticks] = polygon.slacks(mu[ticks])
        if len(mu) and margins.min() < -_ZMP:
            k = int(margins.argmin())
            raise ReferenceViolation(f"the ZMP is {-margins[k]:.3g} m outside its support polygon at tick {k}")
        if np.abs(xi[-1, 1::2]).max() > _REST:
            raise ReferenceViolation(f"the COG still moves at the end: {xi[-1, 1::2]} m/s")
        if not self.final.contains(xi[-1, 0::2]):
            raise ReferenceViolation(f"the COG ends over {xi[-1, 0::2]} m, outside the final support polygon")
        for name, value in (("xi", xi), ("mu", mu), ("support_of", support_of), ("_margins", margins)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def _check_shapes(self, xi: np.ndarray, mu: np.ndarray, support_of: np.ndarray) -> None:
        m = len(mu)
        if xi.shape != (m + 1, 4) or mu.shape != (m, 2) or support_of.shape != (m,):
            raise ReferenceViolation(
                f"shapes must be (m+1, 4), (m, 2), (m,), got {xi.shape}, {mu.shape}, {support_of.shape}"
            )
        if not (np.isfinite(xi).all() and np.isfinite(mu).all()):
            raise ReferenceViolation("a referential state or ZMP is not finite")
        if m and not (support_of.min() >= 0 and support_of.max() < len(self.supports)):
            raise ReferenceViolation(f"support_of points outside the {len(self.supports)} supports")

    @property
    def m(self) -> int:
        """Number of ticks."""
        return len(self.mu)

    @property
    def dt(self) -> float:
        """Period of a tick [s]."""
        return self.pendulum.dt

    @property
    def duration(self) -> float:
        """Time from xi_0 to xi_m [s]."""
        return self.m * self.dt

    def support(self, k: int) -> SupportPolygon:
        """Support polygon of tick k; the final one from m on."""
        return self.supports[self.support_of[k]] if k < self.m else self.final

    def margins(self) -> np.ndarray:
        """Slack (m,) [m] of each mu_k in its support: the right sides v_k - M_k mu_k of the tracking sets."""
        return self._margins
