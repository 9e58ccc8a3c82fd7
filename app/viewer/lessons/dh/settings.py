"""The settings of the lesson "DH table step by step". The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

from app.viewer.declared.fields import Flag, Kept, Settings, choice, flag, memory, slider
from app.viewer.lessons.dh.attempt import Attempt
from app.viewer.lessons.dh.player import SPEEDS
from app.viewer.lessons.dh.steps import MOTIONS, length
from kin import Robot
from kin.units import Units

ROW_HINT = "0: frame 0 at the base; 2: row 2 complete; a quarter is one motion. Arrow keys move it finely."
SYMBOLS_HINT = "Aᵢ with its joint variable as a symbol"
COMPARE_HINT = "The same numbers in the other convention, next to the arm"
LINES_HINT = "Joint axes z, and the common normals of neighbours with their feet"
ASSIGN_HINT = "Choose the frames of this arm, fill in its table, and see what a wrong entry would mean"


@dataclass(frozen=True, kw_only=True)
class Own(Kept):
    """The student's own table, or None; its check box begins one and ends it."""

    kind = "checkbox"

    def read(self, name: str, posted: object, robot: Robot, units: Units) -> Attempt | None:
        return Attempt.begun(robot) if Flag().unpack(name, posted, robot) else None

    def shown(self, value: Any, robot: Robot, units: Units) -> bool:
        return value is not None

    def pack(self, value: Any) -> object:
        return None if value is None else value.state()

    def unpack(self, name: str, entry: object, robot: Robot) -> Attempt | None:
        return None if entry is None else Attempt.restored(robot, entry)


@dataclass(frozen=True)
class DHSettings(Settings):
    """See the module; `at` is the place on the walk, in motions, of which its slider shows rows.

    Attributes:
        plays: whether the walk goes on by itself.
        rest: how long it rests at its place (s).
    """

    at: float = slider(
        "Row",
        0.0,
        (0.0, 0.0),
        hint=ROW_HINT,
        scale=1 / MOTIONS,
        digits=4,
        step=0.01,
        names="row",
        renew=True,
        within=lambda robot: (0.0, float(length(robot))),
    )
    symbols: bool = flag("Symbols", hint=SYMBOLS_HINT)
    compare: bool = flag("Compare conventions", hint=COMPARE_HINT)
    speed: str = choice("Speed", {name: name for name in SPEEDS}, "Normal")
    lines: bool = flag("Axes and normals", True, hint=LINES_HINT)
    assign: Attempt | None = field(
        default=None, metadata={"spec": Own(label="Assign it yourself", hint=ASSIGN_HINT)}
    )
    plays: bool = memory(False)
    rest: float = memory(0.0)

    def for_robot(self, robot: Robot) -> Self:
        """Another arm is walked from its base; who was assigning begins again on it."""
        own = None if self.assign is None else Attempt.begun(robot)
        return replace(super().for_robot(robot), assign=own)
