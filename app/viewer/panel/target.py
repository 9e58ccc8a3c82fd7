"""What the gizmo asks for: how much of the target pose the arm has to match."""

from __future__ import annotations

import viser

from app.viewer.panel import Post, assign, listen, listen_click
from kin import Robot, Task

TASKS: dict[str, Task] = {"Full pose": "pose", "Point + approach": "approach", "Point only": "position"}
HINT = (
    "Full pose: the tool point and its whole orientation. "
    "Point + approach: the tool point and the direction of its axis, roll free. "
    "Point only: any orientation."
)


def default_task(robot: Robot) -> Task:
    """The full pose for every arm.

    An arm with fewer than six joints cannot match every pose, but it then reaches point and approach exactly and
    the status line names the roll it had to give up, which is the lesson; the choice is one click away.
    """
    return "pose"


class TargetChoice:
    """The task dropdown and the button that brings the target back to the tool."""

    def __init__(self, gui: viser.GuiApi, task: Task, post: Post) -> None:
        names = {value: name for name, value in TASKS.items()}
        self._choice = gui.add_dropdown("Match", tuple(TASKS), initial_value=names[task], hint=HINT)
        listen(self._choice, post, "task")
        group = gui.add_button_group("Target", ("Back to tool",), hint="Put the target where the tool is")
        listen_click(group, post, {"Back to tool": "recall"})

    def show(self, task: Task) -> None:
        """Select a task."""
        assign(self._choice, next(name for name, t in TASKS.items() if t == task))
