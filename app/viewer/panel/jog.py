"""Jog: buttons that move the tool, or one joint, by a chosen step; `static/input.js` repeats while one is held.

As on a teach pendant: along and about the axes of the tool or the base, or joint by joint.
"""

from __future__ import annotations

import viser

from app.viewer.panel import update_html
from app.viewer.panel.joints import label
from app.viewer.panel.part import add_html
from app.viewer.views.templates import render
from kin import Robot

FRAMES = {"tool": "Tool", "base": "Base", "joints": "Joints"}
STEPS = (1, 5, 10)  # mm or degrees


class JogPad:
    """The buttons, in a folder that is closed at first."""

    def __init__(self, gui: viser.GuiApi, robot: Robot) -> None:
        self.folder = gui.add_folder("Jog", expand_by_default=False)
        with self.folder:
            self._html = add_html(gui, self._pad(robot))

    def use_robot(self, robot: Robot) -> None:
        """Offer the joints of this robot."""
        update_html(self._html, self._pad(robot))

    def _pad(self, robot: Robot) -> str:
        joints = [label(robot, i) for i in range(robot.n)]
        return render("panel/jog", frames=FRAMES, steps=STEPS, axes="xyz", joints=joints)
