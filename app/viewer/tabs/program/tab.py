"""The tab *Program*: waypoints recorded from the arm, planned as one motion, played and plotted.

Every change plans the motion anew. Playing samples it at the rate at which moving arms are shown; it ends when the
visitor moves the arm. ``static/program.js`` sends what is pressed and typed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np

import kin
from app.exports.motion_snippets import SNIPPETS
from app.exports.program_toml import toml_of
from app.exports.snippets import named
from app.viewer.feature import Feature, Stage
from app.viewer.own_arm import KEY
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.program import items as changes
from app.viewer.tabs.program.compare import CHOICES, ZONE, Choice, other_motion
from app.viewer.tabs.program.faults import Fault, find_fault
from app.viewer.tabs.program.files import motion_file, read
from app.viewer.tabs.program.items import MOST, PAUSE, Item, Items
from app.viewer.tabs.program.links import pack, unpack
from app.viewer.tabs.program.planning import Plan, halfway, items_of, plan
from app.viewer.tabs.program.playback import RATES, Playback
from app.viewer.tabs.program.postures import Chart, compute
from app.viewer.tabs.program.screen import Screen
from app.viewer.tabs.program.views import KINDS
from app.viewer.tabs.program.ways import Ways
from app.viewer.tabs.workspace.background import run_in_background
from app.viewer.takehome.sending import send_page
from kin import InputError, KinematicsError
from kin.files.numbers import index_of
from kin.motion import Motion, Program
from kin.typed import EntryError
from kin.warmup import MOTIONS

REPLAN = 0.2  # s without a change of the obstacles until the motion is planned again
LINK = 7000  # bytes of all programs in a link
_LABELS = {
    "record": "Record a pose", "pause": "Add a pause", "set": "Set to this pose", "duplicate": "Duplicate",
    "up": "Move up", "down": "Move down", "delete": "Delete", "go": "Go to", "scrub": "Time of the program",
    "clear": "Clear the program", "upload": "Open a program", "loop": "Loop", "field": "Waypoint",
    "via": "Via point", "ptp": "PTP instead", "take": "Joints of arrival",
    "start": "Start in another posture",
    "begin": "Start in another posture", "searched": "Find a way",
}  # fmt: skip


class ProgramTab(Feature):
    """The programs of a visitor, one for each robot."""

    key = "program"
    title = "Program"
    shared = True
    kernels = (MOTIONS,)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._programs: dict[str, Items] = {}  # by robot; `KEY` stands for the visitor's own arm
        self._playback = Playback(stage, self._show_clock)
        self._player = self._playback.player
        self._plan: Plan | None = None
        self._fault: Fault | None = None
        self._compared: Choice | None = None
        self._zone = ZONE
        self._chart: Chart | None = None
        self._stale: float | None = None  # when the motion is planned again, after the obstacles have changed
        self._other: Motion | None = None
        self._screen = Screen(stage)
        self._ways = Ways(stage, self._screen.way, self.post)
        self._progress: dict[str, object] = {}
        self._refresh()

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case (str(name), int(index), *_) if name in _ITEM_HANDLERS and 0 <= index < len(self._items):
                _ITEM_HANDLERS[name](self, index, value)
            case (str(name), int(), *_) if name in _ITEM_HANDLERS:
                pass  # the item was deleted since
            case (str(name), *_) if name in _HANDLERS:
                _HANDLERS[name](self, value)
            case _:
                raise InputError("program", key, "the key of a button or a field")

    def step_name(self, key: Hashable) -> str:
        return _LABELS.get(str(key[0]), self.title) if isinstance(key, tuple) else self.title

    # What a connected program does

    def load(self, program: Program, name: str) -> None:
        """Take a program in place of the one on show; raises `InputError`, and nothing has changed then."""
        arm = self.stage.now
        items = items_of(program, arm.robot, arm.goal)
        self._use(items, None)
        if self._items != items:
            raise InputError("program", changes.counted(items), "programs of all arms that fit into a link")
        if self._fault is None:
            self.stage.notify(Notice("hand", f"A program from {name}", changes.counted(items)))

    def start(self, on: bool) -> None:
        """Play from the beginning, or stop; raises `InputError` if nothing can be played."""
        self._playback.stop()
        if not on:
            return
        self._player.time = 0.0
        self._play(None)
        if not self._player.playing:
            words = "no program" if self._fault is None else self._fault.words
            raise InputError("play", words, "a program of at least two poses that can be driven")

    @property
    def progress(self) -> dict[str, object]:
        """Whether a program plays, and where it is; the same object while that is the same."""
        player, whole = self._player, self._fault is None and self._whole is not None
        duration = self._playback.duration
        found: dict[str, object] = {
            "items": len(self._items),
            "playing": player.playing,
            "time": player.time,
            "duration": duration,
        }
        found["complete"] = whole
        if found != self._progress:
            self._progress = found
        return self._progress

    # Reports of the session

    @property
    def failure(self) -> str:
        return "" if self._fault is None or not self._items else "the program cannot be driven to its end"

    def on_robot(self) -> None:
        self._screen.chosen, self._screen.joint, self._player.time = None, None, 0.0
        self._playback.stop()
        self._refresh()

    def on_request(self) -> None:
        if find_fault(self._plan, self.stage) != self._fault:
            self._refresh()

    def on_style(self) -> None:
        self._refresh()

    def on_obstacles(self) -> None:
        if self._items:
            self._stale, self.due = time.perf_counter() + REPLAN, REPLAN

    def tick(self, now: float) -> None:
        if self._stale is not None and now >= self._stale:
            self._refresh()
        self.due = self._playback.tick(now)
        if self._stale is not None:
            self.due = min(self.due or REPLAN, REPLAN)

    def state(self) -> dict[str, object]:
        found: dict[str, object] = {"programs": {key: pack(items) for key, items in self._programs.items()}}
        usual = {"loop": False, "rate": 1.0, "path": True, "ghosts": False, "frames": False, "compare": None}
        shown = self._screen.shown
        now = {
            "loop": self._player.loop, "rate": self._player.rate, "path": shown.path, "ghosts": shown.ghosts,
            "frames": shown.frames, "compare": self._compared,
        }  # fmt: skip
        return found | {key: value for key, value in now.items() if value != usual[key]}

    def restore(self, state: dict[str, object]) -> None:
        programs = state.get("programs")
        self._programs = {}
        robots = {robot.id: robot for robot in self.stage.store.robots}
        if self.stage.own is not None:
            robots[KEY] = self.stage.own.robot
        for key, value in programs.items() if isinstance(programs, dict) else ():
            items = unpack(value, robots[key]) if key in robots else None
            if items is not None:
                self._programs[key] = items
        rate, compared = state.get("rate", 1.0), state.get("compare")
        self._player.loop = state.get("loop") is True
        self._player.rate = next((each for each in RATES if each == rate), 1.0)
        self._compared = next((each for each in CHOICES if each == compared), None)
        ghosts, frames = (state.get(each) is True for each in ("ghosts", "frames"))
        shown = replace(self._screen.shown, path=state.get("path") is not False, ghosts=ghosts, frames=frames)
        self._screen.shown = shown
        self._playback.stop()
        self._refresh()

    def extents(self) -> Sequence[Sphere]:
        return self._screen.extents

    def on_leave(self) -> None:
        self._ways.cancel()
        if self._chart is not None:
            self._chart.cancelled.set()

    def remove(self) -> None:
        self.on_leave()
        self._playback.stop()
        self._screen.remove()

    # The program

    @property
    def _key(self) -> str:
        own = self.stage.own
        return KEY if own is not None and own.robot == self.stage.now.robot else self.stage.now.robot.id

    @property
    def _items(self) -> Items:
        """The list for the robot on show; a visitor's own arm may have another number of joints by now."""
        items = self._programs.get(self._key, ())
        return items if all(len(item.q) in (0, self.stage.now.robot.n) for item in items) else ()

    def _use(self, items: Items, chosen: int | None) -> None:
        """Take another list, with this item open."""
        programs = {key: value for key, value in self._programs.items() if key != self._key}
        if items:
            programs[self._key] = items
        packed = {key: pack(value) for key, value in programs.items()}
        if len(items) > len(self._items) and len(json.dumps(packed, ensure_ascii=False).encode()) > LINK:
            self._refuse("The link is full", "Delete waypoints, or save the program as a file and clear it.")
            return
        self._programs, self._screen.chosen = programs, chosen
        self._playback.stop()
        self._refresh()
        self._say_fault()

    @property
    def _motion(self) -> Motion | None:
        """The motion of the list, or the part of it that can be driven; None: there is none."""
        return self._playback.motion

    @property
    def _whole(self) -> Motion | None:
        """The motion of the whole list; None: it cannot be driven."""
        return self._motion if self._plan is not None and self._plan.motion.planned else None

    def _refresh(self, anew: bool = False) -> None:
        """Plan the motion, and show everything; `anew`: what was typed into the fields is replaced."""
        arm, items, stage, loop = self.stage.now, self._items, self.stage, self._player.loop
        self._keep_postures()
        self._ways.keep(items)
        self._plan, self._stale = plan(items, arm.robot, loop, arm.avoid, arm.obstacles), None
        self._fault = find_fault(self._plan, stage)
        self._playback.use(self._plan if self._plan is not None and self._plan.driven is not None else None)
        self._other = None
        if self._compared is not None and self._whole is not None:
            self._other = other_motion(items, arm.robot, loop, self._compared, self._zone)
        self._screen.draw(items, self._plan, self._fault, loop, self._other)
        self._show_player()
        self._show_list(anew)
        self._screen.plot(self._motion, self._other)
        self._screen.summary(self._plan, self._key == KEY)
        self._screen.compare(self._whole, self._other, self._compared, self._zone)
        self._screen.files(self._motion, bool(items), self._key == KEY)
        self._show_clock()

    def _say_fault(self) -> None:
        """Say in the status card where the program ends, if it cannot be driven to its end."""
        if self._fault is None or self._plan is None:
            return
        index, count = self._fault.index, len(self._items)
        where = "on the way back to the start" if index >= count else f"on the way to {index + 1} of {count}"
        if index < count and self._items[index] is changes.start_of(self._items):
            where = "at its start"
        self.stage.notify(Notice("error", f"The program ends {where}", self._fault.words))

    def _show_player(self) -> None:
        playable = self._motion is not None and self._motion.duration > 0.0 and not self._blocked
        self._screen.player(self._playback, bool(self._items), playable)

    @property
    def _blocked(self) -> bool:
        """Whether nothing may be played, as a locked joint would move."""
        return self._fault is not None and self._fault.whole

    def _show_list(self, anew: bool = False) -> None:
        self._screen.list(self._items, self._plan, self._fault, self._player.loop, anew)

    def _show_clock(self) -> None:
        self._screen.clock(self._playback)

    # Changes of the list

    def _record(self, _: object) -> None:
        self._insert(len(self._items), changes.waypoint(self.stage.now.goal), choose=False)

    def _pause(self, _: object) -> None:
        """Add a pause behind the open item, else at the end."""
        chosen = self._screen.chosen
        self._insert(len(self._items) if chosen is None else chosen + 1, Item("pause", seconds=PAUSE))

    def _insert(self, index: int, item: Item, choose: bool = True) -> None:
        if len(self._items) >= MOST:
            self._refuse("The program is full", f"It may have {MOST} waypoints and pauses.")
        else:
            self._use(changes.inserted(self._items, index, item), index if choose else None)

    def _choose(self, index: int, _: object) -> None:
        self._screen.chosen = None if index == self._screen.chosen else index
        self._show_list()

    def _set_pose(self, index: int, _: object) -> None:
        q = changes.waypoint(self.stage.now.goal).q
        self._use(changes.changed(self._items, index, q=q), index)

    def _set_via(self, index: int, _: object) -> None:
        via = changes.point(self.stage.now.T_goal[:3, 3])
        self._use(changes.changed(self._items, index, kind="circ", via=via), index)

    def _move(self, index: int, to: int) -> None:
        if 0 <= to < len(self._items):
            self._use(changes.moved(self._items, index, to), to)

    def _delete(self, index: int, _: object) -> None:
        items = changes.removed(self._items, index)
        if not any(item.q for item in items):
            items = ()  # pauses alone are no program
        self._use(items, min(index, len(items) - 1) if items else None)

    def _use_ptp(self, index: int, _: object) -> None:
        """Drive to a waypoint, and to those of the same spline before it, by PTP."""
        items, first = self._items, index
        while first > 0 and changes.passed_through(items, first - 1):
            first -= 1
        for i in range(first, index + 1):
            if items[i].q:
                items = changes.changed(items, i, kind="ptp", via=None)
        self._use(items, self._screen.chosen)

    def _take(self, index: int, _: object) -> None:
        """Record the joint values in which the arm arrives at a waypoint."""
        arrival = None if self._plan is None else self._plan.otherwise.get(index)
        if arrival is not None:
            self._use(changes.changed(self._items, index, q=changes.configuration(arrival.q)), self._screen.chosen)

    def _start(self, index: int, _: object) -> None:
        """Change the posture at the waypoint before, so that the arm arrives as recorded."""
        found = None if self._plan is None else self._plan.start_as_recorded(index)
        if found is not None:
            before, q = found
            self._use(changes.changed(self._items, before, q=changes.configuration(q)), self._screen.chosen)

    # Postures along the way

    def _show_postures(self, index: int, _: object) -> None:
        """Compute the chart of the way to a waypoint, in the background."""
        self._close_postures(None)
        if self._plan is None:
            return
        self._chart = chart = Chart(index, self._plan, self.stage.now)
        self._screen.postures(chart)

        def work() -> None:
            compute(chart)
            self.post(("charted",), chart)

        run_in_background(work, "postures", lambda key, value: self.post((key,), value))

    def _charted(self, chart: object) -> None:
        if chart is self._chart:
            self._screen.postures(self._chart)

    def _failed(self, error: object) -> None:
        self._close_postures(None)
        self._ways.close()
        if isinstance(error, BaseException):
            raise error

    def _keep_postures(self) -> None:
        """Close the chart, unless nothing has changed that it depends on; its words may have other units."""
        if self._chart is not None and not self._chart.fits(self._items, self.stage.now):
            self._close_postures(None)
        self._screen.postures(self._chart)

    def _close_postures(self, _: object) -> None:
        if self._chart is not None:
            self._chart.cancelled.set()
            self._chart = None
            self._screen.postures(None)

    def _begin(self, index: int, row: object) -> None:
        """Start in a posture of the chart: the waypoint before takes its joint values."""
        chart = self._chart
        found = None if chart is None or chart.index != index else chart.found
        if found is None or (place := index_of(row, len(found.postures))) is None:
            return
        before = max((i for i, item in enumerate(self._items[:index]) if item.q), default=None)
        if found.reach[0, place] < 0 or before is None:
            return
        q = found.q[0, place]
        recorded = None if self._plan is None else self._plan.start_as_recorded(index)
        if recorded is not None and kin.branch_of(found.robot, recorded[1]) == found.postures[place]:
            q = recorded[1]  # of this posture, the whole turns from which it arrives as recorded
        self._use(changes.changed(self._items, before, q=changes.configuration(q)), self._screen.chosen)

    # A way around obstacles

    def _searched(self, search: object) -> None:
        """Put the waypoints of a way into the list."""
        found = self._ways.ended(search)
        if found is None or found.found is None:
            return
        chosen = self._screen.chosen
        self._use(found.found, chosen if chosen is None or chosen < found.index else chosen + found.count)
        touched = None if self._plan is None else self._plan.touched_on_way_to
        touched = touched if self._fault is None else self._fault.index
        if self._items == found.found and (touched is None or not found.leads_by(touched)):
            self.stage.notify(Notice("hand", *found.said()))

    def _type(self, index: int, value: object) -> None:
        item = self._items[index]
        match value:
            case ["kind", str(kind)] if kind in KINDS and item.kind in KINDS:
                via = (item.via or halfway(self._items, index, self.stage.now.robot)) if kind == "circ" else None
                values = {"kind": kind, "via": via}
            case ["values", ("joints" | "pose") as shown]:
                self._screen.by_pose = shown == "pose"
                self._show_list()
                return
            case [str(field), text]:
                try:
                    values = dict(self._screen.fields.read(field, text, item))
                except EntryError as error:
                    self._refuse(error.title, error.detail)
                    return
            case _:
                raise InputError("field", value, "the name of a field, and a text")
        self._use(changes.changed(self._items, index, **values), index)
        self._show_list(anew=True)

    def _refuse(self, title: str, detail: str) -> None:
        self._show_list(anew=True)
        self.stage.notify(Notice("error", title, detail))

    # Playing

    def _play(self, _: object) -> None:
        if self._player.playing:
            self._playback.stop()
            return
        self._fault = find_fault(self._plan, self.stage)
        if self._motion is None or self._motion.duration == 0.0 or self._blocked:
            words = "Record at least two poses." if self._fault is None else self._fault.words
            self._refuse("The program cannot be played", words)
            return
        self._playback.play()
        self.due = 0.0

    def _scrub(self, time: object) -> None:
        if not isinstance(time, int | float) or isinstance(time, bool) or not 0.0 <= time < 1e9:
            raise InputError("time", time, "seconds, 0 or more")
        if self._motion is not None and not self._blocked:
            self._playback.go_to(float(time))

    def _go_to_item(self, index: int, _: object) -> None:
        item = self._items[index]
        if self._plan is not None and self._motion is not None and index < len(self._plan.ends):
            end = self._plan.ends[index]  # a line may end in another posture than the recorded one
            self._playback.note(end)
            q = self._motion.derivatives(end)[0]
            if item.blend:
                q = np.array(item.q)  # the motion leaves before
        else:
            q = np.array(
                next((each.q for each in reversed(self._items[: index + 1]) if each.q), self.stage.now.goal)
            )
        title = item.name or (f"Waypoint {index + 1}" if item.q else "Pause")
        self.stage.move_to(self.stage.now.robot.clip(q), Notice("hand", title))

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

    def _set_shown(self, name: str, on: object) -> None:
        self._screen.shown = replace(self._screen.shown, **{name: bool(on)})
        self._screen.draw(self._items, self._plan, self._fault, self._player.loop, self._other)
        self._show_player()

    def _set_joint(self, text: object) -> None:
        self._screen.joint = index_of(text, self.stage.now.robot.n)
        self._screen.plot(self._motion, self._other)

    def _compare(self, value: object) -> None:
        self._compared = next((each for each in CHOICES if each == value), None)
        self._refresh()

    def _set_zone(self, text: object) -> None:
        try:
            self._zone = self._screen.fields.read("blend", text, Item("ptp"))["blend"]
        except EntryError as error:
            self.stage.notify(Notice("error", error.title, error.detail))
        self._refresh()

    def _set_language(self, name: object) -> None:
        if name not in SNIPPETS:
            raise InputError("language", name, "one of " + ", ".join(SNIPPETS))
        self._screen.language = str(name)
        self._screen.files(self._motion, bool(self._items), self._key == KEY)

    # Files

    def _download(self, _: object) -> None:
        if self._plan is None:
            return
        robot = self.stage.now.robot if self._key != KEY else named(self.stage.now.robot)
        program = replace(self._plan.motion.program, name=robot.name[:100])
        name, data = f"{robot.id}-program.toml", toml_of(program, robot.name).encode()
        self.stage.client.send_file_download(name, data, save_immediately=True)
        self.stage.notify(Notice("hand", f"{name} is saved", "Your browser has put it where it puts downloads."))

    def _save(self, name: object) -> None:
        """Download the motion over time, or the part of it that can be driven."""
        if self._motion is None:
            return
        motion = self._motion if self._key != KEY else replace(self._motion, robot=named(self._motion.robot))
        try:
            file, data, sampled = motion_file(motion, name)
        except InputError as error:
            self._refuse("The motion was not saved", f"This format is for {error.expected}.")
            return
        self.stage.client.send_file_download(file, data, save_immediately=True)
        part = "" if self._whole is not None else "Only up to where the program ends. "
        self.stage.notify(Notice("hand", f"{file} is saved", f"{part}{sampled}Radians, metres and seconds."))

    def _upload(self, value: object) -> None:
        arm = self.stage.now
        try:
            name, program = read(value, arm.robot)
            items = items_of(program, arm.robot, arm.goal)
        except KinematicsError as error:
            self._refuse("The file was not used", str(error))
        else:
            self._use(items, None)
            if self._fault is None:
                self.stage.notify(Notice("hand", name, changes.counted(items)))


_ITEM_HANDLERS: dict[str, Callable[[ProgramTab, int, object], None]] = {
    "choose": ProgramTab._choose,
    "field": ProgramTab._type,
    "go": ProgramTab._go_to_item,
    "set": ProgramTab._set_pose,
    "via": ProgramTab._set_via,
    "ptp": ProgramTab._use_ptp,
    "take": ProgramTab._take,
    "postures": ProgramTab._show_postures,
    "way": lambda tab, index, _: tab._ways.open(tab._plan, index),
    "begin": ProgramTab._begin,
    "start": ProgramTab._start,
    "duplicate": lambda tab, index, _: tab._insert(index + 1, tab._items[index]),
    "up": lambda tab, index, _: tab._move(index, index - 1),
    "down": lambda tab, index, _: tab._move(index, index + 1),
    "delete": ProgramTab._delete,
}
_HANDLERS: dict[str, Callable[[ProgramTab, object], None]] = {
    "record": ProgramTab._record,
    "pause": ProgramTab._pause,
    "clear": lambda tab, _: tab._use((), None),
    "play": ProgramTab._play,
    "scrub": ProgramTab._scrub,
    "rate": ProgramTab._set_rate,
    "loop": ProgramTab._set_loop,
    "path": lambda tab, on: tab._set_shown("path", on),
    "ghosts": lambda tab, on: tab._set_shown("ghosts", on),
    "frames": lambda tab, on: tab._set_shown("frames", on),
    "joint": ProgramTab._set_joint,
    "compare": ProgramTab._compare,
    "zone": ProgramTab._set_zone,
    "language": ProgramTab._set_language,
    "download": ProgramTab._download,
    "save": ProgramTab._save,
    "page": lambda tab, _: send_page(tab.stage, tab._motion),
    "close-postures": ProgramTab._close_postures,
    "charted": ProgramTab._charted,
    "search": lambda tab, _: tab._ways.start(),
    "searching": lambda tab, search: tab._ways.report(search),
    "searched": ProgramTab._searched,
    "way-seconds": lambda tab, text: tab._ways.type("seconds", text),
    "way-seed": lambda tab, text: tab._ways.type("seed", text),
    "close-way": lambda tab, _: tab._ways.close(),
    "failed": ProgramTab._failed,
    "upload": ProgramTab._upload,
}
_OWN = {"charted", "failed", "searching", "searched"}  # posted by the tab itself, never sent by a page
ProgramTab.messages = frozenset({*_ITEM_HANDLERS, *_HANDLERS} - _OWN)
