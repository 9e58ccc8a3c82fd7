"""The straight line of which the lesson "Velocity" plots rank and condition number."""

from __future__ import annotations

import numpy as np

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.velocity import section_views as views
from app.viewer.lessons.velocity.along import along
from kin.transforms import Array
from kin.units import Units

START_HINT = "The line starts at the present configuration; without this, at home"
PLOT_HINT = "Follows the straight line to the present pose, or to a target that is missed"
HERE = "The line starts here. Move the arm, or type a target."
NO_LINE = "Start and end are the same. Press Start here, then move the arm or type a target, and plot."
_SAME = 1e-6


def plot(arm: Arm, start: Array | None, units: Units) -> str:
    """The plot from a configuration ``(n,)``, or from home, as HTML."""
    q, end = ends(arm, start)
    if np.abs(kin.fk(arm.robot, q) - end).max() < _SAME:
        return views.note_html(NO_LINE)
    return views.line_html(arm.robot, along(arm.robot, q, end, arm.task), units)


def ends(arm: Arm, start: Array | None) -> tuple[Array, Array]:
    """The configuration ``(n,)`` at the start, and the pose ``(4, 4)`` at the end.

    From the marked start, or home, to the present pose; from the present pose to a target that is missed.
    """
    here = arm.T_goal
    if arm.target is not None and float(np.abs(arm.target - here).max()) > _SAME:
        return arm.goal if start is None else start, arm.target
    return arm.robot.q_home if start is None else start, here
