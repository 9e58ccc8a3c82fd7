"""The tab *Program*: waypoints recorded from the arm, planned as one motion, played and plotted.

Every change plans the motion anew. Playing samples it at the rate at which moving arms are shown; it ends when the
visitor moves the arm. ``static/program.js`` sends what is pressed and typed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable
from dataclasses import replace

import numpy as np

import kin
from app.exports.snippets import named
from app.viewer.feature import Feature, Stage
from app.viewer.own_arm import KEY
from app.viewer.panel import update_html
from app.viewer.panel.status import Notice
from app.viewer.tabs.program import items as changes
from app.viewer.tabs.program import views
from app.viewer.tabs.program.drawing import Drawing
from app.viewer.tabs.program.faults import Fault, find_fault
from app.viewer.tabs.program.files import LARGEST, read, toml_of
from app.viewer.tabs.program.items import MOST, PAUSE, Item, Items
from app.viewer.tabs.program.playback import Playback
from app.viewer.tabs.program.player import RATES
from app.viewer.tabs.program.plot import plot_html
from app.viewer.tabs.program.views import KINDS
from app.viewer.views.templates import render
from kin import InputError, KinematicsError
from kin.motion import Motion

PARTS = ("player", "clock", "list", "plot", "summary", "files")
LINK = 7000  # bytes of all programs in a link
_LABELS = {
    "record": "Record a pose", "pause": "Add a pause", "set": "Set to this pose", "duplicate": "Duplicate",
    "up": "Move up", "down": "Move down", "delete": "Delete", "go": "Go to", "scrub": "Time of the program",
    "clear": "Clear the program", "upload": "Open a program", "loop": "Loop", "field": "Waypoint",
}  # fmt: skip


class ProgramTab(Feature):
    """The programs of a visitor, one for each robot."""

    key = "program"
    title = "Program"
    messages = frozenset(
        {
            *("record", "pause", "choose", "field", "go", "set", "duplicate", "up", "down", "delete", "clear"),
            *("play", "scrub", "rate", "loop", "path", "joint", "download", "upload"),
        }
    )

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._programs: dict[str, Items] = {}  # by robot; `KEY` stands for the visitor's own arm
        self._playback = Playback(stage, self._show_clock)
        self._player = self._playback.player
        self._path = True  # whether the program is drawn in the scene
        self._joint: int | None = None  # the one in the plots; None: all
        self._chosen: int | None = None  # the item that is open
        self._revision = 0
        self._fault: Fault | None = None
        self._drawing: Drawing | None = None
        self._drawn: tuple[object, ...] = ()
        gui = stage.client.gui
        self._html = {name: gui.add_html("") for name in PARTS}
        self._item_handlers: dict[str, Callable[[int, object], None]] = {
            "choose": self._choose,
            "field": self._type,
            "go": lambda index, _: self._go_to_item(index),
            "set": lambda index, _: self._set_pose(index),
            "duplicate": lambda index, _: self._insert(index + 1, self._items[index]),
            "up": lambda index, _: self._move(index, index - 1),
            "down": lambda index, _: self._move(index, index + 1),
            "delete": lambda index, _: self._delete(index),
        }
        self._handlers: dict[str, Callable[[object], None]] = {
            "record": lambda _: self._record(),
            "pause": lambda _: self._insert(self._after, Item("pause", seconds=PAUSE)),
            "clear": lambda _: self._use((), None),
            "play": lambda _: self._playback.stop() if self._player.playing else self._play(),
            "scrub": self._scrub,
            "rate": self._set_rate,
            "loop": self._set_loop,
            "path": self._set_path,
            "joint": self._set_joint,
            "download": lambda _: self._download(),
            "upload": self._upload,
        }
        self._refresh()

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case (str(name), int(index), *_) if name in self._item_handlers and 0 <= index < len(self._items):
                self._item_handlers[name](index, value)
            case (str(name), int(), *_) if name in self._item_handlers:
                pass  # the item was deleted since
            case (str(name), *_) if name in self._handlers:
                self._handlers[name](value)
            case _:
                raise InputError("program", key, "the key of a button or a field")

    def step_name(self, key: Hashable) -> str:
        return _LABELS.get(str(key[0]), self.title) if isinstance(key, tuple) else self.title

    # Reports of the session

    def on_robot(self) -> None:
        self._chosen, self._joint, self._player.time = None, None, 0.0
        self._playback.stop()
        self._refresh()

    def on_request(self) -> None:
        if find_fault(self._items, self._motion, self.stage) != self._fault:
            self._refresh()

    def on_style(self) -> None:
        self._refresh()

    def tick(self, now: float) -> None:
        self.due = self._playback.tick(now)

    def state(self) -> dict[str, object]:
        found: dict[str, object] = {
            "programs": {key: changes.pack(items) for key, items in self._programs.items()}
        }
        if self._player.loop:
            found["loop"] = True
        if self._player.rate != 1.0:
            found["rate"] = self._player.rate
        if not self._path:
            found["path"] = False
        return found

    def restore(self, state: dict[str, object]) -> None:
        programs = state.get("programs")
        self._programs = {}
        robots = {robot.id: robot for robot in self.stage.store.robots}
        if self.stage.own is not None:
            robots[KEY] = self.stage.own.robot
        for key, value in programs.items() if isinstance(programs, dict) else ():
            items = changes.unpack(value, robots[key]) if key in robots else None
            if items is not None:
                self._programs[key] = items
        rate = state.get("rate", 1.0)
        self._player.loop = state.get("loop") is True
        self._player.rate = next((each for each in RATES if each == rate), 1.0)
        self._path = state.get("path") is not False
        self._playback.stop()
        self._refresh()

    def remove(self) -> None:
        self._playback.stop()
        self._path = False
        self._draw()

    # The program

    @property
    def _key(self) -> str:
        own = self.stage.own
        return KEY if own is not None and own.robot == self.stage.robot else self.stage.robot.id

    @property
    def _items(self) -> Items:
        """The list for the robot on show; a visitor's own arm may have another number of joints by now."""
        items = self._programs.get(self._key, ())
        return items if all(len(item.q) in (0, self.stage.robot.n) for item in items) else ()

    @property
    def _after(self) -> int:
        """Where a new item goes: behind the open one, else at the end."""
        return len(self._items) if self._chosen is None else self._chosen + 1

    def _use(self, items: Items, chosen: int | None) -> None:
        """Take another list, with this item open."""
        programs = {key: value for key, value in self._programs.items() if key != self._key}
        if items:
            programs[self._key] = items
        packed = {key: changes.pack(value) for key, value in programs.items()}
        if len(items) > len(self._items) and len(json.dumps(packed, ensure_ascii=False).encode()) > LINK:
            self._refuse("The link is full", "Delete waypoints, or save the program as a file and clear it.")
            return
        self._programs, self._chosen = programs, chosen
        self._playback.stop()
        self._refresh()

    @property
    def _motion(self) -> Motion | None:
        """The motion of the list; None: there is none, or it cannot be driven."""
        return self._playback.motion

    def _refresh(self) -> None:
        """Plan the motion, and show everything."""
        items, stage = self._items, self.stage
        start = changes.start_of(items)
        motion = None
        if start is not None:
            motion = kin.plan_motion(
                stage.robot, changes.program_of(items, stage.robot, self._player.loop), start.q
            )
        self._fault = find_fault(items, motion, stage)
        self._playback.use(items, motion if motion is not None and motion.planned else None)
        self._draw()
        self._show_player()
        self._show_list()
        self._show_plot()
        summary = ""
        if self._motion is not None:
            summary = views.summary(self._motion, self._motion.limits, stage.robot, self._key == KEY, stage.units)
        self._show("summary", summary)
        most = f"{LARGEST // 1000} kB"
        self._show("files", render("program/files", any=bool(items), most=most, bytes=LARGEST))
        self._show_clock()

    def _show(self, name: str, html: str) -> None:
        update_html(self._html[name], html)

    def _show_player(self) -> None:
        top = 0.0 if self._drawing is None else self._drawing.top_speed
        playable = self._motion is not None and self._motion.duration > 0.0 and self._fault is None
        shown = views.player(self._player, self._motion, playable, self._path, top) if self._items else ""
        self._show("player", shown)

    def _show_list(self) -> None:
        shown = views.items_html(
            self._items, self._chosen, self._motion, self._fault, self._player.loop, self._revision
        )
        self._show("list", shown)

    def _show_plot(self) -> None:
        motion = self._motion
        lasts = motion is not None and motion.duration > 0.0
        self._show(
            "plot", plot_html(motion, self._joint, self.stage.units) if motion is not None and lasts else ""
        )

    def _show_clock(self) -> None:
        self._show("clock", views.clock(self._player, self._playback.duration, self._playback.here))

    def _draw(self) -> None:
        """Draw the program in the scene, if it is another one than before."""
        stage = self.stage
        items = [item for item in self._items if item.q] if self._path else []
        faults = [] if self._fault is None else [i for i, item in enumerate(self._items) if item.q]
        fault = (
            faults.index(self._fault.index) if self._fault is not None and self._fault.index in faults else None
        )
        names = views.shown_names(self._items)
        drawn = (stage.robot, tuple(items), tuple(names), self._items, self._player.loop, fault)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
        if items:
            q = np.array([item.q for item in items])
            self._drawing = Drawing(stage.client.scene, stage.robot, q, names, fault)
            if self._motion is not None:
                self._drawing.show_path(self._motion)

    # Changes of the list

    def _record(self) -> None:
        self._insert(len(self._items), changes.waypoint(self.stage.goal), choose=False)

    def _insert(self, index: int, item: Item, choose: bool = True) -> None:
        if len(self._items) >= MOST:
            self._refuse("The program is full", f"It may have {MOST} waypoints and pauses.")
        else:
            self._use(changes.inserted(self._items, index, item), index if choose else None)

    def _choose(self, index: int, _: object) -> None:
        self._chosen = None if index == self._chosen else index
        self._show_list()

    def _set_pose(self, index: int) -> None:
        q = changes.waypoint(self.stage.goal).q
        self._use(changes.changed(self._items, index, q=q), index)

    def _move(self, index: int, to: int) -> None:
        if 0 <= to < len(self._items):
            self._use(changes.moved(self._items, index, to), to)

    def _delete(self, index: int) -> None:
        items = changes.removed(self._items, index)
        if not any(item.q for item in items):
            items = ()  # pauses alone are no program
        self._use(items, min(index, len(items) - 1) if items else None)

    def _type(self, index: int, value: object) -> None:
        match value:
            case ["kind", str(kind)] if kind in KINDS and self._items[index].kind in KINDS:
                values = {"kind": kind}
            case [str(field), text]:
                try:
                    values = dict(changes.value_of(field, text))
                except InputError as error:
                    self._refuse("The field stays as it was", f"“{text}” is not valid: expected {error.expected}.")
                    return
            case _:
                raise InputError("field", value, "name, kind, speed or seconds, and a text")
        self._revision += 1
        self._use(changes.changed(self._items, index, **values), index)

    def _refuse(self, title: str, detail: str) -> None:
        self._revision += 1  # what was typed is replaced
        self._show_list()
        self.stage.notify(Notice("error", title, detail))

    # Playing

    def _play(self) -> None:
        self._fault = find_fault(self._items, self._motion, self.stage)
        if self._motion is None or self._motion.duration == 0.0 or self._fault is not None:
            words = "Record at least two poses." if self._fault is None else self._fault.words
            self._refuse("The program cannot be played", words)
            return
        self._playback.play()
        self.due = 0.0

    def _scrub(self, time: object) -> None:
        if not isinstance(time, int | float) or isinstance(time, bool) or not 0.0 <= time < 1e9:
            raise InputError("time", time, "seconds, 0 or more")
        if self._motion is not None and self._fault is None:
            self._playback.go_to(float(time))

    def _go_to_item(self, index: int) -> None:
        item = self._items[index]
        if self._motion is not None:  # a line may end in another posture than the recorded one
            end = self._motion.segments[index].end
            self._playback.note(end)
            q = self._motion.derivatives(end)[0]
        else:
            q = np.array(next((each.q for each in reversed(self._items[: index + 1]) if each.q), self.stage.goal))
        title = item.name or (f"Waypoint {index + 1}" if item.q else "Pause")
        self.stage.move_to(self.stage.robot.clip(q), Notice("hand", title))

    # Choices

    def _set_rate(self, rate: object) -> None:
        if rate not in RATES:
            raise InputError("speed", rate, "one of " + ", ".join(map(str, RATES)))
        self._player.rate = float(rate)
        self._show_player()

    def _set_loop(self, on: object) -> None:
        self._player.loop = bool(on)
        self._playback.stop()
        self._refresh()

    def _set_path(self, on: object) -> None:
        self._path = bool(on)
        self._draw()
        self._show_player()

    def _set_joint(self, text: object) -> None:
        joint = int(text) if isinstance(text, str) and text.isdecimal() and len(text) < 4 else None
        self._joint = joint if joint is not None and joint < self.stage.robot.n else None
        self._show_plot()

    # Files

    def _download(self) -> None:
        if not self._items:
            return
        robot = self.stage.robot if self._key != KEY else named(self.stage.robot)
        program = replace(
            changes.program_of(self._items, self.stage.robot, self._player.loop), name=robot.name[:100]
        )
        name = f"{robot.id}-program.toml"
        self.stage.client.send_file_download(name, toml_of(program, robot.name).encode(), save_immediately=True)
        self.stage.notify(Notice("hand", f"{name} is saved", "Your browser has put it where it puts downloads."))

    def _upload(self, value: object) -> None:
        try:
            name, program = read(value, self.stage.robot)
            items = changes.items_of(program, self.stage.robot, self.stage.goal)
        except KinematicsError as error:
            self._refuse("The file was not used", str(error))
        else:
            self._use(items, None)
            self.stage.notify(Notice("hand", name, f"{len(items)} waypoints and pauses."))
