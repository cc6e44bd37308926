"""What a scenario file may say: every field, its unit, its default and what is allowed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from controllers.fields import WHOLE, NotNegative, Strict, conflict, snap
from controllers.options import DcmGain, GainOptions, Stepping
from scenarios.choice import Choice, ControllerChoice, LayerChoice
from scenarios.push import LONGEST, Push
from scenarios.sensing import Sensing

World = Literal["humanoid", "pendulum"]
Pose = Annotated[NotNegative, Field(le=1)]
# Far beyond what a controller could be expected to bear with.
MassScale = Annotated[float, Field(ge=0.1, le=10)]
Friction = Annotated[float, Field(ge=1e-4, le=10)]
BodyError = Annotated[NotNegative, Field(le=10)]
_Share = Annotated[NotNegative, Field(le=0.5)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]


class Timing(Strict):
    """Periods of the two loops.

    Attributes:
        physics: step of the physics [s], from 1e-4 to 0.01: the contact with the floor takes 0.005.
        control: period of the controller [s], a whole multiple of `physics`, from 5e-4 to 0.1: over that, what keeps
            the pendulum up has let it fall.
    """

    physics: float = Field(default=0.001, ge=1e-4, le=0.01)
    control: float = Field(default=0.002, ge=5e-4, le=0.1)

    @model_validator(mode="after")
    def _divisible(self) -> Self:
        ratio = self.control / self.physics
        if round(ratio) < 1 or abs(ratio - round(ratio)) > WHOLE * ratio:
            raise conflict("control", f"{self.control!r} s must be a whole multiple of physics, {self.physics!r} s")
        return self

    @property
    def substeps(self) -> int:
        """Physics steps in a control period."""
        return round(self.control / self.physics)


class Variation(Strict):
    """What the seed draws.

    Attributes:
        pose: standard deviation of the initial joint angles, or of the pendulum's initial lean [rad], at most 1.
    """

    pose: Pose = 0.002


class Disturbance(Strict):
    """How the world differs from what the controllers believe; they are not told.

    Attributes:
        mass_scale: true mass of every body / its mass in the robot's file, from 0.1 to 10.
        friction: sliding friction of the floor, from 1e-4 to 10; None is the floor's own.
    """

    mass_scale: MassScale = 1.0
    friction: Friction | None = None

    @model_validator(mode="before")
    @classmethod
    def _moved(cls, fields: Any) -> Any:
        """Tell where a field has gone; files of former runs say all of them, most of them 0."""
        if not isinstance(fields, dict):
            return fields
        for name, place in MOVED.items():
            if fields.get(name, 0) != 0:
                raise conflict(name, f"{fields[name]!r} is not allowed; it is {place} now")
        return {name: value for name, value in fields.items() if name not in MOVED}


MOVED = {
    "delay": "sensing.latency",
    "noise_position": "sensing.state_noise.position",
    "noise_velocity": "sensing.state_noise.velocity",
}
"""Former fields of `Disturbance` -> where they are now."""


class Body(Strict):
    """Seeded errors of the true body, and of the floor, beside what the robot's file says; nobody is told.

    Each figure is the standard deviation of what is drawn once an episode; a share is that of the logarithm.

    Attributes:
        scale: all figures are multiplied by it, from 0 for none, which is the default, to 10.
        mass: share of each link's mass and inertia, at most 0.5.
        com: each link's centre of mass, along each axis [m], at most 0.1.
        joint_friction: share of each joint's dry and viscous friction, at most 0.5.
        motor: share of each motor's constant, and so of its torque, at most 0.5.
        floor_friction: share of the floor's sliding friction, at most 0.5.
    """

    scale: BodyError = 0.0
    mass: _Share = 0.05
    com: Annotated[NotNegative, Field(le=0.1)] = 0.002
    joint_friction: _Share = 0.3
    motor: _Share = 0.05
    floor_friction: _Share = 0.1

    @model_validator(mode="after")
    def _is_scaled(self) -> Self:
        if self.model_fields_set and "scale" not in self.model_fields_set:
            raise conflict(min(self.model_fields_set), "is multiplied by scale, which is 0; give scale, too, say 1.0")
        return self


class Judge(Strict):
    """What counts as recovered.

    Attributes:
        rest: "still": no step is under way and the COG is slower than 0.05 m/s; "upright": it may march in place, and
            the COG has moved by less than 0.1 m in the last second.
    """

    rest: Literal["still", "upright"] = "still"


class Scenario(Strict):
    """One experiment.

    Attributes:
        description: one line.
        robot: name of a file of `models/`, or a path to an `.xml` file.
        world: what is simulated.
        controller: who answers the pushes: a name of `controllers.registry.CONTROLLERS`, `path/to/file.py:Class`, or
            a table of either as `name` with the class's own options.
        whole_body: how the balance command becomes joint targets, named likewise by `controllers.registry.LAYERS`.
        duration: length of the episode [s], from one control period to 3600.
        seed: of everything that is drawn; below 2^63, as whole numbers in TOML are.
        timing, gain, stepping, variation, disturbance, sensing, body, judge, pushes: see there; the pushes in the order
            in which they begin. Those that overlap in time act all at once.
    """

    description: str = Field(min_length=1, pattern=r"^[^\n]*$")
    robot: str = Field(default="utmu2", min_length=1)
    world: World = "humanoid"
    controller: ControllerChoice = Choice(name="supervisor")
    whole_body: LayerChoice = Choice(name="dynamics")
    duration: float = Field(default=15.0, gt=0, le=LONGEST)
    seed: Seed = 0
    timing: Timing = Timing()
    gain: GainOptions = DcmGain()
    stepping: Stepping = Stepping()
    variation: Variation = Variation()
    disturbance: Disturbance = Disturbance()
    sensing: Sensing = Sensing()
    body: Body = Body()
    judge: Judge = Judge()
    pushes: Annotated[tuple[Push, ...], Field(strict=False)] = ()

    @model_validator(mode="after")
    def _lasts_a_tick(self) -> Self:
        if self.duration < self.timing.control:
            raise conflict("duration", f"{self.duration!r} s is less than a control period, {self.timing.control!r} s")
        return self

    @model_validator(mode="after")
    def _pushes_fit(self) -> Self:
        for i, (before, push) in enumerate(pairwise(self.pushes), start=1):
            if push.start < before.start:
                raise conflict(
                    f"pushes[{i}].start",
                    f"{push.start!r} s is before the start of pushes[{i - 1}], {before.start:g} s; "
                    "pushes come in the order in which they begin",
                )
        last = max((push.end for push in self.pushes), default=-math.inf)
        if self.duration <= last:
            raise conflict("duration", f"{self.duration!r} s must be beyond the end of the last push, {last:g} s")
        return self

    @model_validator(mode="after")
    def _world_fits(self) -> Self:
        if self.world == "pendulum" and self.disturbance.friction is not None:
            raise conflict("disturbance.friction", "the pendulum's feet have none; it must not be given")
        if self.world == "pendulum" and self.body.scale:
            raise conflict("body.scale", f"{self.body.scale!r} is not allowed; the pendulum has no links and no joints")
        timing = self.timing
        self.sensing.check(physics=timing.physics, control=timing.control, has_body=self.world == "humanoid")
        return self

    @property
    def ticks(self) -> int:
        """Control periods in the episode."""
        return math.ceil(snap(self.duration / self.timing.control))

    @property
    def apart(self) -> tuple[int, ...]:
        """Indices of the pushes that a trace tells one by one: torques, and all that share a control period."""
        control, found, beyond = self.timing.control, set[int](), 0
        longest = 0
        for i, push in enumerate(self.pushes):
            if push.torque is not None:
                found.add(i)
            if math.floor(snap(push.start / control)) < beyond:
                found |= {i, longest}
            if (ends := math.ceil(snap(push.end / control))) > beyond:
                beyond, longest = ends, i
        return tuple(sorted(found))

    def as_dict(self) -> dict[str, Any]:
        """Every field as it is run, of types that TOML and JSON know."""
        return self.model_dump(mode="json", exclude_none=True)
