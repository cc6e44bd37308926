"""The humanoid in MuJoCo: servos, pushes with their delivered impulse, and what the controllers get to see."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable

import mujoco
import numpy as np
from dm_control import mujoco as dm_mujoco
from dm_control.mujoco import wrapper
from numpy.typing import NDArray

from controllers.interface import FootState, JointTargets, Observation
from models.arena import FLOOR, SIDES, build_arena
from models.errors import OkiagariError
from models.robot import STAND, TRUNK, Robot, Side
from scenarios.catalogue import with_push
from scenarios.push import COG, Push
from scenarios.schema import Scenario
from sim.episode.push_schedule import ImpulseLog, ScheduledPush, schedule, start_of_step
from sim.episode.true_body import TrueBody
from sim.sensing.servos import Servos

Array = NDArray[np.float64]


class PushedPhysics(dm_mujoco.Physics):
    """dm_control's physics with a schedule of pushes that act through `xfrc_applied`.

    Positions and velocities are up to date after each step, as with dm_control's `legacy_step`, so that an observation
    is of the present and not of one physics step ago.
    """

    impulse_log: ImpulseLog
    steps_done: int
    bodies: list[int]
    _watcher: Callable[[int], None] | None = None

    def after_reset(self) -> None:
        """Work out the first observation with the servos on, which hold the initial pose already."""
        self.forward()

    def plan_pushes(self, impulse_log: ImpulseLog) -> None:
        """Take a schedule of pushes, from physics step 0 on."""
        self.impulse_log = impulse_log
        self.steps_done = 0
        self._warned = self.data.ptr.warning.number
        self.bodies = [self._body(push) for push in impulse_log.scheduled]

    def watch(self, watcher: Callable[[int], None] | None) -> None:
        """Call somebody after every physics step, with the number of steps done; None for nobody."""
        self._watcher = watcher

    def add_push(self, index: int, push: ScheduledPush) -> None:
        """Take in a push of which no step has been simulated; see `ImpulseLog.insert`."""
        self.impulse_log.insert(index, push)
        self.bodies.insert(index, self._body(push))

    def _body(self, push: ScheduledPush) -> int:
        # MuJoCo's body 0 is the world, which stands here for all bodies.
        return 0 if push.push.body == COG else int(self.model.body(push.push.body).id)

    def step(self, nstep: int = 1) -> None:
        """Advance by `nstep` physics steps, each with the forces and torques of all pushes that act in it.

        Raises:
            PhysicsError: the simulation diverged; it is looked for once, after the last step.
        """
        acting = self.impulse_log.active(self.steps_done, self.steps_done + nstep)
        model, data, warned = self.model.ptr, self.data.ptr, self._warned.tobytes()
        for _ in range(nstep):
            for index in acting:
                if (sample := self.impulse_log.sample(index, self.steps_done)) is not None:
                    self._apply(index, sample)
            # From a state whose positions and velocities are worked out already, to the next such state; that the
            # arena never integrates by RK4 lets a step be halved so.
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
            self.steps_done += 1
            for index in acting:
                data.xfrc_applied[self.bodies[index] or slice(None)] = 0.0
            if self._watcher is not None:
                self._watcher(self.steps_done)
        if self._warned.tobytes() != warned:
            self._complain(warned)

    def _complain(self, before: bytes) -> None:
        """Have dm_control say what MuJoCo has warned of since its counters stood like this."""
        now = self._warned.copy()
        self._warned[:] = np.frombuffer(before, now.dtype)
        with self.check_invalid_state():
            self._warned[:] = now

    def push_point(self, index: int) -> Array:
        """(3,) where a push acts now, of a torque the body's COM, world frame [m]."""
        data, body, push = self.data.ptr, self.bodies[index], self.impulse_log.scheduled[index].push
        if not body:
            return data.subtree_com[0].copy()
        if push.point is None:
            point = data.xipos[body].copy()
        else:
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(push.point)
        point[2] += push.height
        return point

    def _apply(self, index: int, sample: Array) -> None:
        """Add a force or torque (3,) to what acts already, and book what it added."""
        data, body, push = self.data.ptr, self.bodies[index], self.impulse_log.scheduled[index].push
        if not body:
            mass = self.model.ptr.body_mass
            before = data.xfrc_applied[:, :3].sum(axis=0)
            data.xfrc_applied[:, :3] += np.outer(mass / mass.sum(), sample)
            self.impulse_log.book(index, data.xfrc_applied[:, :3].sum(axis=0) - before)
            return
        wrench = data.xfrc_applied[body]
        kind = slice(0, 3) if push.torque is None else slice(3, 6)
        before = wrench[kind].copy()
        wrench[kind] += sample
        self.impulse_log.book(index, wrench[kind] - before)
        if push.point is not None or push.height:
            wrench[3:] += np.cross(self.push_point(index) - data.xipos[body], sample)


def compiled_in(scenario: Scenario) -> tuple[Hashable, ...]:
    """What of a scenario is compiled into its world: one that is alike in it can be reset to that scenario."""
    return scenario.robot, scenario.timing, scenario.disturbance, scenario.body


class HumanoidWorld:
    """The whole body on the floor.

    Attributes:
        physics: the simulation; also what the dm_env environment is built on.
        robot: its facts.
        substeps: physics steps in a control period.
        body: how it differs from the robot's file.
        scenario: of the episode, with the pushes that were added to it.
    """

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        """Compile the scene.

        Args:
            scenario: gives the periods, the pushes and the seeded variation.
            robot: facts of the robot that the scenario names.
        """
        self.robot = robot
        self.substeps = scenario.timing.substeps
        self._asked = scenario
        self._dt = scenario.timing.control
        model = build_arena(robot.path, timestep=scenario.timing.physics).compile()
        self.body = TrueBody(model, scenario)
        self.physics: PushedPhysics = PushedPhysics.from_model(wrapper.MjModel(model))
        self._model, self._data = self.physics.model.ptr, self.physics.data.ptr
        self._site: dict[Side, int] = {side: model.site(f"{side}_sole").id for side in SIDES}
        self._look(model.body(TRUNK).id)
        self._servos = Servos(self._model, self._data)
        self.ticks = 0
        self.reset()

    def _look(self, trunk: int) -> None:
        """Keep views of what every tick reads: MuJoCo's data stay where they are."""
        model, data = self._model, self._data
        self._qpos, self._qvel, self._effort = data.qpos, data.qvel, data.actuator_force
        self._cog, self._cog_velocity = data.subtree_com[trunk], data.subtree_linvel[trunk]
        self._angular_momentum, self._trunk_axes = data.subtree_angmom[trunk], data.xmat[trunk]
        at = {side: int(model.sensor(f"{side}_sole").adr[0]) for side in SIDES}
        self._feet: dict[Side, tuple[Array, Array, Array]] = {
            side: (data.site_xpos[site], data.site_xmat[site, :4], data.sensordata[at[side] : at[side] + 10])
            for side, site in self._site.items()
        }
        floor = int(model.sensor(FLOOR).adr[0])
        self._contacts = data.sensordata[floor : floor + 1]

    def reset(self, scenario: Scenario | None = None) -> None:
        """Start the episode anew, or one of another scenario.

        Raises:
            OkiagariError: if that scenario differs in what is compiled, see `compiled_in`.
        """
        if scenario is not None and compiled_in(scenario) != compiled_in(self._asked):
            raise OkiagariError("a world is compiled for one robot, timing, disturbance and body; make another")
        self._asked = scenario or self._asked
        with self.physics.reset_context():
            self.arrange()

    def arrange(self) -> None:
        """Put the robot into its stand, varied by the scenario's seed, with the servos holding it.

        To be called within a `reset_context` of the physics, as `reset` and dm_control's environments do.
        """
        # Pushes that were added belong to the episode that is over.
        self.scenario = scenario = self._asked
        self.body.draw(scenario)
        model, data = self._model, self._data
        period = scenario.timing.physics
        self.physics.plan_pushes(ImpulseLog(schedule(scenario.pushes, period, self.robot.mass), period))
        mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
        rng = np.random.default_rng(scenario.seed)
        offset = rng.normal(0.0, scenario.variation.pose, len(self.robot.joint_names))
        low, high = self.robot.joint_range.T
        data.qpos[7:] = np.clip(data.qpos[7:] + offset, low, high)
        mujoco.mj_kinematics(model, data)
        # The varied legs must neither hover nor sink: the lower sole touches the floor.
        data.qpos[2] -= min(float(data.site_xpos[site][2]) for site in self._site.values())
        still = np.zeros(len(self.robot.joint_names))
        self.set_targets(JointTargets(position=data.qpos[7:], velocity=still, torque=still))
        self.ticks = 0

    def add_push(self, push: Push) -> Push:
        """Push while the episode runs.

        Args:
            push: what to add; its start does not matter.

        Returns:
            The same with its start, which is that of the next physics step; `scenario` holds it from now on.

        Raises:
            InputError: if the scenario would not be allowed with it; nothing is added then.
        """
        dt, step = self.scenario.timing.physics, self.physics.steps_done
        push = push.model_copy(update={"start": start_of_step(step, dt)})
        self.scenario, index = with_push(self.scenario, push, self.robot)
        self.physics.add_push(index, *schedule([push], dt, self.robot.mass))
        return push

    @property
    def time(self) -> float:
        """Time at the start of the present control tick [s]."""
        return self.ticks * self._dt

    def observe(self) -> Observation:
        """What the controllers see now; arrays are copies."""
        total, moment_x, moment_y, feet = 0.0, 0.0, 0.0, {}
        for side, (place, axes, sensor) in self._feet.items():
            # found, net force of the sole on the floor (3), torque (3), point (3), in the world frame
            _, _, _, down, _, _, _, px, py, _ = sensor.tolist()
            normal = -down
            total += normal
            moment_x += normal * px
            moment_y += normal * py
            cos, _, _, sin = axes.tolist()
            feet[side] = FootState(position=place.copy(), yaw=math.atan2(sin, cos), force=normal)
        loaded = total > 1e-6
        return Observation(
            time=self.time,
            cog=self._cog.copy(),
            cog_velocity=self._cog_velocity.copy(),
            angular_momentum=self._angular_momentum.copy(),
            zmp=np.array([moment_x / total, moment_y / total] if loaded else [math.nan, math.nan]),
            feet=feet,
            configuration=self._qpos.copy(),
            velocity=self._qvel.copy(),
        )

    def set_targets(self, targets: JointTargets) -> None:
        """Give the servos their targets."""
        self._servos.set(targets)

    def tick_done(self) -> None:
        """Count a control period that the physics has run."""
        self.ticks += 1

    def trunk_tilt(self) -> float:
        """Angle between the trunk's z axis and the vertical [rad]."""
        return math.acos(min(1.0, max(-1.0, float(self._trunk_axes[8]))))

    def other_contact(self) -> bool:
        """Whether anything but a sole touches the floor."""
        return bool(self._contacts[0] > sum(sensor[0] for _, _, sensor in self._feet.values()))

    def joints(self) -> tuple[Array, Array]:
        """(n,) angle [rad] and (n,) speed [rad/s] of the joints now, as views."""
        return self._qpos[7:], self._qvel[6:]

    def motor_state(self) -> tuple[Array, Array]:
        """(n,) torque [N m] and (n,) speed [rad/s] of the motors, as views."""
        return self._effort[self._servos.order], self._qvel[6:]
