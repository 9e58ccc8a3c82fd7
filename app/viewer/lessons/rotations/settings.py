"""The settings of the lesson "Rotations and frames". The names are those of links."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.viewer.declared.fields import Number, Settings, choice, kept, memory, number, text, vector
from app.viewer.lessons.rotations.conventions import CONVENTIONS, PAGE, Angles
from app.viewer.lessons.rotations.frames import FARTHEST, Motion, as_json, from_json
from app.viewer.lessons.rotations.turning import Turning
from app.viewer.lessons.rotations.typed import LONGEST
from kin import Robot

MOTIONS = {
    f"{verb} {axis}": (turns, k)
    for turns, verb in ((True, "Turn about"), (False, "Shift along"))
    for k, axis in enumerate("xyz")
}
MOST_TURN = 2.0 * math.pi
SHOWN_HINT = "What is drawn beside the arm"
AXES = {"All": "all", "Of the three turns": "turns", "Of the whole rotation": "whole", "None": "none"}
AXES_HINT = "Which axes are drawn through the turned frame"
CONVENTION_HINT = "Three axes in the order of the turns, about fixed or about moving axes"
ANGLE_HINT = "Drag, or type a value"
TYPED_HINT = "3 angles in the order of the turns, a quaternion w x y z, or the 9 numbers of a matrix, row by row"
MOTION_HINT = "The next motion of the chain"
WHOSE_HINT = "Axes of the frame itself, or of the fixed frame {0}"
TURN_HINT, SHIFT_HINT = "Angle of the next turn", "Length of the next shift"
FIRST: Angles = (math.radians(20.0), math.radians(35.0), math.radians(50.0))
ANGLE = Number(
    limits=(-7.0, 7.0),
    measure="angle",
    slider=(-math.pi, math.pi),
    marks=True,
    named=False,
    names="angle",
    hint=ANGLE_HINT,
)


def _chain(entry: object, robot: Robot) -> tuple[Motion, ...]:
    return from_json(entry)


@dataclass(frozen=True)
class RotationsSettings(Settings):
    """See the module; `turn` and `shift` are amounts of the next motion (rad, m).

    Attributes:
        error: what is wrong with the typed rotation.
        turning: the turns that are shown one after another.
    """

    convention: str = choice("Angles", {c.title: c.key for c in CONVENTIONS}, PAGE.key, hint=CONVENTION_HINT)
    angles: Angles = vector(("α", "β", "γ"), FIRST, ANGLE)
    axes: str = choice("Axes drawn", AXES, "all", hint=AXES_HINT)
    chained: bool = choice("Show", {"One rotation": False, "Chain of frames": True}, False, hint=SHOWN_HINT)
    chain: tuple[Motion, ...] = kept((), to_json=as_json, from_json=_chain)
    motion: str = choice("Motion", {name: name for name in MOTIONS}, "Turn about z", hint=MOTION_HINT)
    own: bool = choice("Axes", {"own axes": True, "fixed axes": False}, True, hint=WHOSE_HINT)
    turn: float = number("Angle", math.radians(90.0), (-MOST_TURN, MOST_TURN), "angle", hint=TURN_HINT)
    shift: float = number("Length", 0.2, (-FARTHEST, FARTHEST), "length", hint=SHIFT_HINT)
    typed: str = text("Rotation", hint=TYPED_HINT, longest=LONGEST, link=False)
    error: str = memory("")
    turning: Turning | None = memory()
