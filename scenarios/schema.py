"""What a scenario file may say: every field, its unit, its default and what is allowed."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, field_validator, model_validator

from controllers.fields import WHOLE, NotNegative, Positive, Strict, conflict, snap
from scenarios.push import Push

World = Literal["humanoid", "pendulum"]
Controller = Literal["supervisor", "paper", "regulator", "statue"]
WholeBody = Literal["dynamics", "ik"]


class Timing(Strict):
    """Periods of the two loops.

    Attributes:
        physics: step of the physics [s].
        control: period of the controller [s], a whole multiple of `physics`.
    """

    physics: Positive = 0.001
    control: Positive = 0.002

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


class DcmGain(Strict):
    """Feedback of the divergent component of motion: u - u_C = k (x - x_C + xd / omega).

    Attributes:
        k: gain [1]; above 1, or the DCM diverges.
    """

    kind: Literal["dcm"] = "dcm"
    k: float = Field(default=1.5, gt=1)


class LqrGain(Strict):
    """F of the linear-quadratic regulator.

    Attributes:
        q: weights of position [1/m^2] and velocity [s^2/m^2].
        r: weight of the ZMP [1/m^2].
    """

    kind: Literal["lqr"]
    q: Annotated[tuple[Positive, NotNegative], Field(strict=False)]
    r: Positive


def _as_pair(pole: Any) -> Any:
    return (pole, 0.0) if isinstance(pole, int | float) and not isinstance(pole, bool) else pole


Pole = Annotated[tuple[float, float], Field(strict=False), BeforeValidator(_as_pair)]


class PolesGain(Strict):
    """F by pole placement.

    Attributes:
        poles: two continuous poles [1/s], each a real number or [real, imaginary]; negative real parts.
    """

    kind: Literal["poles"]
    poles: Annotated[tuple[Pole, Pole], Field(strict=False)]

    @field_validator("poles")
    @classmethod
    def _stable_and_real(cls, poles: tuple[Pole, Pole]) -> tuple[Pole, Pole]:
        (first, second) = (complex(*pole) for pole in poles)
        if first.real >= 0 or second.real >= 0:
            raise ValueError("the real parts must be negative")
        if (first.imag or second.imag) and first != second.conjugate():
            raise ValueError("must be two real poles or a conjugate pair [[re, im], [re, -im]]")
        return poles

    @property
    def values(self) -> tuple[complex, complex]:
        """The poles [1/s]."""
        return complex(*self.poles[0]), complex(*self.poles[1])


def _gain_kind(gain: Any) -> Any:
    return gain.get("kind", "dcm") if isinstance(gain, dict) else getattr(gain, "kind", None)


Gain = Annotated[
    Annotated[DcmGain, Tag("dcm")] | Annotated[LqrGain, Tag("lqr")] | Annotated[PolesGain, Tag("poles")],
    Discriminator(_gain_kind),
]


class Stepping(Strict):
    """How the robot steps.

    Attributes:
        rule: "sets" decides by the N-step MOA sets, "polygon" by the capture point and the feet's hull alone.
        step_times: durations of a step to choose among [s], whole control periods; "polygon" takes the first.
        max_steps: most steps that the sets look ahead; 1 also means that no step follows another at once.
        zmp_margin: distance that the ZMP keeps from the edges of the stance sole [m].
        max_stride: longest way of a foot from beside the other one [m].
        swing_height: highest point of the swing foot's sole over the floor [m].
        replan: whether foothold and ZMP are chosen anew at every tick; else the foothold stays that of the lift-off.
        early_trigger: how far ahead the DCM is extrapolated to see whether a step will be needed [s]; 0 not at all.
        angular_momentum: whether the spin of the body counts as part of the state that the sets are asked for.
    """

    rule: Literal["sets", "polygon"] = "sets"
    step_times: Annotated[tuple[Positive, ...], Field(strict=False, min_length=1)] = (0.12, 0.15, 0.18)
    max_steps: int = Field(default=8, ge=1, le=20)
    zmp_margin: NotNegative = 0.008
    max_stride: Positive = 0.28
    swing_height: Positive = 0.025
    replan: bool = True
    early_trigger: NotNegative = 0.1
    angular_momentum: bool = True


class Variation(Strict):
    """What the seed draws.

    Attributes:
        pose: standard deviation of the initial joint angles, or of the pendulum's initial lean [rad].
    """

    pose: NotNegative = 0.002


class Disturbance(Strict):
    """How the world differs from what the controllers believe; they are not told.

    Attributes:
        mass_scale: true mass of every body / its mass in the robot's file.
        friction: sliding friction of the floor; None is the floor's own.
        delay: age of all that the controllers see [s], a whole multiple of the control period.
        noise_position: standard deviation of the noise on the COG that they see [m], each tick and component.
        noise_velocity: the same of the COG's velocity [m/s].
    """

    mass_scale: Positive = 1.0
    friction: Positive | None = None
    delay: NotNegative = 0.0
    noise_position: NotNegative = 0.0
    noise_velocity: NotNegative = 0.0


class Scenario(Strict):
    """One experiment.

    Attributes:
        description: one line.
        robot: name of a file of `models/`, or a path to an `.xml` file.
        world: what is simulated.
        controller: who answers the pushes: "paper" by one fixed stepping reference; "regulator" and "statue" never
            step.
        whole_body: how the balance command becomes joint targets.
        duration: length of the episode [s].
        seed: of everything that is drawn.
        timing, gain, stepping, variation, disturbance, pushes: see there; the pushes in order of time, no two in
            one control period.
    """

    description: str = Field(min_length=1, pattern=r"^[^\n]*$")
    robot: str = Field(default="utmu2", min_length=1)
    world: World = "humanoid"
    controller: Controller = "supervisor"
    whole_body: WholeBody = "dynamics"
    duration: Positive = 15.0
    seed: int = Field(default=0, ge=0)
    timing: Timing = Timing()
    gain: Gain = DcmGain()
    stepping: Stepping = Stepping()
    variation: Variation = Variation()
    disturbance: Disturbance = Disturbance()
    pushes: Annotated[tuple[Push, ...], Field(strict=False)] = ()

    @model_validator(mode="after")
    def _pushes_fit(self) -> Self:
        # A tick of the trace holds the force and the point of one push.
        control = self.timing.control
        for i in range(1, len(self.pushes)):
            before, push = self.pushes[i - 1], self.pushes[i]
            if math.floor(snap(push.start / control)) < math.ceil(snap(before.end / control)):
                raise conflict(
                    f"pushes[{i}].start",
                    f"{push.start!r} s is not after the end of pushes[{i - 1}], {before.end:g} s; "
                    "pushes come in order of time, no two in one control period",
                )
        if self.pushes and self.duration <= self.pushes[-1].end:
            raise conflict(
                "duration", f"{self.duration!r} s must be beyond the end of the last push, {self.pushes[-1].end:g} s"
            )
        return self

    @model_validator(mode="after")
    def _disturbance_fits(self) -> Self:
        late, control = self.disturbance.delay, self.timing.control
        if not math.isclose(snap(late / control), round(late / control)):
            raise conflict(
                "disturbance.delay", f"{late!r} s must be a whole multiple of the control period, {control!r} s"
            )
        if self.world == "pendulum" and self.disturbance.friction is not None:
            raise conflict("disturbance.friction", "the pendulum's feet have none; it must not be given")
        return self

    @property
    def ticks(self) -> int:
        """Control periods in the episode."""
        return math.ceil(snap(self.duration / self.timing.control))

    def as_dict(self) -> dict[str, Any]:
        """Every field as it is run, of types that TOML and JSON know."""
        return self.model_dump(mode="json", exclude_none=True)
