"""A push: a force on one body for a while, and the exact impulse of its samples."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from controllers.fields import Strict, Vector, conflict, snap

COG = "cog"
"""As the body of a push: all bodies, each by its share of the mass."""
LONGEST = 3600.0
"""No episode lasts longer [s]."""
FASTEST = 20.0
"""No push gives the robot's whole mass more than this [m/s], ten times what fells a tall human."""

Start = Annotated[float, Field(ge=0, le=LONGEST)]
# A blow of steel on steel lasts some 1e-4 s; a push of a minute is a slope.
Duration = Annotated[float, Field(ge=1e-4, le=60)]
Direction = Annotated[float, Field(ge=-3600, le=3600)]
DeltaV = Annotated[float, Field(ge=1e-6, le=FASTEST)]
Impulse = Annotated[float, Field(ge=1e-6, le=1e5)]
Offset = Annotated[float, Field(ge=-10, le=10)]


class Push(Strict):
    """A force on one body for a while; on the pendulum it acts on the COG.

    Attributes:
        start: when it begins [s], at most 3600.
        duration: how long it lasts [s], from 1e-4, a blow of steel on steel, to 60.
        direction: horizontal, [deg], 0 is forward, 90 is left; at most ten turns. Either this or `vector`.
        vector: direction in the world frame; its length does not matter.
        impulse: size [N s], from 1e-6 to 1e5. Either this or `delta_v`.
        delta_v: size as the velocity that the impulse gives the robot's whole mass [m/s], from 1e-6 to 20.
        body: name of the body it acts on; "cog" spreads the force over all bodies by their mass, which turns none.
        point: where it acts, in that body's frame [m], at most 10 along each axis; None is the body's COM.
        height: how far above that point it acts, vertically [m], at most 10 either way.
        shape: force over time.
    """

    start: Start
    duration: Duration = 0.1
    direction: Direction | None = None
    vector: Vector | None = None
    impulse: Impulse | None = None
    delta_v: DeltaV | None = None
    body: str = Field(default="trunk", min_length=1)
    point: Annotated[tuple[Offset, Offset, Offset], Field(strict=False)] | None = None
    height: Offset = 0.0
    shape: Literal["rectangular", "half_sine"] = "rectangular"

    @field_validator("vector")
    @classmethod
    def _has_a_direction(cls, vector: Vector | None) -> Vector | None:
        if vector is not None and not any(vector):
            raise ValueError("must not be zero")
        return vector

    @model_validator(mode="after")
    def _one_direction_one_size(self) -> Self:
        if (self.direction is None) == (self.vector is None):
            raise conflict("direction", "give exactly one of direction [deg] and vector [x, y, z]")
        if (self.impulse is None) == (self.delta_v is None):
            raise conflict("impulse", "give exactly one of impulse [N s] and delta_v [m/s]")
        if self.body == COG and (self.point is not None or self.height):
            field = "height" if self.point is None else "point"
            raise conflict(field, f"a push on {COG!r} acts on every body's COM; it must not be given")
        return self

    @property
    def end(self) -> float:
        """When it ends [s]."""
        return self.start + self.duration

    @property
    def unit(self) -> NDArray[np.float64]:
        """(3,) unit vector of the force in the world frame."""
        if self.vector is not None:
            vector = np.array(self.vector) / max(map(abs, self.vector))
            return vector / np.linalg.norm(vector)
        assert self.direction is not None
        # Exact on the axes, so that a push forward has no trace of a push to the left.
        quarters, rest = divmod(self.direction, 90)
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
        c, s = math.cos(math.radians(rest)), math.sin(math.radians(rest))
        return np.array([c * cos - s * sin, c * sin + s * cos, 0.0])

    @property
    def direction_deg(self) -> float:
        """Horizontal direction [deg], in (-180, 180]."""
        x, y, _ = self.unit
        return math.degrees(math.atan2(y, x))

    @property
    def axis(self) -> int:
        """Which way it goes the most, horizontally: 0 for x, 1 for y."""
        x, y, _ = np.abs(self.unit)
        return 0 if x >= y else 1

    def impulse_vector(self, mass: float) -> NDArray[np.float64]:
        """The asked impulse.

        Args:
            mass: mass of the whole robot [kg].

        Returns:
            (3,) impulse in the world frame [N s].
        """
        size = self.impulse if self.impulse is not None else (self.delta_v or 0.0) * mass
        return size * self.unit

    def delivered(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fraction of the impulse that is delivered at `time` [s]; the integral of the force's shape."""
        phase = np.clip((time - self.start) / self.duration, 0.0, 1.0)
        return phase if self.shape == "rectangular" else 0.5 * (1.0 - np.cos(np.pi * phase))

    def force_samples(self, dt: float, mass: float) -> tuple[int, NDArray[np.float64]]:
        """The force to hold during each physics step, so that the impulse is exact.

        Each sample is the mean of the force over its step: `sum(forces) * dt` is the asked impulse also when the
        push begins or ends within a step.

        Args:
            dt: physics step [s]; step i lasts from i dt to (i + 1) dt.
            mass: mass of the whole robot [kg].

        Returns:
            The first step it acts in, and (n, 3) forces in the world frame [N].
        """
        first = math.floor(snap(self.start / dt))
        beyond = math.ceil(snap(self.end / dt))
        fraction = np.diff(self.delivered(np.arange(first, beyond + 1, dtype=np.float64) * dt))
        # Rounding in the last digits of start / dt must not lose a sliver of the impulse: 1e-9 of an hour is 4e-6 s,
        # less than any push lasts.
        fraction /= fraction.sum()
        return first, fraction[:, None] * self.impulse_vector(mass) / dt
