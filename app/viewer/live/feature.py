"""*Connect a program* in the tab *Program*: the code of the page, who is connected, what that program shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from app.live.announced import Announcement
from app.live.recording import Bounds, Recording
from app.live.recording.recording import READ
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory, slider
from app.viewer.declared.panel import Button, Buttons, Control, Html, Progress
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep, Work
from app.viewer.feature import Stage
from app.viewer.live import views
from app.viewer.live.drawings import Drawings, merged, nodes
from app.viewer.live.opening import Opening
from app.viewer.live.tape import BYTES, LONGEST, OF_ALL, WRITERS, Tape
from app.viewer.meshes.archive import MeshError
from app.viewer.meshes.incoming import IncomingFile, not_sent
from app.viewer.own_arm import own_arm
from app.viewer.page.controller import ArmController
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from kin import InputError, KinematicsError, robot_to_dict
from kin.collision import Contact
from kin.transforms import Array

STOPPED = "stopped"
UNUSED = "The file was not used"
OPENED = Bounds(LONGEST, BYTES, OF_ALL)
LOOK_AGAIN = 1.0  # s between two looks at the rate of a program and its delay
FRAME = 0.1  # s of a recording that pass at most between two frames of a driven arm
GHOST, OPACITY = (230, 159, 0), 0.45


AT_HINT = "Shows the arm as it was commanded then, and the measured arm beside it"


def check_gripper(arm: ArmController, field: str, opening: float) -> None:
    """Raises `InputError` while the arm on show has no gripper that opens."""
    if arm.opening is None:
        raise InputError(field, opening, f"an arm with a gripper that opens; the page shows {arm.robot.name}")


@dataclass(frozen=True)
class TapeSettings(Settings):
    """Where the recording is shown, and what a program sends. A link keeps nothing of a connection.

    Attributes:
        drawings: what the program draws.
        measured: where it has measured the arm ``(n,)``.
        measured_gripper: how far it has measured the gripper to be open, from 0 (closed) to 1 (open).
        driven: what it drives.
        announced: what it says of itself and offers, and a number of its own.
        said: what it has said of itself last.
        program: its name; "": none is connected.
        halted: why the page had it stop; "" once it drives again.
    """

    at: float = slider("Time (s)", 0.0, (0.0, LONGEST), hint=AT_HINT, digits=2, step=0.01, link=False)
    drawings: Drawings | None = memory(renew=False)
    measured: Array | None = memory()
    measured_gripper: float | None = memory()
    driven: str = memory("", renew=False)
    announced: tuple[int, Announcement] | None = memory(renew=False)
    said: Announcement | None = memory(renew=False)
    program: str = memory("", renew=False)
    halted: str = memory("", renew=False)


class Connect(DeclaredFeature[TapeSettings, Facts[TapeSettings]]):
    """See the module.

    Attributes:
        contacts: what the arm touches.
    """

    key = "connect"
    title = "Connected program"
    settings_of, facts_of = TapeSettings, Facts
    messages = frozenset({"upload", "stop", "press", "confirm", "halt"})
    files = MappingProxyType({"upload": OPENED.size})
    undo: ClassVar[dict[str, str]] = {"on_show_arm": "Another arm"}

    def __init__(self, stage: Stage) -> None:
        self.contacts: Sequence[Contact] = ()
        self._numbers = count(1)
        self._tape = Tape(stage)
        self._opening = Opening(stage, self.post, OPENED)
        super().__init__(stage)

    # What the program sends

    def use(self, values: Mapping[str, Any]) -> None:
        """Take what the program says, draws and measures; raises `kin.InputError`."""
        self.schedule()
        if "drives" in values and self.settings.driven != (values["drives"] or ""):
            self.change(driven=values["drives"] or "", halted="" if values["drives"] else self.settings.halted)
            self._tape.stop()
        if "announce" in values:
            said = values["announce"]
            numbered = None if said is None else (next(self._numbers), said)
            self.change(announced=numbered, said=said or self.settings.said)
        if not {"drives", "announce"}.isdisjoint(values):
            self._show_driven()
        if "measured" in values:
            measured = values["measured"]
            if measured is not None:
                measured = self.stage.arm.now.robot.check_q(measured, "measured")
            self.change(measured=measured)
        if "measured_gripper" in values:
            opening = values["measured_gripper"]
            if opening is not None:
                check_gripper(self.stage.arm, "measured_gripper", opening)
            self.change(measured_gripper=opening)
        if values.get("clear"):
            self.change(drawings=None)
        if drawn := values.get("draw"):
            self.change(drawings=merged(self.settings.drawings or {}, drawn, self._numbers))

    def follow_gripper(self) -> None:
        """The gripper on show opens or closes: its difference from the measured one changes."""
        if self.settings.measured_gripper is not None:
            self.schedule()

    def _show_driven(self) -> None:
        """Frame the page while something is driven, with what stops it."""
        driven, found = self.settings.driven, self.settings.announced
        stop = None if found is None else found[1].stop
        self.stage.channel.show("driven", driven)
        self.stage.channel.show("stop", ["", ""] if stop is None or not driven else [stop.name, stop.label])

    def halt(self, why: str) -> bool:
        """Have a program that drives something stop, as *Stop* does: not the visitor moves the page's arm now.

        A recording that is played stops, too. Returns whether there is such a program. Its connection ends where
        it offers nothing that stops it.
        """
        self._tape.stop()
        line = self.stage.door.line
        said = None if line is None else line.announced
        stop = None if said is None else said.stop
        enabled = stop is not None and said is not None and said.state == "enabled"
        if line is None or not (self.settings.driven or enabled):
            return False
        self.schedule()
        if stop is not None and line.press(stop.name):
            self.change(halted=why)
        else:
            self.on_close()
        return True

    def _press(self, event: str, name: str, number: object) -> None:
        """Pass a press on to the program; raises `InputError` for one that no button of ours sends.

        What stops something counts whatever else the program has announced since.
        """
        line, (own, seen) = self.stage.door.line, self.settings.announced or (0, None)
        if event == "halt":
            passed = line is not None and line.press(name)
        else:
            button = None if seen is None or number != own else seen.button(name)
            if button is not None and button.event != event:
                raise InputError("button", f"{event} {name}", f"{button.event} {name}")
            passed = line is not None and button is not None and line.press(name, seen)
        if not passed:
            words = "The program has changed what it offers. Look at its buttons, and press again."
            self.stage.status.show(Notice("advice", "Not passed on", words))

    # A recording that is opened

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case ("arriving", "upload") if isinstance(value, IncomingFile):
                self._opening.expect(value)
            case ("stop", int()):
                self.on_close()
            case ("press" | "confirm" | "halt" as event, str(name), int()):
                self._press(event, name, value)
            case ("upload",):
                if isinstance(value, IncomingFile):
                    self._opening.take(value)
                else:
                    self.stage.status.show(Notice("error", *not_sent(value)))
            case ("read", int(number)):
                self._try(lambda: self._use(self._opening.result(number, value)))
            case _:
                super().heard(key, value)

    def step_name(self, key: Hashable) -> str:
        return "Recording opened" if isinstance(key, tuple) and key[0] == "read" else super().step_name(key)

    def _try(self, act: Callable[[], None]) -> None:
        try:
            act()
        except (MeshError, KinematicsError) as error:
            words = (
                f"{error.field}: got {error.value}, expected {error.expected}"
                if isinstance(error, MeshError)
                else str(error)
            )
            self.stage.status.show(Notice("error", UNUSED, words))

    def _use(self, recording: Recording | None) -> None:
        """Have a recording in place of the last one, and show its arm unless something is driven."""
        if recording is None:
            return
        self._tape.open(recording)
        self.change(at=0.0, measured=None, measured_gripper=None)
        self.rewrite()
        if recording.robot != self.stage.arm.now.robot and not self.settings.driven:
            self.on_show_arm()
        words = f"{recording.seconds:.1f} s of the {recording.robot.name}. Play it in the tab Program."
        self.stage.status.show(Notice("hand", f"{self._opening.name} is open", words))

    def on_show_arm(self) -> None:
        """Show the arm of the recording; raises `InputError`."""
        recording = self._tape.recording
        assert recording is not None
        if self.settings.driven:
            words = (
                f"{self.settings.driven} is driven",
                "Another arm on show would be driven as well. End its program first.",
            )
            self.stage.status.show(Notice("error", *words))
        elif recording.robot in self.stage.services.store.robots:
            self.stage.robots.show(recording.robot)
        else:
            own = own_arm(robot_to_dict(recording.robot))
            recording.robot = own.robot
            self.stage.robots.show_own(own)

    def on_cancel(self) -> None:
        """Open no recording after all."""
        self._opening.stop()

    # Feature

    def on_robot(self) -> None:
        self._tape.end("another arm was shown")
        self._tape.stop()
        super().on_robot()

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        self.contacts = contacts

    def on_leave(self) -> None:
        super().on_leave()
        self._opening.stop()
        self._tape.discard()
        self.stage.door.close("The page was closed.")

    @property
    def offer(self) -> str:
        program, found = self.settings.program, self.settings.announced
        if not program:
            return ""
        return views.stop(program) if found is None else views.announced(program, *found, self.settings.halted)

    # Declared

    def running(self) -> Sequence[Work | Sweep]:
        line = self.stage.door.line
        name = "" if line is None or line.program is None else line.program.name
        found: list[Work | Sweep] = [Work("program", self._meet, (name,))]
        if self._tape.playing:
            # A driven arm goes on where it was after a pause of the machine.
            most = FRAME if self.settings.driven else math.inf
            found.append(Sweep(self._play, self.stage.services.pace.interval, most))
        elif name or self._tape.running or self._opening.busy is not None:
            found.append(Sweep(self._look, LOOK_AGAIN))
        return found

    def _meet(self, name: str) -> None:
        """Say who has connected or left."""
        before = self.settings.program
        self.change(program=name, halted=self.settings.halted if name == before else "")
        if name and name != before:
            self.stage.status.show(Notice("hand", f"{name} is connected", "It may move the arm. Tab Program."))
        elif before and not name and self.stage.door.line is not None:
            said = self.settings.said
            self.change(said=None)
            bad = said is not None and said.state in ("stopped", "fault")
            words = said.words if said is not None and bad else "The code still counts."
            self.stage.status.show(Notice("error" if bad else "hand", f"{before} has left", words))

    def _look(self, seconds: float) -> None:
        """Look at the rate of the program and its delay, and how far a recording or a file is."""
        self.schedule()

    def _play(self, seconds: float) -> None:
        """Show the next frame of the recording; a driven arm is led by it, and its own ghost stays."""
        if self.settings.driven:
            if (measured := self._driven_arm()) is not None:
                self._tape.lead(seconds, measured)
        else:
            self.change(measured=self._tape.advance(seconds), measured_gripper=self._tape.measured_gripper)
        self.change(at=self._tape.time)
        self.rewrite()

    def panel(self) -> Sequence[PanelNode]:
        door, line = self.stage.door, self.stage.door.line
        shown = [*self._compared(), *self._recorded()]
        if door.locked:
            return shown
        if line is None:
            about = Html(views.about)
            return [about, Button("Connect a program", self.event(self.on_open), key="open"), *shown]
        code = Html(views.code, (line.code, self.stage.links.service.address), key="code")
        state = Html(views.state, views.state_of(line.program), key="state")
        hint = "The connection ends, and this code counts no more"
        return [code, state, *shown, Button("Withdraw the code", self.event(self.on_close), hint, key="close")]

    def _compared(self) -> list[PanelNode]:
        """Where the arm was measured, and by how much that is beyond where it is commanded."""
        f, measured = self.read, self.settings.measured
        opening, commanded = self.settings.measured_gripper, self.stage.arm.opening
        joints = None if measured is None else (np.round(measured - f.q, 6).tobytes(), measured.tobytes())
        fingers = None if opening is None or commanded is None else (opening, commanded)
        if joints is None and fingers is None:
            return []
        return [Html(views.measured, (f.robot, joints, fingers, self.stage.display.units), key="measured")]

    def _recorded(self) -> list[PanelNode]:
        """The recording, and what can be done with it."""
        tape, hint = self._tape, "What the program sends and hears from now on"
        recording = tape.recording
        label = "Record the connection" if recording is None else "Record anew"
        begin = Button(label, self.event(self.on_record), hint, key="record")
        new: list[PanelNode] = [] if self.stage.door.line is None else [begin]
        if (busy := self._opening.busy) is not None:
            words, done = busy
            cancel = Button("Cancel", self.event(self.on_cancel), "Opens no recording", key="cancel")
            new += [Html(views.opening, (words,), key="opening"), Progress(done, key="opened"), cancel]
        if recording is None:
            return new
        why = "" if recording.ended in (None, STOPPED, READ) else recording.ended
        other = "" if recording.robot == self.stage.arm.now.robot else recording.robot.name
        state = "running" if tape.running else "opened" if recording.ended == READ else "ended"
        args = round(recording.seconds, 1), len(recording.entries), recording.size, state, why, other
        shown = Html(views.recording, args, key="recording")
        if tape.running:
            return [shown, Button("Stop recording", self.event(self.on_stop), key="stop")]
        found: list[PanelNode] = [shown]
        if tape.playable:
            ends = (0.0, recording.seconds)
            spec = replace(self.spec("at"), limits=ends, slider=ends, clip=True)
            play = Button("Pause" if tape.playing else "Play recording", self.event(self.on_play), key="play")
            found += [Control("at", spec=spec, of=id(recording)), play]
        if other:
            found.append(
                Button("Show that arm", self.event(self.on_show_arm), "The arm of the recording", key="arm")
            )
        saves = {kind: self.event(self.on_save, kind) for kind in WRITERS}
        discard = Button("Discard recording", self.event(self.on_discard), key="discard")
        return [*found, Buttons("Save as", saves, key="save"), discard, *new]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        drawn, measured = tuple((self.settings.drawings or {}).values()), self.settings.measured
        found: list[SceneNode | Lazy] = [Lazy("drawings", nodes, (drawn,))] if drawn else []
        if measured is not None:
            found.append(ghost("measured", self.stage.arm.now.robot, measured, GHOST, OPACITY))
        return found

    def on_open(self) -> None:
        """Show a code."""
        self.stage.door.open(self.stage.arm.now.robot)

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
        if self.settings.driven:
            self._tape.time = self.settings.at
            words = f"Play recording has {self.settings.driven} go on from there."
            self.stage.status.show(Notice("hand", f"The recording at {self._tape.time:.2f} s", words))
        elif self._tape.playable:
            self.change(measured=self._tape.show(self.settings.at), measured_gripper=self._tape.measured_gripper)

    def _driven_arm(self) -> Array | None:
        """Where a driven arm is ``(n,)``, as its program says; None: it does not."""
        line = self.stage.door.line
        found = None if line is None or line.measured is None else np.array(line.measured)
        return found if found is None or len(found) == self.stage.arm.now.robot.n else None

    def _may_play(self) -> bool:
        """Whether the arm may be moved as recorded: a driven one must say where it is, to be waited for."""
        if self.settings.driven and self._driven_arm() is None:
            title = f"{self.settings.driven} is driven"
            detail = "It does not say where it is, so a recording cannot wait for it. Its program can play it."
            self.stage.status.show(Notice("error", title, detail))
            return False
        return self._tape.playable

    def on_save(self, kind: str) -> None:
        """Download the recording."""
        if self._tape.recording is not None:
            self._tape.save(kind)

    def on_discard(self) -> None:
        """Forget the recording, and the measured arm that it shows."""
        self._tape.discard()
        self.change(measured=None, measured_gripper=None)

    def on_close(self) -> None:
        """Withdraw the code, and remove what the program has drawn."""
        self.stage.door.close()
        self._tape.end(STOPPED)
        self.change(drawings=None, measured=None, measured_gripper=None)
        self.change(program="", driven="", announced=None, halted="")
        self._show_driven()
        self.stage.status.show(Notice("hand", "The code is withdrawn", "No program can move this page with it."))
