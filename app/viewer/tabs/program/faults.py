"""Why a program cannot be driven, and at which item."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.viewer.feature import Stage
from app.viewer.tabs.program.items import Items
from kin.motion import Motion

SAME = 1e-6  # rad or m: a locked joint has this value
LOOSE, SAMPLES = 1e-4, 400  # rad or m on the way, and where it is looked at


@dataclass(frozen=True)
class Fault:
    """Why the program cannot be driven.

    Attributes:
        index: of the item at fault; that of the way back to the start is the number of items.
        words: sentences.
    """

    index: int
    words: str


def find_fault(items: Items, motion: Motion | None, stage: Stage) -> Fault | None:
    """The planner's refusal, or a locked joint that would have to move; None: nothing."""
    if motion is not None and motion.refusal is not None:
        return Fault(motion.refusal.segment, motion.refusal.explain(stage.units))
    constraints = stage.options.constraints
    locked = () if constraints is None or constraints.locked is None else constraints.locked
    for index, item in enumerate(items):
        for joint, (q, value) in enumerate(zip(item.q, locked, strict=False)):
            if value is not None and abs(q - value) > SAME:
                unit = stage.units.of(bool(stage.robot.revolute[joint]))
                words = (
                    f"Joint {joint + 1} is locked at {unit.text(value)}, and this waypoint has it at "
                    f"{unit.text(q)}. Unlock the joint, or set the waypoint to another pose."
                )
                return Fault(index, words)
    return None if motion is None else _moved(motion, locked)


def _moved(motion: Motion, locked: Sequence[float | None]) -> Fault | None:
    """A line on which a locked joint would move between two waypoints."""
    joints = [(joint, value) for joint, value in enumerate(locked) if value is not None]
    times = np.linspace(0.0, motion.duration, SAMPLES)
    q = motion.derivatives(times)[0] if joints else np.zeros((0, motion.robot.n))
    for joint, value in joints:
        off = np.flatnonzero(np.abs(q[:, joint] - value) > LOOSE)
        if off.size:
            when = times[off[0]]
            index = next(segment.index for segment in motion.segments if when <= segment.end)
            words = f"Joint {joint + 1} is locked, and would move on the way. Unlock the joint, or choose PTP."
            return Fault(index, words)
    return None
