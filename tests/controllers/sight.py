"""What is seen of a body of which only the feet matter."""

from __future__ import annotations

import numpy as np

from controllers.interface import FootState, Observation


def seen(left: tuple[float, float], right: tuple[float, float], yaw: float = 0.0) -> Observation:
    feet = {
        side: FootState(position=np.array([*place, 0.0]), yaw=yaw, force=30.0)
        for side, place in (("left", left), ("right", right))
    }
    nothing = np.zeros(3)
    return Observation(
        time=0.0, cog=nothing, cog_velocity=nothing, angular_momentum=nothing, zmp=np.zeros(2),
        feet=feet, configuration=np.empty(0), velocity=np.empty(0),  # type: ignore[arg-type]
    )  # fmt: skip
