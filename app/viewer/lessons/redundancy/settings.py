"""The settings of the lesson "Redundancy". The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.declared.fields import Settings, choice, flag, memory, slider
from app.viewer.lessons.redundancy.views import frame_origins
from app.viewer.panel.status import Notice
from kin import Robot, fk
from kin.transforms import Array

CHOICE_HINT = "The redundancy parameter to change"
SWEEP_HINT = "Moves back and forth between the ends of the range"
SLIDER_HINT = "Moves the arm while the tool stays where it is"
MOVING = Notice("reached", "Self-motion", "The arm moves, the tool does not.")


@dataclass(frozen=True, eq=False)
class Held:
    """Where the tool is held.

    Attributes:
        q: the configuration ``(n,)`` that the arm was sent to last.
        T: the pose ``(4, 4)`` of the tool.
        shape: the origins of the links' frames when the tool was last released.
    """

    q: Array
    T: Array
    shape: Array

    @classmethod
    def at(cls, robot: Robot, q: Array) -> Held:
        """Held from a configuration ``(n,)`` on."""
        return cls(q, fk(robot, q), frame_origins(robot, q))


@dataclass(frozen=True)
class RedundancySettings(Settings):
    """Which parameter is changed, by its name, and how. The parameters are facts: here any name is valid.

    Attributes:
        held: where the tool is held while the lesson moves the arm.
        target: the value that is approached; None: none is.
        arrival: what is said there.
        up: the direction of a sweep.
        side: a value on the side of zero on which the slider shows half a turn.
    """

    free: str = choice(
        "Parameter", {}, "", hint=CHOICE_HINT, names="redundancy parameter", anything=True, renew=True
    )
    swing: bool = flag("Sweep", hint=SWEEP_HINT, renew=True)
    value: float = slider(
        "", 0.0, (0.0, 0.0), "angle", hint=SLIDER_HINT, link=False, marks=True, named=False, clip=True
    )
    held: Held | None = memory()
    target: float | None = memory()
    arrival: Notice = memory(MOVING)
    up: bool = memory(True)
    side: float = memory(0.0)
