"""What was found, chosen and assumed when a robot was adopted, in words."""

from __future__ import annotations

from collections.abc import Iterator

from models.adopt.servos import Servo
from models.adopt.soles import Sole
from models.adopt.source import Source
from models.adopt.stand import Stand
from models.arena import SIDES, Side
from models.robot import Robot

REPORT = "ADOPTED.md"


def findings(source: Source, robot: Robot, soles: dict[Side, Sole], stand: Stand, servos: list[Servo]) -> str:
    """A short report as Markdown."""
    model = source.model
    feet = {side: model.body(source.feet[side]).name for side in SIDES}
    legs = {side: ", ".join(model.joint(j).name for j in source.legs[side]) for side in SIDES}
    size, depth = soles["left"].size, soles["left"].depth
    posture = [name for name in robot.joint_names if name not in robot.leg_joints]
    lines = [
        f"# {robot.name}, adopted from {source.path.name}",
        "",
        "| | found |",
        "|---|---|",
        _cells("root", f"`{model.body(source.root).name}`, called `trunk` now"),
        _cells("mass", f"{robot.mass:.2f} kg"),
        _cells("feet", f"`{feet['left']}`, `{feet['right']}`"),
        _cells("soles", f"{100 * size[0]:.1f} x {100 * size[1]:.1f} cm, {100 * depth:.1f} cm below the foot's joint"),
        _cells("joints of the left leg", legs["left"]),
        _cells("joints of the right leg", legs["right"]),
        _cells("posture joints", ", ".join(posture) or "none"),
        _cells(
            "stand",
            f"{stand.words}: hip {stand.hip:.3f} m over the soles, {stand.straight:.3f} m with a straight leg; "
            f"soles {robot.stance_width:.3f} m apart",
        ),
        _cells("COG", f"{robot.cog_height:.3f} m over the soles; omega {robot.omega:.2f} 1/s"),
        "",
        "## Motors, at the joint",
        "",
        "Torque at standstill [N m]; speed without load [rad/s]; the servo's gains kp [N m/rad] and kd [N m s/rad]; "
        "the rotor's inertia [kg m^2]; dry friction [N m]; damping [N m s/rad].",
        "",
        "| joint | torque | speed | kp | kd | rotor | friction | damping |",
        "|---|---|---|---|---|---|---|---|",
        *(
            _cells(
                s.joint,
                f"{s.torque:.3g}",
                f"{s.speed:.3g}{' (assumed)' if s.assumed else ''}",
                f"{s.stiffness:.4g}",
                f"{s.servo_damping:.3g}",
                f"{s.armature:.3g}",
                f"{s.friction:.3g}",
                f"{s.damping:.3g}",
            )
            for s in servos
        ),
        "",
        "## Chosen and assumed",
        "",
        *(f"- {each}" for each in _choices(source, servos)),
    ]
    return "\n".join(lines) + "\n"


def _cells(*texts: str) -> str:
    """A row of a table, whatever is in the names."""
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"


def _choices(source: Source, servos: list[Servo]) -> Iterator[str]:
    yield from source.notes
    for assumed in sorted({servo.assumed for servo in servos} - {""}):
        count = sum(servo.assumed == assumed for servo in servos)
        yield f"{assumed} was assumed for {count} of {len(servos)} motors: the file gives none; robot.toml can"
    if source.hints.servos == "rule":
        yield "gains of the servos: 20 times the stall torque a radian, damped at 0.7 with rotor and link"
    yield "meshes are to be looked at only; a capsule inside its bounding box stands for a solid one"
    if not source.hints.legs_collide:
        yield "the legs do not touch each other, as asked"
