"""Options that several controllers share: the feedback gain and how to step. Scenario files hold them as tables."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, field_validator

from controllers import gains
from controllers.fields import NotNegative, Strict, snap
from controllers.gains import Gain
from controllers.pendulum import Pendulum
from models.robot import Robot


class DcmGain(Strict):
    """Feedback of the divergent component of motion: u - u_C = k (x - x_C + xd / omega).

    Attributes:
        k: gain [1]; above 1, or the DCM diverges; at most 1e4, and what the control period allows.
    """

    kind: Literal["dcm"] = "dcm"
    k: float = Field(default=1.5, gt=1, le=1e4)

    def of(self, pendulum: Pendulum) -> Gain:
        """The feedback F of a pendulum."""
        return gains.dcm(pendulum, self.k)


_Weight = Annotated[float, Field(ge=1e-6, le=1e9)]


class LqrGain(Strict):
    """F of the linear-quadratic regulator.

    Attributes:
        q: weights of position [1/m^2], from 1e-6 to 1e9, and velocity [s^2/m^2], at most 1e9.
        r: weight of the ZMP [1/m^2], from 1e-6 to 1e9; only the weights' ratios count.
    """

    kind: Literal["lqr"]
    q: Annotated[tuple[_Weight, Annotated[float, Field(ge=0, le=1e9)]], Field(strict=False)]
    r: _Weight

    def of(self, pendulum: Pendulum) -> Gain:
        """The feedback F of a pendulum."""
        return gains.lqr(pendulum, self.q, self.r)


def _as_pair(pole: Any) -> Any:
    return (pole, 0.0) if isinstance(pole, int | float) and not isinstance(pole, bool) else pole


_Part = Annotated[float, Field(ge=-1e4, le=1e4)]
Pole = Annotated[tuple[_Part, _Part], Field(strict=False), BeforeValidator(_as_pair)]


class PolesGain(Strict):
    """F by pole placement.

    Attributes:
        poles: two continuous poles [1/s], each a real number or [real, imaginary]; negative real parts;
            no part beyond 1e4, ten times what the shortest control period can follow.
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

    def of(self, pendulum: Pendulum) -> Gain:
        """The feedback F of a pendulum."""
        return gains.poles(pendulum, (complex(*self.poles[0]), complex(*self.poles[1])))


def _gain_kind(gain: Any) -> Any:
    return gain.get("kind", "dcm") if isinstance(gain, dict) else getattr(gain, "kind", None)


GainOptions = Annotated[
    Annotated[DcmGain, Tag("dcm")] | Annotated[LqrGain, Tag("lqr")] | Annotated[PolesGain, Tag("poles")],
    Discriminator(_gain_kind),
]


STEP_TIMES = (0.12, 0.15, 0.18)
"""Durations of a step for legs that swing as those of `utmu2` [s]."""
_DIGITS = 9
_StepTime = Annotated[float, Field(gt=0, le=1)]
_Length = Annotated[float, Field(ge=1e-3, le=10)]


class Stepping(Strict):
    """How the robot steps.

    Attributes:
        rule: "sets" decides by the N-step MOA sets, "polygon" by the capture point and the feet's hull alone.
        step_times: durations of a step to choose among [s], whole control periods, at most ten of at most 1 s, over
            which the DCM of a robot of this size grows 400-fold; "polygon" takes the first. None for 0.12, 0.15 and
            0.18 s, times the `swing` of the robot's scale.
        max_steps: most steps that the sets look ahead; 1 also means that no step follows another at once.
        zmp_margin: distance that the ZMP keeps from the edges of the stance sole [m], below half its width.
        zmp_error: largest error of the realised ZMP along each axis [m] that all sets withstand.
        max_stride: longest way of a foot from beside the other one [m], from 0.001 to the length of the legs.
        swing_height: highest point of the swing foot's sole over the floor [m], from 0.001 to the length of the legs.
        replan: whether foothold and ZMP are chosen anew at every tick; else the foothold stays that of the lift-off.
        early_trigger: how far ahead the DCM is extrapolated to see whether a step will be needed [s], at most 1; 0 not.
        steady_trigger: whether that looks the less far, the noisier the DCM's rate is.
        angular_momentum: whether the spin of the body counts as part of the state that the sets are asked for.
    """

    rule: Literal["sets", "polygon"] = "sets"
    step_times: Annotated[tuple[_StepTime, ...], Field(strict=False, min_length=1, max_length=10)] | None = None
    max_steps: int = Field(default=8, ge=1, le=20)
    zmp_margin: NotNegative = 0.008
    zmp_error: NotNegative = 0.0
    max_stride: _Length = 0.28
    swing_height: _Length = 0.025
    replan: bool = True
    early_trigger: float = Field(default=0.1, ge=0, le=1)
    steady_trigger: bool = True
    angular_momentum: bool = True

    def times(self, robot: Robot, dt: float) -> tuple[float, ...]:
        """Durations of a step to choose among [s]: those asked for, or what the robot's legs are good for.

        Args:
            robot: whose legs.
            dt: control period [s]; what is not asked for is made a whole multiple of it.
        """
        if self.step_times is not None:
            return self.step_times
        ticks = (max(1, round(snap(time * robot.scale.swing / dt))) for time in STEP_TIMES)
        return tuple(dict.fromkeys(round(tick * dt, _DIGITS) for tick in ticks))
