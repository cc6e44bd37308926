"""What flows between the stages: one small frozen value an arrow.

    world -> Observation -> balance controller -> BalanceCommand -> whole-body layer -> JointTargets -> world

Lengths in metres, world frame (x forward, y left, z up), SI units throughout.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from controllers.geometry.polytope import Polytope
    from models.robot import Robot, Side

Array = NDArray[np.float64]

_STILL = np.zeros(3)
_STILL.setflags(write=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class FootState:
    """Where a sole is and what it carries.

    Attributes:
        position: (3,) middle of the sole's lower face [m].
        yaw: heading of the sole [rad].
        force: normal force from the floor [N]; 0 in the air.
    """

    position: Array
    yaw: float
    force: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """What the controllers see at the start of a control tick.

    Attributes:
        time: [s].
        cog: (3,) centre of gravity [m].
        cog_velocity: (3,) [m/s].
        angular_momentum: (3,) about the COG [N m s]; zero in the pendulum world, whose mass is a point.
        zmp: (2,) measured ZMP [m]; NaN without floor contact.
        feet: state of either foot.
        configuration: (7 + n,) base position [m], base quaternion (w x y z), joint angles [rad];
            empty in the pendulum world.
        velocity: (6 + n,) base linear velocity in the world [m/s], base angular velocity in the base [rad/s],
            joint velocities [rad/s]; empty in the pendulum world.
    """

    time: float
    cog: Array
    cog_velocity: Array
    angular_momentum: Array
    zmp: Array
    feet: dict[Side, FootState]
    configuration: Array
    velocity: Array

    def balance_state(self) -> Array:
        """State x = [x_G, xd_G, y_G, yd_G] of the pendulum, (4)."""
        # Plain floats: an array of numpy's scalars takes three times as long, and every tick asks.
        (x, y, _), (vx, vy, _) = self.cog.tolist(), self.cog_velocity.tolist()
        return np.array([x, vx, y, vy])


@dataclass(frozen=True, slots=True, kw_only=True)
class FootReference:
    """What a foot should do.

    Attributes:
        stance: True if the foot is to carry weight; then the rest is ignored but for `yaw`.
        position, velocity, acceleration: (3,) of the sole's middle [m, m/s, m/s^2].
        yaw: [rad].
        feedback: whether the acceleration was found from where the foot is seen, so that nothing is to be added to it.
    """

    stance: bool
    position: Array
    velocity: Array
    acceleration: Array
    yaw: float
    feedback: bool = False

    @classmethod
    def standing(cls, foot: FootState, yaw: float) -> FootReference:
        """A foot that stays where it is and carries weight, turned to `yaw` [rad]."""
        return cls(stance=True, position=foot.position, velocity=_STILL, acceleration=_STILL, yaw=yaw)


class Phase(Enum):
    """Whether a controller stands on both feet or has a step under way; the value is the code in the trace."""

    STANDING = 0
    STEPPING = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class BalanceCommand:
    """What the balance controllers ask of the body.

    Attributes:
        zmp: (2,) ZMP command u, (5) [m].
        feet: reference of either foot.
        stepping: whether a step is under way, so that the robot is not at rest yet; None means while a foot is lifted.
    """

    zmp: Array
    feet: dict[Side, FootReference]
    stepping: bool | None = None

    @property
    def phase(self) -> Phase:
        """Standing or stepping."""
        if self.stepping is None:
            both = self.feet["left"].stance and self.feet["right"].stance
            return Phase.STANDING if both else Phase.STEPPING
        return Phase.STEPPING if self.stepping else Phase.STANDING


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTargets:
    """What the servos get.

    Attributes:
        position, velocity, torque: (n,) of the joints [rad], [rad/s], and of the feed-forward [N m].
        stiffness, damping: (n,) gains of the servos [N m/rad], [N m s/rad]; None for those of the robot's file.
        solver_failed: the whole-body solver found no answer in this tick, and the last torque was kept.
        from_seen: position and velocity are meant relative to those that were seen, with no goal of their own.
    """

    position: Array
    velocity: Array
    torque: Array
    stiffness: Array | None = None
    damping: Array | None = None
    solver_failed: bool = False
    from_seen: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A tracker that was considered: its name, and its set's slack [m of ZMP; N steps of feet at rest: of DCM]."""

    name: str
    slack: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A choice of the supervisor and its grounds; recorded whenever the phase or the plan changes.

    Attributes:
        time: [s].
        phase: standing or stepping, from now on.
        reason: why, in words.
        regulator_slack: signed slack of the regulator's set [m of ZMP].
        tracking_slack: the same of the chosen (or present) tracking set [m of ZMP; N steps: of DCM]; NaN if none.
        in_regulator_set, in_tracking_set: membership of the state, by these slacks.
        outside_all: no set contained the state, the least violated was taken.
        candidates: the trackers that were considered.
        plan: name of the tracker's plan; empty for the regulator.
        tight: the constraint that is nearest to being violated, in words.
    """

    time: float
    phase: Phase
    reason: str
    regulator_slack: float
    tracking_slack: float = math.nan
    in_regulator_set: bool = field(init=False)
    in_tracking_set: bool = field(init=False)
    outside_all: bool = field(init=False)
    candidates: tuple[Candidate, ...] = ()
    plan: str = ""
    tight: str = ""

    def __post_init__(self) -> None:
        # A slack of NaN is of no set: nothing is in it. Who has no regulator's set is not outside of all either.
        object.__setattr__(self, "in_regulator_set", self.regulator_slack >= 0.0)
        object.__setattr__(self, "in_tracking_set", self.tracking_slack >= 0.0)
        object.__setattr__(self, "outside_all", self.regulator_slack < 0.0 and not self.in_tracking_set)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What a controller's sets say of the state of the last tick: how far inside them it is.

    Attributes:
        standing: signed slack in the set of standing [m]; NaN if it cannot be asked now, None if there is no such set.
        stepping: the same for the set of the steps to come.
    """

    standing: float | None
    stepping: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Region:
    """A set of states that a controller decides by, for drawing.

    Attributes:
        name: "regulator" for standing, "tracking" for steps.
        states: of x = [x_G, xd_G, y_G, yd_G], (4,) in the world [m, m/s].
        centre: (2,) what the robot stands about [m].
    """

    name: Literal["regulator", "tracking"]
    centre: Array
    states: Polytope


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What a balance controller is built for.

    Attributes:
        robot: whom it balances.
        dt: control period [s].
        layer: class of the whole-body layer that carries its commands out; None for the pendulum, which needs none.
    """

    robot: Robot
    dt: float
    layer: Any = None


class BalanceController(Protocol):
    """A balance controller: `Class(setting, options)`. Your own needs no more than `command`.

    These it may have beside it: a class `Options` (a `controllers.fields.Strict`), `reset()`, which forgets the last
    episode, `decisions`, a list of `Decision`, and what `Predictor` and `Regional` ask for; as attributes of the class
    a `label`, a `colour` and a `marker` for tables and figures, and `layer`, the name of the whole-body layer that it
    needs instead of the scenario's.
    """

    def command(self, observation: Observation) -> BalanceCommand:
        """One control tick: what the body shall do, given what is seen."""


class JointController(Protocol):
    """A controller at joint level, for instance a trained policy: `Class(setting, options)`.

    It takes the place of everything from the supervisor to the servos, so that no whole-body layer is built. It is
    named like a balance controller, and may have the same members beside; a method `reset(seed)` begins an episode.

    Attributes:
        period: time from one question to the next, a whole multiple of the control period [s].
    """

    period: float

    def targets(self, observation: Observation) -> JointTargets:
        """What the servos shall hold until the next question, given what is seen."""


@runtime_checkable
class Predictor(Protocol):
    """A controller that lives by sets, whose word is recorded and scored."""

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state in the sets of standing and of the steps under way; NaN for none."""

    def predict(self) -> Prediction:
        """What the sets foretell in the last tick's state, with the steps that could be begun."""


@runtime_checkable
class Regional(Protocol):
    """A controller whose sets can be drawn."""

    def regions(self, x: Array) -> tuple[Region, ...]:
        """The sets that matter in a state x (4,)."""


class WholeBodyLayer(Protocol):
    """Turns what the balance controller wants into what the servos get: `Class(robot, dt, options)`.

    With `follows_acceleration = True` its class says that it gives a swing foot the acceleration that is asked for,
    so that the foot may be steered by feedback; else the foot is sent from place to place.
    """

    def reset(self) -> None:
        """Forget the last episode."""

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """Joint targets that realise a ZMP command and foot references from the measured state."""
