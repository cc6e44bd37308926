"""What a suite may say: a base scenario, axes to cross, replicas, and how a series of sizes ends."""

from __future__ import annotations

import math
from collections import Counter
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from controllers.fields import Strict, conflict, snap
from controllers.registry import short
from scenarios.choice import ControllerName, LayerName
from scenarios.push import LONGEST, DeltaV, Direction, Duration, Impulse, Offset, Start
from scenarios.random_pushes import First, Random, Relative, Train
from scenarios.schema import BodyError, Friction, MassScale, Pose, Seed, World
from scenarios.sensing import Latency, PositionNoise, Preset, VelocityNoise
from scenarios.variants import Variants

MANY = 1_000_000
"""More episodes than this are run only if asked for twice."""
SIZES = ("delta_v", "impulse", "relative")
"""Axes that say how large a push is; a suite has one of them."""


def _levels(value: Any) -> Any:
    """`{first, last, step}` written out."""
    if not isinstance(value, dict):
        return value
    if set(value) != {"first", "last", "step"} or not all(
        isinstance(v, int | float) and math.isfinite(v) for v in value.values()
    ):
        raise ValueError("is neither a list nor a table of three numbers {first, last, step}")
    first, last, step = value["first"], value["last"], value["step"]
    if step <= 0 or last < first:
        raise ValueError("must have a positive step and last >= first")
    if (last - first) / step > MANY:
        raise ValueError(f"makes {(last - first) / step:.7g} values; at most {MANY} are allowed")
    count = math.floor(snap((last - first) / step)) + 1
    # Decimal fractions: 0.05 + 2 * 0.05 is meant to be 0.15 and not its neighbour.
    return [round(first + i * step, 12) for i in range(count)]


def _distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    twice = [value for value, count in Counter(values).items() if count > 1]
    if twice:
        raise ValueError(f"must not hold {twice[0]!r} twice")
    return values


def _told_apart(names: tuple[str, ...]) -> tuple[str, ...]:
    twice = [name for name, count in Counter(map(short, names)).items() if count > 1]
    if twice:
        raise ValueError(f"holds two that are called {twice[0]!r}; rename a file or a class")
    return names


_AXIS = (Field(strict=False, min_length=1), AfterValidator(_distinct))
_GRID = (BeforeValidator(_levels), *_AXIS)
_NAMES = (*_AXIS, AfterValidator(_told_apart))
Words = Annotated[tuple[Annotated[str, Field(min_length=1)], ...], *_AXIS]


class Axes(Strict):
    """The values to cross, each axis a list or, for numbers, `{first, last, step}`.

    Attributes:
        robot, world, controller, whole_body: as of a scenario.
        body, direction, delta_v, impulse, duration, start, height: as of a push; one of delta_v, impulse and relative.
        relative: size of the push in units of omega d of its own direction, as of a train, from 1e-3 to 50.
        mass_scale, friction: as of a scenario's disturbance.
        sensing, latency, noise_position, noise_velocity: preset, latency and state_noise of a scenario's sensing.
        body_error: scale of a scenario's body.
    """

    robot: Words | None = None
    world: Annotated[tuple[World, ...], *_AXIS] | None = None
    controller: Annotated[tuple[ControllerName, ...], *_NAMES] | None = None
    whole_body: Annotated[tuple[LayerName, ...], *_NAMES] | None = None
    body: Words | None = None
    direction: Annotated[tuple[Direction, ...], *_GRID] | None = None
    delta_v: Annotated[tuple[DeltaV, ...], *_GRID] | None = None
    impulse: Annotated[tuple[Impulse, ...], *_GRID] | None = None
    relative: Annotated[tuple[Relative, ...], *_GRID] | None = None
    duration: Annotated[tuple[Duration, ...], *_GRID] | None = None
    start: Annotated[tuple[Start, ...], *_GRID] | None = None
    height: Annotated[tuple[Offset, ...], *_GRID] | None = None
    mass_scale: Annotated[tuple[MassScale, ...], *_GRID] | None = None
    friction: Annotated[tuple[Friction, ...], *_GRID] | None = None
    sensing: Annotated[tuple[Preset, ...], *_AXIS] | None = None
    latency: Annotated[tuple[Latency, ...], *_GRID] | None = None
    noise_position: Annotated[tuple[PositionNoise, ...], *_GRID] | None = None
    noise_velocity: Annotated[tuple[VelocityNoise, ...], *_GRID] | None = None
    body_error: Annotated[tuple[BodyError, ...], *_GRID] | None = None

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, axes: Any) -> Any:
        if isinstance(axes, dict) and "delay" in axes:
            raise conflict("delay", "this axis is called latency now")
        return axes

    def given(self) -> dict[str, tuple[Any, ...]]:
        """The axes that the suite has, in the order above."""
        return {name: values for name in Axes.model_fields if (values := getattr(self, name)) is not None}


class Replica(Strict):
    """How replicas differ; what is seeded is so by the suite's seed and the episode's parameters.

    Attributes:
        pose: standard deviation of the initial joint angles [rad]; None is the base scenario's.
        shift: each replica is pushed this much later than the one before [s], at most 3600.
        time: greatest seeded shift of the push, to either side [s], at most 3600.
        direction: greatest seeded turn of the push, to either side [deg], at most 360.
    """

    pose: Pose | None = None
    shift: Start = 0.0
    time: Start = 0.0
    direction: float = Field(default=0.0, ge=0, le=360)


class Adaptive(Strict):
    """When a series of growing pushes, alike in all but their size, ends.

    Attributes:
        stop_after: so many failures in a row.
        each_replica: whether each replica is a series of its own; else all replicas of a size come before the next.
    """

    stop_after: int = Field(ge=1)
    each_replica: bool = True


class Suite(Strict):
    """Many episodes.

    Attributes:
        description: one line.
        tuned_on: one line for the report: on which seeds and directions the controllers were tuned, and that this
            suite's were held out.
        scenario: the base: name of a scenario, path of a file, or its fields; its duration and seed are the suite's to
            decide. At most one push, and none for a train: it gives what axes and random values do not.
        axes: what is crossed.
        random: pushes that are drawn; crossed with the axes.
        train: growing pushes one after another in place of the one push; crossed with the axes.
        first: a push before the one that is asked for.
        variants: designs to compare, each a name with what it changes of the base; crossed with the axes.
        replicas: repetitions of each episode, at most 1e9.
        replica: how they differ.
        adaptive: ends a series of growing pushes early.
        seed: of everything that is drawn.
        after: time after the last push until the episode is judged at the latest [s], at most 3600.
    """

    description: str = Field(min_length=1, pattern=r"^[^\n]*$")
    tuned_on: str | None = Field(default=None, min_length=1, pattern=r"^[^\n]*$")
    scenario: str | dict[str, Any] = "quiet"
    axes: Axes = Axes()
    random: Random | None = None
    train: Train | None = None
    first: First | None = None
    variants: Variants | None = None
    replicas: int = Field(default=1, ge=1, le=1_000_000_000)
    replica: Replica = Replica()
    adaptive: Adaptive | None = None
    seed: Seed = 0
    after: float = Field(default=5.0, gt=0, le=LONGEST)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        axes, drawn = self.axes.given(), {} if self.random is None else self.random.given()
        for name in drawn:
            if name in axes:
                raise conflict(f"random.{name}", "is an axis already; it must not be given")
        if self.train is not None:
            self._fits_train(axes)
        sizes = [name for name in SIZES if name in axes or name in drawn]
        if len(sizes) > 1:
            raise conflict(f"axes.{sizes[-1]}", "give only one of delta_v [m/s], impulse [N s] and relative [omega d]")
        if self.adaptive is not None and not any(size in axes for size in sizes):
            raise conflict("adaptive", "needs an axis delta_v, impulse or relative")
        return self

    def _fits_train(self, axes: dict[str, tuple[Any, ...]]) -> None:
        for name in ("direction", *SIZES):
            if name in axes:
                raise conflict(f"axes.{name}", "the train draws its own; it must not be given")
        for name in ("random", "first", "adaptive"):
            if getattr(self, name) is not None:
                raise conflict(name, "does not go with a train; give only one of them")
        if self.replica.direction:
            raise conflict("replica.direction", "the train's directions are drawn already; it must not be given")

    @property
    def size_axis(self) -> str | None:
        """Which axis holds the size of the push, if one does."""
        axes = self.axes.given()
        return next((name for name in SIZES if name in axes), None)

    @property
    def episodes(self) -> int:
        """How many episodes there are, before any series ends early."""
        crossed = math.prod(len(values) for values in self.axes.given().values()) * len(self.variants or (None,))
        return crossed * self.replicas * (1 if self.random is None else self.random.count)
