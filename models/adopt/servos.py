"""The motor of each joint: what the MJCF says of it, what its user says, and what has to be assumed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco

from models.adopt.source import Source
from models.errors import InputError

_BACK_EMF = (1.0, 60.0)
"""No-load speeds that motors of legged robots have [rad/s]."""
_STIFFNESS = 20.0
"""Gain of the servo by the rule, as a share of the stall torque [1/rad]: a twentieth of a radian takes all of it."""
_DAMPING_RATIO = 0.7
_OF_A_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


@dataclass(frozen=True, kw_only=True)
class Servo:
    """A joint's motor and its servo, at the joint.

    Attributes:
        joint: its name.
        torque: at standstill [N m].
        speed: without load [rad/s].
        stiffness, servo_damping: gains [N m/rad], [N m s/rad].
        armature: reflected inertia of the rotor [kg m^2].
        friction: dry friction [N m].
        damping: viscous friction [N m s/rad].
        assumed: what nobody says, in words; empty if all is known.
    """

    joint: str
    torque: float
    speed: float
    stiffness: float
    servo_damping: float
    armature: float
    friction: float
    damping: float
    assumed: str = ""


def read_servos(source: Source) -> list[Servo]:
    """The servos of all hinges, in the order of the configuration.

    Raises:
        InputError: if a joint has no motor, or no limit of its torque, and the hints do not say it either.
    """
    model = source.model
    source.hints.check_patterns("motors", [model.joint(j).name for j in range(1, model.njnt)], str(source.path))
    for i in range(model.nactuator):
        name = model.actuator(i).name
        what = f"the actuator {name!r}" if name else f"actuator {i}, which has no name,"
        if model.actuator_trntype[i] not in _OF_A_JOINT:
            raise InputError(f"{source.path}: {what} drives no joint; only motors of hinges are taken")
        if model.actuator_trnid[i, 0] == 0:
            source.notes.append(f"{what} pushes the floating root; it was left out")
    return [_servo(source, j) for j in range(1, model.njnt)]


def _servo(source: Source, joint: int) -> Servo:
    model, hints = source.model, source.hints
    name, dof = model.joint(joint).name, int(model.jnt_dofadr[joint])
    said = hints.motor(name)
    actuators = [i for i in range(model.nactuator) if model.actuator_trnid[i, 0] == joint]
    torque = said.torque or _torque_limit(model, joint, actuators)
    if torque is None:
        what = "no limit of its torque" if actuators else "no motor"
        raise InputError(
            f"{source.path}: the joint {name!r} has {what}; say it in robot.toml, [motors.{name}] torque = ..., or "
            f'take the joint out, weld = ["{name}"]'
        )
    damping, assumed = float(model.dof_damping[dof]), ""
    speed = said.speed or _no_load_speed(model, actuators)
    # A damping that eats the whole torque at a speed that motors do reach is the back-EMF, told in another way.
    is_back_emf = said.damping is None and damping > 0.0 and _BACK_EMF[0] < torque / damping < _BACK_EMF[1]
    if speed is None and is_back_emf and hints.servos == "rule":
        speed, damping = torque / damping, 0.0
    if speed is None:
        speed, assumed = hints.speed, f"no-load speed {hints.speed:g} rad/s"
    armature = float(model.dof_armature[dof]) if said.armature is None else said.armature
    friction = float(model.dof_frictionloss[dof]) if said.friction is None else said.friction
    stiffness = _STIFFNESS * torque
    servo_damping = 2 * _DAMPING_RATIO * math.sqrt(stiffness * (armature + _link_inertia(model, joint)))
    if hints.servos == "file":
        stiffness, servo_damping = _gains_of_file(source, name, actuators)
    return Servo(
        joint=name,
        torque=torque,
        speed=speed,
        stiffness=said.stiffness or stiffness,
        servo_damping=servo_damping if said.servo_damping is None else said.servo_damping,
        armature=armature,
        friction=friction,
        damping=damping if said.damping is None else said.damping,
        assumed=assumed,
    )


def _torque_limit(model: mujoco.MjModel, joint: int, actuators: list[int]) -> float | None:
    """The least torque at which something clips [N m]; None if nothing does."""
    limits = [float(model.jnt_actfrcrange[joint, 1])] if model.jnt_actfrclimited[joint] else []
    for i in actuators:
        gear = abs(float(model.actuator_gear[i, 0]))
        if model.actuator_forcelimited[i]:
            limits.append(gear * float(model.actuator_forcerange[i, 1]))
        control = int(model.actuator_ctrladr[i])
        is_motor = model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
        if (
            is_motor
            and model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
            and model.actuator_ctrllimited[control]
        ):
            limits.append(gear * abs(float(model.actuator_gainprm[i, 0] * model.actuator_ctrlrange[control, 1])))
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_DCMOTOR:
            resistance, constant, volts = model.actuator_gainprm[i, [0, 1, 7]]
            limits.append(gear * float(constant * volts / resistance))
    return min((limit for limit in limits if limit > 0.0), default=None)


def _no_load_speed(model: mujoco.MjModel, actuators: list[int]) -> float | None:
    """That of a <dcmotor> that knows its volts [rad/s], at the joint; None for other actuators."""
    for i in actuators:
        _, constant, volts = model.actuator_gainprm[i, [0, 1, 7]]
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_DCMOTOR and volts > 0.0:
            return float(volts / constant / abs(model.actuator_gear[i, 0]))
    return None


def _link_inertia(model: mujoco.MjModel, joint: int) -> float:
    """About the joint, of the link that it moves [kg m^2]."""
    body = int(model.jnt_bodyid[joint])
    arm = model.body_ipos[body]
    return float(model.body_mass[body] * (arm @ arm) + model.body_inertia[body].max())


def _gains_of_file(source: Source, joint: str, actuators: list[int]) -> tuple[float, float]:
    model = source.model
    for i in actuators:
        gear, stiffness = float(model.actuator_gear[i, 0]), -float(model.actuator_biasprm[i, 1])
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_DCMOTOR and model.actuator_gainprm[i, 4] > 0.0:
            return gear**2 * float(model.actuator_gainprm[i, 4]), gear**2 * float(model.actuator_gainprm[i, 6])
        if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE and stiffness > 0.0:
            return gear**2 * stiffness, -(gear**2) * float(model.actuator_biasprm[i, 2])
    raise InputError(f'{source.path}: servos = "file": the joint {joint!r} has no position servo whose gains to take')
