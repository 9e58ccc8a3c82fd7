"""Samples of motions in chunks, so that a long motion is never in memory as text, and what files say of it."""

from __future__ import annotations

import json
from collections.abc import Iterator

from app.shared.answers.motion import sample_times
from kin import Motion
from kin.motion import MotionSample
from kin.robot import Joint
from kin.transforms import Array

AT_ONCE = 500  # samples of a chunk


def samples(motion: Motion, rate: float) -> Iterator[MotionSample]:
    """The motion at `rate` samples per second, in chunks."""
    times = sample_times(motion, rate)
    for start in range(0, len(times), AT_ONCE):
        yield motion.sample(times[start : start + AT_ONCE])


def about(motion: Motion) -> list[tuple[str, str]]:
    """What a file says of the motion in it: arm, units, limits, and which are assumed; each on one line."""
    limits, joints = motion.limits, motion.robot.joints
    rows: list[tuple[str, Array, str]] = [
        ("velocity", limits.velocity, "/s"),
        ("acceleration", limits.acceleration, "/s^2"),
        ("jerk", limits.jerk, "/s^3"),
    ]
    assumed = [f"{name} of {json.dumps(joint.name)}" for joint, names in zip(joints, limits.assumed, strict=True)
               for name in names]  # fmt: skip
    return [
        ("arm", f"{motion.robot.id}, {' '.join(motion.robot.name.split())}"),
        ("joints", ", ".join(json.dumps(joint.name) for joint in joints)),
        ("units", "seconds; radians for joints that turn, metres for joints that slide; metres for the tool"),
        ("range", ", ".join(f"{low!r} to {high!r} {_unit(joint)}" for low, high, joint in
                            zip(motion.robot.lower.tolist(), motion.robot.upper.tolist(), joints, strict=True))),
        *((f"largest {name}", ", ".join(f"{value!r} {_unit(joint)}{per}" for value, joint in
                                        zip(values.tolist(), joints, strict=True))) for name, values, per in rows),
        ("assumed", ", ".join(assumed) or "none of these"),
    ]  # fmt: skip


def _unit(joint: Joint) -> str:
    return "rad" if joint.kind == "revolute" else "m"
