"""The task: how much of the target pose the arm must match."""

from __future__ import annotations

import viser

from app.viewer.panel import Post, assign, listen, listen_click
from kin import Task

TASKS: dict[str, Task] = {"Full pose": "pose", "Point + approach": "approach", "Point only": "position"}
# Arms with fewer than six joints cannot match every pose. They then match point and approach direction exactly,
# and the status line reports the roll error: that is worth seeing, and the choice of another task is one click
# away.
DEFAULT_TASK: Task = "pose"
RECALL = "Move target to tool"
HINT = (
    "Full pose: the position and orientation of the tool. "
    "Point + approach: the tool point and the direction of the tool's z axis; any roll. "
    "Point only: the tool point; any orientation."
)


class TargetChoice:
    """The task dropdown, and the button that moves the target to the tool. Posts ``"task"`` and ``"recall"``."""

    def __init__(self, gui: viser.GuiApi, task: Task, post: Post) -> None:
        names = {value: name for name, value in TASKS.items()}
        self._choice = gui.add_dropdown("Target must match", tuple(TASKS), initial_value=names[task], hint=HINT)
        listen(self._choice, post, "task")
        self._group = gui.add_button_group("Target", (RECALL,), hint="Moves the target to where the tool is")
        listen_click(self._group, post, {RECALL: "recall"})

    def hide(self) -> None:
        """Offer neither."""
        self._choice.visible = self._group.visible = False

    def show(self, task: Task) -> None:
        """Select a task."""
        assign(self._choice, next(name for name, t in TASKS.items() if t == task))
