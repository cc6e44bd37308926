"""What a scenario may say of the robot's senses: sensors with their errors, who estimates the state, and the drives."""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from controllers.fields import NotNegative, Strict, conflict, snap
from scenarios.choice import Choice, EstimatorChoice

TRUTH = "truth"
"""Name of the estimator that is none: the controllers get the true state."""
Preset = Literal["exact", "ideal", "typical", "cheap"]
Latency = Annotated[NotNegative, Field(le=1)]
PositionNoise = Annotated[NotNegative, Field(le=1)]
VelocityNoise = Annotated[NotNegative, Field(le=10)]
_Rate = Annotated[float, Field(gt=0, le=1e5)]
_Angle = Annotated[NotNegative, Field(le=1)]
_Motion = Annotated[NotNegative, Field(le=100)]
_Range = Annotated[float, Field(gt=0, le=1e5)]


class _Figures(Strict):
    """Figures of sensors; those that are not given are the preset's, and a file keeps those alone that are."""

    @model_serializer(mode="wrap")
    def _given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {name: value for name, value in handler(self).items() if name in self.model_fields_set}

    def over(self, preset: Self) -> Self:
        """The preset with what is given in its place."""
        return preset.model_copy(update={name: getattr(self, name) for name in self.model_fields_set})


class JointSensors(_Figures):
    """The encoders at the joints.

    Attributes:
        counts: in a turn of the joint; 0 for an angle that is not rounded.
        offset: standard deviation of each joint's constant error [rad].
        rate: [Hz]; None for every physics step. A preset's is taken as near as the physics' steps allow.
    """

    counts: int = Field(default=0, ge=0, le=2**32)
    offset: _Angle = 0.0
    rate: _Rate | None = None


class Imu(_Figures):
    """The inertial measurement unit in the trunk; all is for each axis.

    Attributes:
        gyro_noise: standard deviation of the white noise of a sample [rad/s].
        gyro_bias: standard deviation of the constant error [rad/s].
        gyro_range: what it can measure, to either side [rad/s]; None for all.
        accelerometer_noise, accelerometer_bias, accelerometer_range: the same [m/s^2].
        rate: [Hz]; None for every physics step. A preset's is taken as near as the physics' steps allow.
    """

    gyro_noise: _Motion = 0.0
    gyro_bias: _Motion = 0.0
    gyro_range: _Range | None = None
    accelerometer_noise: _Motion = 0.0
    accelerometer_bias: _Motion = 0.0
    accelerometer_range: _Range | None = None
    rate: _Rate | None = None


class FootSensors(_Figures):
    """The force sensors under the soles.

    Attributes:
        force_noise: standard deviation of the white noise of the normal force [N].
        scale_error: standard deviation of each foot's constant share of error, at most 0.5.
        cop_noise: standard deviation of the centre of pressure along each axis, under half the robot's weight [m];
            it grows as the load lessens.
        least_force: below it there is no centre of pressure [N].
        rate: [Hz]; None for every physics step. A preset's is taken as near as the physics' steps allow.
    """

    force_noise: _Motion = 0.0
    scale_error: Annotated[NotNegative, Field(le=0.5)] = 0.0
    cop_noise: Annotated[NotNegative, Field(le=1)] = 0.0
    least_force: Annotated[float, Field(gt=0, le=1e3)] = 1.0
    rate: _Rate | None = None


class StateNoise(Strict):
    """White noise on the true state, for senses without sensors and estimator; each tick and component.

    Attributes:
        position: standard deviation, of the COG [m], at most 1.
        velocity: the same of its velocity [m/s], at most 10.
    """

    position: PositionNoise = 0.0
    velocity: VelocityNoise = 0.0


BUS = 1000.0
"""How often the sensors of "typical" and "cheap" are read [Hz]: their noise is that of a sample at this rate."""
JOINT_PRESETS = MappingProxyType(
    {
        "exact": JointSensors(),
        "ideal": JointSensors(),
        "typical": JointSensors(counts=2**18, rate=BUS),
        "cheap": JointSensors(counts=2**14, offset=1e-3, rate=BUS),
    }
)
"""Typical: a magnetic ring at the joint's output, such as RLS AksIM (to 20 bits; 18 taken), zeroed on a jig. Cheap: a
magnet on the shaft's end, such as ams AS5048A (14 bits), zeroed by hand."""
IMU_PRESETS = MappingProxyType(
    {
        "exact": Imu(),
        "ideal": Imu(),
        "typical": Imu(
            gyro_noise=0.005,
            gyro_bias=0.003,
            gyro_range=34.9,
            accelerometer_noise=0.05,
            accelerometer_bias=0.05,
            accelerometer_range=235.0,
            rate=BUS,
        ),
        "cheap": Imu(
            gyro_noise=0.015,
            gyro_bias=0.01,
            gyro_range=34.9,
            accelerometer_noise=0.15,
            accelerometer_bias=0.15,
            accelerometer_range=157.0,
            rate=BUS,
        ),
    }
)
"""Typical: a vibration-robust MEMS unit such as Bosch BMI088: 0.014 deg/s/sqrt(Hz) over 523 Hz are 5.6 mrad/s, and
175 ug/sqrt(Hz) over 280 Hz are 0.03 m/s^2, taken as 0.05 for a trunk with motors; 2000 deg/s, 24 g. Cheap: a hobby
unit such as InvenSense MPU-6050: 400 ug/sqrt(Hz) over 260 Hz are 0.06 m/s^2, its gyro's 0.005 deg/s/sqrt(Hz) is no
worse, but both move by 20 deg/s and 35 mg with the temperature; three times the typical figures are taken, for a
board that is glued on; 2000 deg/s, 16 g. The biases are what a still calibration at the start leaves."""
FOOT_PRESETS = MappingProxyType(
    {
        "exact": FootSensors(),
        "ideal": FootSensors(),
        "typical": FootSensors(force_noise=0.5, scale_error=0.03, cop_noise=0.001, least_force=2.0, rate=BUS),
        "cheap": FootSensors(force_noise=2.0, scale_error=0.1, cop_noise=0.003, least_force=5.0, rate=BUS),
    }
)
"""Typical: strain-gauge cells under each sole; 0.5 N, 3 % and 1 mm are our guess for feet of 3 kg load. Cheap: four
thick-film sensors under each sole, such as Tekscan FlexiForce A201, whose linearity is 3 %, repeatability 2.5 % and
hysteresis 4.5 % of full scale."""


class Sensing(Strict):
    """What the controllers perceive, and how the drives close their loops.

    Attributes:
        preset: "exact": the true state; "ideal": sensors without errors, of which an estimator makes the state;
            "typical" and "cheap" sensors, see `JOINT_PRESETS`, `IMU_PRESETS` and `FOOT_PRESETS`.
        latency: age of all that arrives [s], a whole multiple of the physics step, at most 1.
        joint, imu, foot: figures that replace the preset's.
        state_noise: of the true state; it does not go with an estimator.
        estimator: who makes a state of the readings, named by `controllers.registry.ESTIMATORS` as a controller is;
            None for "truth", the state as it is, if the preset is "exact", else "ekf".
        servo: what a reference "where I see the joint" means to the drive: "drive": where its own encoder finds it
            when the reference arrives; "state": the number as it is, which is late by the latency. None for "state"
            if the preset is "exact", else "drive".
    """

    preset: Preset = "exact"
    latency: Latency = 0.0
    joint: JointSensors = JointSensors()
    imu: Imu = Imu()
    foot: FootSensors = FootSensors()
    state_noise: StateNoise = StateNoise()
    estimator: EstimatorChoice | None = None
    servo: Literal["drive", "state"] | None = None

    @model_serializer(mode="wrap")
    def _without_empty_tables(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {name: value for name, value in handler(self).items() if value != {}}

    @property
    def who(self) -> Choice:
        """The estimator that there is."""
        return self.estimator or Choice(name=TRUTH if self.preset == "exact" else "ekf")

    @property
    def estimates(self) -> bool:
        """Whether there are sensors, and somebody who makes a state of what they say."""
        return self.who.name != TRUTH

    @property
    def is_true(self) -> bool:
        """Whether the controllers see the state as it is."""
        return not (self.estimates or self.latency or self.state_noise != StateNoise())

    @property
    def at_drive(self) -> bool:
        """Whether references are taken from where the drive finds the joint."""
        return (self.servo or ("state" if self.preset == "exact" else "drive")) == "drive"

    @property
    def words(self) -> str:
        """In short: "typical sensors by ekf, 4 ms late"."""
        late = f", {1e3 * self.latency:g} ms late" if self.latency else ""
        noise = "" if self.state_noise == StateNoise() else " with noise"
        return (f"{self.preset} sensors by {self.who.short}" if self.estimates else f"true state{noise}") + late

    @property
    def joint_figures(self) -> JointSensors:
        """Those of the encoders, with the preset's."""
        return self.joint.over(JOINT_PRESETS[self.preset])

    @property
    def imu_figures(self) -> Imu:
        """Those of the IMU, with the preset's."""
        return self.imu.over(IMU_PRESETS[self.preset])

    @property
    def foot_figures(self) -> FootSensors:
        """Those of the soles, with the preset's."""
        return self.foot.over(FOOT_PRESETS[self.preset])

    def as_run(self, physics: float) -> dict[str, Any]:
        """Every figure with the preset's filled in, and the rates that come of a physics step [s]; of JSON types."""
        figures = {"joint": self.joint_figures, "imu": self.imu_figures, "foot": self.foot_figures}
        filled = {
            table: {name: getattr(found, name) for name in type(found).model_fields} for table, found in figures.items()
        }
        for found in filled.values():
            found["rate"] = 1.0 / (steps_between(found["rate"], physics) * physics)
        return {
            **self.model_dump(mode="json", exclude_none=True),
            **(filled if self.estimates else {}),
            "estimator": self.who.model_dump(mode="json"),
            "servo": "drive" if self.at_drive else "state",
        }

    def check(self, *, physics: float, control: float, has_body: bool) -> None:
        """Check what the rest of the scenario decides.

        Args:
            physics, control: periods [s].
            has_body: whether there is a robot with joints, and not a pendulum.

        Raises:
            PydanticCustomError: if a time is no whole number of steps, or something does not go with something.
        """
        step, name = (physics, "physics step") if has_body else (control, "control period")
        if not _is_whole(self.latency / step):
            raise conflict("sensing.latency", f"{self.latency!r} s must be a whole multiple of the {name}, {step!r} s")
        if not has_body and (self.preset != "exact" or self.estimates or self.at_drive):
            raise conflict("sensing", "the pendulum has no sensors and no drives; give latency and state_noise only")
        if self.preset != "exact" and not self.estimates:
            raise conflict(
                "sensing.preset",
                f"{self.preset!r} is of sensors, which the estimator 'truth' does not read; leave one of them out "
                '(servo = "drive" alone is what drives need)',
            )
        for table in ("joint", "imu", "foot"):
            figures = getattr(self, table)
            if not self.estimates and figures.model_fields_set:
                field = min(figures.model_fields_set)
                raise conflict(f"sensing.{table}.{field}", "is of a sensor, which the estimator 'truth' does not read")
            if figures.rate is not None and not _is_whole(1.0 / (figures.rate * physics), least=1):
                raise conflict(
                    f"sensing.{table}.rate",
                    f"{figures.rate!r} Hz must be the physics' {1 / physics:g} Hz / 1, 2, 3, ...",
                )
        if self.estimates and self.state_noise != StateNoise():
            raise conflict("sensing.state_noise", "is of the true state, which an estimator does not see; leave it out")


def steps_between(rate: float | None, physics: float) -> int:
    """Physics steps [s] from one sample to the next; at least one, for nothing is measured between two."""
    return 1 if rate is None else max(1, round(1.0 / (rate * physics)))


def _is_whole(steps: float, least: int = 0) -> bool:
    return snap(steps) == round(steps) >= least
