"""A push: a force or a torque on one body for a while, and the exact impulse of its samples."""

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
Moment = Annotated[float, Field(ge=-1e5, le=1e5)]
# Less is lost in the rounding of what holds the robot up.
_LEAST_TORQUE = 1e-6
_OF_A_FORCE = ("direction", "vector", "impulse", "delta_v", "point")


class Push(Strict):
    """A force on one body for a while, or a torque; on the pendulum the force acts on the COG.

    Pushes that overlap in time act all at once, each for itself: forces and torques on one body add up.

    Attributes:
        start: when it begins [s], at most 3600.
        duration: how long it lasts [s], from 1e-4, a blow of steel on steel, to 60.
        direction: horizontal, [deg], 0 is forward, 90 is left; at most ten turns. Either this or `vector`.
        vector: direction in the world frame; its length does not matter.
        impulse: size [N s], from 1e-6 to 1e5. Either this or `delta_v`.
        delta_v: size as the velocity that the impulse gives the robot's whole mass [m/s], from 1e-6 to 20.
        torque: a pure torque instead of a force, without direction, size, point and height: (3,) its mean over the
            duration, world frame [N m], about the body's COM; its largest component from 1e-6 to 1e5. What it delivers
            is the angular impulse torque * duration [N m s], whatever the shape. Not on "cog", nor on the pendulum.
        body: name of the body it acts on; "cog" spreads the force over all bodies by their mass, which turns none.
        point: where it acts, in that body's frame [m], at most 10 along each axis; None is the body's COM.
        height: how far above that point it acts, vertically [m], at most 10 either way.
        shape: force or torque over time.
    """

    start: Start
    duration: Duration = 0.1
    direction: Direction | None = None
    vector: Vector | None = None
    impulse: Impulse | None = None
    delta_v: DeltaV | None = None
    torque: Annotated[tuple[Moment, Moment, Moment], Field(strict=False)] | None = None
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

    @field_validator("torque")
    @classmethod
    def _turns(cls, torque: Vector | None) -> Vector | None:
        if torque is not None and max(map(abs, torque)) < _LEAST_TORQUE:
            raise ValueError(f"must have a component of at least {_LEAST_TORQUE:g} N m")
        return torque

    @model_validator(mode="after")
    def _one_direction_one_size(self) -> Self:
        if self.torque is not None:
            for field in _OF_A_FORCE:
                if (value := getattr(self, field)) is not None:
                    raise conflict(field, f"{value!r} is of a force; beside a torque it must not be given")
            if self.height:
                raise conflict("height", f"{self.height!r} is of a force; beside a torque it must not be given")
            if self.body == COG:
                raise conflict("body", f"{COG!r} is all bodies, which no torque turns at once; name one of them")
            return self
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
        """(3,) unit vector of the force, or of the torque's axis, in the world frame."""
        given = self.vector if self.torque is None else self.torque
        if given is not None:
            vector = np.array(given) / max(map(abs, given))
            return vector / np.linalg.norm(vector)
        assert self.direction is not None
        # Exact on the axes, so that a push forward has no trace of a push to the left.
        quarters, rest = divmod(self.direction, 90)
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
        c, s = math.cos(math.radians(rest)), math.sin(math.radians(rest))
        return np.array([c * cos - s * sin, c * sin + s * cos, 0.0])

    @property
    def direction_deg(self) -> float:
        """Horizontal direction of the force, or of the torque's axis [deg], in (-180, 180]."""
        x, y, _ = self.unit
        return math.degrees(math.atan2(y, x))

    @property
    def axis(self) -> int:
        """Which way it pushes the robot the most, horizontally: 0 for x, 1 for y; a torque about y tips it along x."""
        x, y, _ = np.abs(self.unit)
        along = x >= y if self.torque is None else y >= x
        return 0 if along else 1

    @property
    def torque_words(self) -> str:
        """A torque in words: "torque 3 N m about -y on trunk"; only of a torque."""
        assert self.torque is not None
        return f"torque {np.linalg.norm(self.torque):.3g} N m about {_axis_words(self.unit)} on {self.body}"

    def impulse_vector(self, mass: float) -> NDArray[np.float64]:
        """The asked impulse.

        Args:
            mass: mass of the whole robot [kg].

        Returns:
            (3,) impulse in the world frame [N s]; zero of a torque.
        """
        if self.torque is not None:
            return np.zeros(3)
        size = self.impulse if self.impulse is not None else (self.delta_v or 0.0) * mass
        return size * self.unit

    def asked(self, mass: float) -> NDArray[np.float64]:
        """What it is to deliver, to a robot of `mass` [kg].

        Returns:
            (3,) in the world frame: impulse [N s], or of a torque the angular impulse [N m s].
        """
        return self.impulse_vector(mass) if self.torque is None else np.array(self.torque) * self.duration

    def delivered(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fraction of the impulse that is delivered at `time` [s]; the integral of its shape."""
        phase = np.clip((time - self.start) / self.duration, 0.0, 1.0)
        return phase if self.shape == "rectangular" else 0.5 * (1.0 - np.cos(np.pi * phase))

    def samples(self, dt: float, mass: float) -> tuple[int, NDArray[np.float64]]:
        """The force or torque to hold during each physics step, so that the impulse is exact.

        Each sample is the mean over its step: `sum(samples) * dt` is what is asked also when the push begins or ends
        within a step.

        Args:
            dt: physics step [s]; step i lasts from i dt to (i + 1) dt.
            mass: mass of the whole robot [kg].

        Returns:
            The first step it acts in, and (n, 3) forces [N] or torques [N m] in the world frame.
        """
        first = math.floor(snap(self.start / dt))
        beyond = math.ceil(snap(self.end / dt))
        fraction = np.diff(self.delivered(np.arange(first, beyond + 1, dtype=np.float64) * dt))
        # Rounding in the last digits of start / dt must not lose a sliver of the impulse: 1e-9 of an hour is 4e-6 s,
        # less than any push lasts.
        fraction /= fraction.sum()
        return first, fraction[:, None] * self.asked(mass) / dt


def _axis_words(unit: NDArray[np.float64]) -> str:
    """An axis in words: "y", "-y", or "(0.60, 0.00, 0.80)"."""
    for name, component in zip("xyz", unit.tolist(), strict=True):
        if abs(component) == 1.0:
            return f"-{name}" if component < 0.0 else name
    return f"({', '.join(f'{component:.2f}' for component in unit)})"
