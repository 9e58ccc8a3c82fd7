"""What files of motions say of the motion in them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from kin import InputError
from kin.motion import Motion
from kin.robot import Joint
from kin.transforms import Array


def with_joint_names(motion: Motion, names: Sequence[str], field: str) -> Motion:
    """The same motion with other names of its joints, such as those of a ROS driver; raises `InputError`."""
    robot = motion.robot
    if len(names) != robot.n or len({*names}) != robot.n or not all(map(str.strip, names)):
        joints = ", ".join(joint.name for joint in robot.joints)
        raise InputError(field, list(names), f"{robot.n} different names, one for each of: {joints}")
    left = iter(names)
    rows = tuple(replace(row, name=next(left)) if row.kind != "fixed" else row for row in robot.rows)
    return replace(motion, robot=replace(robot, rows=rows, motors=(), ros_joints=()))


def about(motion: Motion) -> list[tuple[str, str]]:
    """What a file says of the motion in it: arm, units, limits, and which are assumed; each on one line."""
    limits, joints = motion.limits, motion.robot.joints
    rows: list[tuple[str, Array, str]] = [
        ("velocity", limits.velocity, "/s"),
        ("acceleration", limits.acceleration, "/s^2"),
        ("jerk", limits.jerk, "/s^3"),
    ]
    assumed = [
        f"{name} of {json.dumps(joint.name)}"
        for joint, names in zip(joints, limits.assumed, strict=True)
        for name in names
    ]
    return [
        ("arm", f"{motion.robot.id}, {' '.join(motion.robot.name.split())}"),
        ("joints", ", ".join(json.dumps(joint.name) for joint in joints)),
        ("units", "seconds; radians for joints that turn, metres for joints that slide; metres for the tool"),
        (
            "range",
            ", ".join(
                f"{low!r} to {high!r} {_unit(joint)}"
                for low, high, joint in zip(
                    motion.robot.lower.tolist(), motion.robot.upper.tolist(), joints, strict=True
                )
            ),
        ),
        *(
            (
                f"largest {name}",
                ", ".join(
                    f"{value!r} {_unit(joint)}{per}" for value, joint in zip(values.tolist(), joints, strict=True)
                ),
            )
            for name, values, per in rows
        ),
        ("assumed", ", ".join(assumed) or "none of these"),
        *_gripper(motion),
    ]


def _gripper(motion: Motion) -> list[tuple[str, str]]:
    """When the gripper moves, and how far it is open then: joint values do not say it. Empty if it does not."""
    moves = [
        f"{each.opening!r} from {each.start!r} s to {each.end!r} s"
        for each in motion.segments
        if each.opening is not None
    ]
    return [("gripper, 0 closed to 1 open", ", ".join(moves))] if moves else []


def _unit(joint: Joint) -> str:
    return "rad" if joint.kind == "revolute" else "m"
