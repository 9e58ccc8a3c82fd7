"""Why a program cannot be driven, and at which item."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.feature import Stage
from app.viewer.tabs.program.items import Items
from kin.motion import Motion

SAME = 1e-6  # rad or m: a locked joint has this value


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
    return None
