"""*Step out*: the ways out of a singularity as words and as a ghost, and the frames of one that keeps the tool."""

from __future__ import annotations

import numpy as np

from app.exports.worksheet.sheet import indexed
from app.viewer.arm import Arm
from app.viewer.declared.scene import Color, Node
from app.viewer.lessons.velocity.null_motion import FASTEST
from app.viewer.panel.joints import label
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from app.viewer.views.templates import render
from kin import Robot
from kin.escape import Exit, Exits
from kin.escape.results import tool_motion
from kin.transforms import Array
from kin.units import Units, typeset

COLOR: Color = (0, 158, 115)
OPACITY = 0.45
_MOVES = 1e-6  # rad or m
STEP_HINT = (
    "Looks for the shortest motion out of this singularity, and draws where it leads before you drive there"
)
EXIT_HINT = "Several postures can be reached; draws where this way leads"
DRIVE_HINT = "Moves the arm to the pale one"
STAY_HINT = "Leaves the arm where it is"
DRIVEN = Notice("reached", "Stepping out", "The arm moves, the tool does not.")
STAYED = Notice("hand", "Stopped on the way out", "The arm stays where it is.")
CHANGED = Notice("limits", "Stopped on the way out", "What the arm avoids has changed. Press Step out again.")


def searching_html() -> str:
    """While the ways out are searched."""
    return render("velocity/exits", sentence="The ways out are searched …", rows=[])


def exits_html(found: Exits, chosen: int, units: Units) -> str:
    """The ways out: posture, what the tool does, and the joints that move."""
    rows = [
        {
            "number": k + 1,
            "chosen": k == chosen,
            "posture": short(each.posture) if each.posture else f"posture {k + 1}",
            "tool": typeset(tool_motion(found.robot, each, units)),
            "joints": indexed(typeset(found.moves(each, units))),
        }
        for k, each in enumerate(found.exits)
    ]
    return render("velocity/exits", sentence="" if rows else indexed(typeset(found.explain(units))), rows=rows)


def drawn(robot: Robot, shown: Exit) -> Node:
    """The arm where a way out leads."""
    return ghost("exit", robot, shown.q[-1], COLOR, OPACITY)


def locked(arm: Arm, shown: Exit) -> Notice | None:
    """What keeps the arm from a way out: a joint that is locked and would have to move; None: nothing."""
    moves = np.ptp(shown.q, axis=0) > _MOVES  # also of a joint that comes back
    held = [label(arm.robot, i) for i, lock in enumerate(arm.locks) if lock and moves[i]]
    return Notice("limits", "Not moved: a joint is locked", f"Unlock {held[0]} first.") if held else None


def driven(found: Exits, q: Array) -> Exit | None:
    """The way out with these waypoints; None: it is none any more."""
    return next((each for each in found.exits if np.array_equal(each.q, q)), None)


def left(found: Exits, shown: Exit, units: Units) -> Notice:
    """The message at the end of a way out."""
    said = tool_motion(found.robot, shown, units)
    posture = f"; posture {short(shown.posture)}" if shown.posture else ""
    return Notice("reached", "Out of the singularity", f"{said[0].upper()}{said[1:]}{posture}.")


def after(q: Array, passed: int, seconds: float) -> int:
    """Up to which of the waypoints ``(k, n)`` the arm gets in so many seconds: at these the tool is in place."""
    covered = np.cumsum(np.abs(np.diff(q[passed:], axis=0)).max(axis=1))
    return min(passed + max(int(np.searchsorted(covered, FASTEST * seconds, side="right")), 1), len(q) - 1)
