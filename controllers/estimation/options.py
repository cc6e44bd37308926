"""Options of the estimator: how good it takes the sensors to be, and how it makes up for their latency."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from controllers.fields import NotNegative, Strict, conflict

Positive = Annotated[float, Field(gt=0)]
LOOK_AHEAD = 0.1
"""Latency that is made up for at most [s]: each tick simulates as many ticks again."""


class EkfOptions(Strict):
    """What `InvariantEkf` believes.

    What is None follows from the sensors, or from the robot; see `controllers.estimation.beliefs`.

    Attributes:
        encoder: standard deviation of an angle [rad].
        joint_acceleration: of the joints, which the speed's filter allows for [rad/s^2].
        gyro: noise of a sample [rad/s].
        accelerometer: noise of a sample, with what shakes the trunk between two [m/s^2].
        gyro_bias: of an episode [rad/s].
        accelerometer_bias: of an episode [m/s^2].
        gyro_drift: wandering of its bias [rad/s/sqrt(s)].
        accelerometer_drift: wandering of its bias [m/s^2/sqrt(s)].
        first_tilt: error of the attitude given at the start [rad].
        contact_load: share of the weight from which on a sole tells anything, and counts as standing.
        full_load: share of the weight from which on it tells as much as it can.
        contact_speed: of the point under a flat sole's centre of pressure [m/s].
        edge_speed: the same for a sole on its edge [m/s].
        outlier: speed of such a point in multiples of these from which on it is believed less.
        edge: how near to the edge the centre of pressure of a sole on its edge is at most [m].
        contact_height: of that point over the floor [m].
        sole_tilt: of a flat sole [rad].
        flat: how far from the edge the centre of pressure of a flat sole is [m].
        predictor: how the state now follows from that when the readings were taken: it is taken to be the same
            ("none"), the joints go on at their speed ("extrapolate"), or the nominal body is simulated with the
            targets that were sent meanwhile ("simulate").
        predicted: what is told of the state now: COG, COG velocity, angular momentum, load and the soles that carry it,
            with joints and other feet as they were measured ("balance"), or the whole body ("body"). The ZMP is always
            that of measured forces, and the load is measured, too, where the joints are extrapolated. If left out,
            "balance" while the drives were last told to take the joints as they see them themselves, for feet that are
            steered by where they were land better; else "body", for references would be late.
        latency: how old the readings are taken to be [s], at most `LOOK_AHEAD`; by their time stamps if left out.
        push_settling: time constant of the push observer [s], whose force the simulation applies; at least that from
            one state to the next is taken.
        push_threshold: force below which there is no push [N].
    """

    encoder: Positive | None = None
    joint_acceleration: Positive = 30.0
    gyro: Positive | None = None
    accelerometer: Positive | None = None
    gyro_bias: Positive | None = None
    accelerometer_bias: Positive | None = None
    gyro_drift: NotNegative = 1e-4
    accelerometer_drift: NotNegative = 1e-3
    first_tilt: Positive = 0.005
    contact_load: Annotated[float, Field(gt=0, lt=1)] = 0.1
    full_load: Annotated[float, Field(gt=0, lt=1)] = 0.25
    contact_speed: Positive | None = None
    edge_speed: Positive | None = None
    outlier: Positive = 2.5
    edge: NotNegative | None = None
    contact_height: Positive = 2e-3
    sole_tilt: Positive = 0.005
    flat: Positive | None = None
    predictor: Literal["none", "extrapolate", "simulate"] = "simulate"
    predicted: Literal["balance", "body"] | None = None
    latency: Annotated[NotNegative, Field(le=LOOK_AHEAD)] | None = None
    push_settling: Positive = 0.01
    push_threshold: NotNegative | None = None

    @model_validator(mode="after")
    def _takes_effect(self) -> Self:
        ahead, simulated = ("extrapolate", "simulate"), ("simulate",)
        only = {"predicted": ahead, "latency": ahead, "push_settling": simulated, "push_threshold": simulated}
        for field, predictors in only.items():
            if field in self.model_fields_set and getattr(self, field) is not None and self.predictor not in predictors:
                wanted = " or ".join(map(repr, predictors))
                raise conflict(field, f"does nothing with predictor {self.predictor!r}; it needs {wanted}")
        return self
