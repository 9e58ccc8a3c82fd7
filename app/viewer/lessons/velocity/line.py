"""The section on lines in the lesson "Velocity": rank and condition number on the way of the tool."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np
import viser

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.velocity import section_views as views
from app.viewer.lessons.velocity.along import along
from app.viewer.panel import update_html
from kin import InputError
from kin.transforms import Array

START_HINT = "The line starts at the present configuration; without this, at home"
PLOT_HINT = "Follows the straight line to the present pose, or to a target that is missed"
_SAME = 1e-6
NO_LINE = "Start and end are the same. Press Start here, then move the arm or type a target, and plot."


class Line:
    """The section: two buttons and the plot. Events come back to `handle`, by their name."""

    def __init__(self, stage: Stage, post: Callable[[Hashable, object], None]) -> None:
        self._stage = stage
        self._start: Array | None = None
        gui = stage.client.gui
        for name, key, hint in (("Start here", "start", START_HINT), ("Plot the line", "plot", PLOT_HINT)):
            self._listen(gui.add_button(name, hint=hint), post, key)
        self._html = gui.add_html("")

    @staticmethod
    def _listen(button: viser.GuiButtonHandle, post: Callable[[Hashable, object], None], key: str) -> None:
        @button.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is not None:
                post(("line", key), None)

    def handle(self, key: tuple[Hashable, ...]) -> None:
        """Process an event of these controls."""
        stage, robot = self._stage, self._stage.now.robot
        if key == ("line", "start"):
            self._start = stage.now.goal.copy()
            update_html(self._html, views.note_html("The line starts here. Move the arm, or type a target."))
            return
        if key != ("line", "plot"):
            raise InputError("velocity", key, "a control of this lesson")
        start, end = self.ends()
        if np.abs(kin.fk(robot, start) - end).max() < _SAME:
            update_html(self._html, views.note_html(NO_LINE))
        else:
            update_html(self._html, views.line_html(robot, along(robot, start, end, stage.now.task), stage.units))

    def ends(self) -> tuple[Array, Array]:
        """The configuration ``(n,)`` at the start, and the pose ``(4, 4)`` at the end.

        From the marked start, or home, to the present pose; from the present pose to a target that is missed.
        """
        arm = self._stage.now
        here = arm.T_goal
        missed = arm.target is not None and float(np.abs(arm.target - here).max()) > _SAME
        if missed and arm.target is not None:
            return arm.goal if self._start is None else self._start, arm.target
        return arm.robot.q_home if self._start is None else self._start, here

    def forget(self) -> None:
        """Another arm: no start, no plot."""
        self._start = None
        update_html(self._html, "")
