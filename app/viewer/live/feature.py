"""*Connect a program* in the tab *Program*: the code of the page, who is connected, what that program shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings
from app.viewer.declared.panel import Button, Html
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.feature import Stage
from app.viewer.live import views
from app.viewer.live.drawings import Drawings, merged, nodes
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from kin import Contact
from kin.transforms import Array

LOOK_AGAIN = 1.0  # s between two looks at the rate of a program and its delay
GHOST, OPACITY = (230, 159, 0), 0.45


@dataclass(frozen=True)
class NoSettings(Settings):
    """A link keeps nothing of a connection."""


@dataclass(frozen=True, eq=False)
class ConnectFacts(Facts[NoSettings]):
    """The arm on show."""


class Connect(DeclaredFeature[NoSettings, ConnectFacts]):
    """See the module.

    Attributes:
        contacts: what the arm touches.
    """

    key = "connect"
    title = "Connected program"
    settings_of, facts_of = NoSettings, ConnectFacts

    def __init__(self, stage: Stage) -> None:
        self.contacts: Sequence[Contact] = ()
        self._drawings: Drawings = {}
        self._numbers = count(1)
        self._measured: Array | None = None
        self._was = ""  # the program of the last look
        super().__init__(stage)

    # What the program sends

    def use(self, values: Mapping[str, Any]) -> None:
        """Take what the program draws and measures; raises `kin.InputError`."""
        self.wake()
        if "drives" in values:
            self.stage.show_driven(values["drives"] or "")
        if "measured" in values:
            measured = values["measured"]
            if measured is not None:
                measured = self.stage.now.robot.check_q(measured, "measured")
            self._measured = measured
        if values.get("clear"):
            self._drawings = {}
        if drawn := values.get("draw"):
            self._drawings = merged(self._drawings, drawn, self._numbers)

    # Feature

    def on_robot(self) -> None:
        self._measured = None
        super().on_robot()

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        self.contacts = contacts

    def on_pose(self, T_base_tool: Array) -> None:
        if self._measured is not None:  # nothing else here depends on the pose
            super().on_pose(T_base_tool)

    def on_leave(self) -> None:
        self.stage.door.close("The page was closed.")

    # Declared

    def besides(self) -> tuple[object, ...]:
        measured = None if self._measured is None else self._measured.tobytes()
        return measured, tuple(number for number, _ in self._drawings.values())

    def advance(self, now: float) -> float | None:
        line = self.stage.door.line
        name = "" if line is None or line.program is None else line.program.name
        if name != self._was:
            if name:
                self.stage.notify(Notice("hand", f"{name} is connected", "It may move the arm. Tab Program."))
            elif line is not None:
                self.stage.notify(Notice("hand", f"{self._was} has left", "The code still counts."))
            self._was = name
            self._stale = True
        if name and now - self.shown_at >= LOOK_AGAIN:
            self._stale = True
        return LOOK_AGAIN if name else None

    def panel(self) -> Sequence[PanelNode]:
        door, line = self.stage.door, self.stage.door.line
        if door.locked:
            return []
        if line is None:
            about = Html(views.about)
            return [about, Button("Connect a program", self.event(self.on_open), key="open")]
        shown = Html(views.code, (line.code, self.stage.service.address), key="code")
        state = Html(views.state, views.state_of(line.program), key="state")
        found: list[PanelNode] = [shown, state]
        if self._measured is not None:
            arm = self.stage.now
            gap = np.round(self._measured - arm.q, 6)
            args = arm.robot, gap.tobytes(), self._measured.tobytes(), self.stage.units
            found.append(Html(views.measured, args, key="measured"))
        hint = "The connection ends, and this code counts no more"
        return [*found, Button("Withdraw the code", self.event(self.on_close), hint, key="close")]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        drawn = tuple(self._drawings.values())
        found: list[SceneNode | Lazy] = [Lazy("drawings", nodes, (drawn,))] if drawn else []
        if self._measured is not None:
            found.append(ghost("measured", self.stage.now.robot, self._measured, GHOST, OPACITY))
        return found

    def on_open(self) -> None:
        """Show a code."""
        self.stage.door.open(self.stage.now.robot)

    def on_close(self) -> None:
        """Withdraw the code, and remove what the program has drawn."""
        self.stage.door.close()
        self._drawings, self._measured, self._was = {}, None, ""
        self.stage.show_driven("")
        self.stage.notify(Notice("hand", "The code is withdrawn", "No program can move this page with it."))
