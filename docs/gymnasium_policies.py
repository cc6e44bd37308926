"""A random policy and a PD policy on `Okiagari/PushRecovery-v0`: who survives a push forward?"""

import gymnasium
import numpy as np

import sim.envs  # noqa: F401 (tells Gymnasium of the environment)

PUSH = {"start": 0.5, "direction": 0.0, "delta_v": 0.15}
# A torque that draws every joint back to the stand, as a share of what the motor can give.
STIFFNESS, DAMPING = 3.0, 0.08


def random_policy(env, seen):
    return env.action_space.sample()


def pd_policy(env, seen):
    off, speed = seen["configuration"][7:] - env.unwrapped.robot.stand[7:], seen["velocity"][6:]
    return np.clip(-STIFFNESS * off - DAMPING * speed, -1.0, 1.0)


def survive(policy):
    env = gymnasium.make("Okiagari/PushRecovery-v0", action="torque", frame_skip=1)
    env.action_space.seed(0)
    seen, _ = env.reset(seed=0, options={"pushes": [PUSH]})
    total, over = 0.0, False
    while not over:
        seen, reward, fell, timeout, info = env.step(policy(env, seen))
        total, over = total + reward, fell or timeout
    return total, info["outcome"]


for policy in (random_policy, pd_policy):
    total, outcome = survive(policy)
    print(f"{policy.__name__}: {outcome} after {total:.0f} control periods")
