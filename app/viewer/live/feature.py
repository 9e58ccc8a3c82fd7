"""*Connect a program* in the tab *Program*: the code of the page, who is connected, what that program shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, slider
from app.viewer.declared.panel import Button, Buttons, Control, Html
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.feature import Stage
from app.viewer.live import views
from app.viewer.live.drawings import Drawings, merged, nodes
from app.viewer.live.tape import SECONDS, WRITERS, Tape
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from kin import Contact
from kin.transforms import Array

STOPPED = "stopped"
LOOK_AGAIN = 1.0  # s between two looks at the rate of a program and its delay
GHOST, OPACITY = (230, 159, 0), 0.45


AT_HINT = "Shows the arm as it was commanded then, and the measured arm beside it"


@dataclass(frozen=True)
class TapeSettings(Settings):
    """Where the recording is shown. A link keeps nothing of a connection."""

    at: float = slider("Time (s)", 0.0, (0.0, SECONDS), hint=AT_HINT, digits=2, step=0.01, link=False)


@dataclass(frozen=True, eq=False)
class ConnectFacts(Facts[TapeSettings]):
    """The arm on show."""


class Connect(DeclaredFeature[TapeSettings, ConnectFacts]):
    """See the module.

    Attributes:
        contacts: what the arm touches.
    """

    key = "connect"
    title = "Connected program"
    settings_of, facts_of = TapeSettings, ConnectFacts

    def __init__(self, stage: Stage) -> None:
        self.contacts: Sequence[Contact] = ()
        self._drawings: Drawings = {}
        self._numbers = count(1)
        self._measured: Array | None = None
        self._driven = ""  # what the program drives
        self._tape = Tape(stage)
        self._was = ""  # the program of the last look
        super().__init__(stage)

    # What the program sends

    def use(self, values: Mapping[str, Any]) -> None:
        """Take what the program draws and measures; raises `kin.InputError`."""
        self.wake()
        if "drives" in values:
            self._driven = values["drives"] or ""
            self.stage.show_driven(self._driven)
            if self._driven:
                self._tape.stop()
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
        self._tape.end("another arm was shown")
        self._tape.stop()
        self._measured = None
        super().on_robot()

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        self.contacts = contacts

    def on_pose(self, T_base_tool: Array) -> None:
        if self._measured is not None:  # nothing else here depends on the pose
            super().on_pose(T_base_tool)

    def on_leave(self) -> None:
        self._tape.discard()
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
        if self._tape.playing:
            self._measured = self._tape.advance(now)
            self.change(at=self._tape.time)
            self._write = True
            return self.stage.frame
        live = bool(name) or self._tape.running
        if live and now - self.shown_at >= LOOK_AGAIN:
            self._stale = True
        return LOOK_AGAIN if live else None

    def panel(self) -> Sequence[PanelNode]:
        door, line = self.stage.door, self.stage.door.line
        if door.locked:
            return []
        if line is None:
            about = Html(views.about)
            return [about, Button("Connect a program", self.event(self.on_open), key="open"), *self._recorded()]
        shown = Html(views.code, (line.code, self.stage.service.address), key="code")
        state = Html(views.state, views.state_of(line.program), key="state")
        found: list[PanelNode] = [shown, state]
        if self._measured is not None:
            arm = self.stage.now
            gap = np.round(self._measured - arm.q, 6)
            args = arm.robot, gap.tobytes(), self._measured.tobytes(), self.stage.units
            found.append(Html(views.measured, args, key="measured"))
        found += self._recorded()
        hint = "The connection ends, and this code counts no more"
        return [*found, Button("Withdraw the code", self.event(self.on_close), hint, key="close")]

    def _recorded(self) -> list[PanelNode]:
        """The recording, and what can be done with it."""
        tape, hint = self._tape, "What the program sends and hears from now on"
        recording = tape.recording
        label = "Record the connection" if recording is None else "Record anew"
        begin = Button(label, self.event(self.on_record), hint, key="record")
        new = [] if self.stage.door.line is None else [begin]
        if recording is None:
            return list(new)
        why = "" if recording.ended in (None, STOPPED) else recording.ended
        other = "" if recording.robot == self.stage.now.robot else recording.robot.name
        args = round(recording.seconds, 1), len(recording.entries), recording.size, tape.running, why, other
        shown = Html(views.recording, args, key="recording")
        if tape.running:
            return [shown, Button("Stop recording", self.event(self.on_stop), key="stop")]
        found: list[PanelNode] = [shown]
        if tape.playable:
            ends = (0.0, recording.seconds)
            spec = replace(self.spec("at"), limits=ends, slider=ends, clip=True)
            play = Button("Pause" if tape.playing else "Play recording", self.event(self.on_play), key="play")
            found += [Control("at", spec=spec, of=id(recording)), play]
        saves = {kind: self.event(self.on_save, kind) for kind in WRITERS}
        discard = Button("Discard recording", self.event(self.on_discard), key="discard")
        return [*found, Buttons("Save as", saves, key="save"), discard, *new]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        drawn = tuple(self._drawings.values())
        found: list[SceneNode | Lazy] = [Lazy("drawings", nodes, (drawn,))] if drawn else []
        if self._measured is not None:
            found.append(ghost("measured", self.stage.now.robot, self._measured, GHOST, OPACITY))
        return found

    def on_open(self) -> None:
        """Show a code."""
        self.stage.door.open(self.stage.now.robot)

    def on_record(self) -> None:
        """Record what the program sends and hears from now on."""
        if (line := self.stage.door.line) is not None:
            self._tape.begin(line)
            self.change(at=0.0)

    def on_stop(self) -> None:
        """End the recording."""
        self._tape.end(STOPPED)
        self.change(at=self._tape.time)

    def on_play(self) -> None:
        """Play the recording, or leave the arm where it is."""
        if self._tape.playing:
            self._tape.stop()
        elif self._may_play():
            self._tape.play()

    def changed(self, path: str) -> None:
        self._tape.stop()
        if self._may_play():
            self._measured = self._tape.show(self.settings.at)

    def _may_play(self) -> bool:
        """Whether the arm may be moved as recorded."""
        if self._driven:
            words = f"{self._driven} is driven", "It would move as recorded. Let its program play the recording."
            self.stage.notify(Notice("error", *words))
        return self._tape.playable and not self._driven

    def on_save(self, kind: str) -> None:
        """Download the recording."""
        if self._tape.recording is not None:
            self._tape.save(kind)

    def on_discard(self) -> None:
        """Forget the recording, and the measured arm that it shows."""
        self._tape.discard()
        self._measured = None

    def on_close(self) -> None:
        """Withdraw the code, and remove what the program has drawn."""
        self.stage.door.close()
        self._tape.end(STOPPED)
        self._drawings, self._measured, self._was, self._driven = {}, None, "", ""
        self.stage.show_driven("")
        self.stage.notify(Notice("hand", "The code is withdrawn", "No program can move this page with it."))
