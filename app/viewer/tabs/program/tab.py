"""The tab *Program*: waypoints recorded from the arm, planned as one motion, played and plotted.

Every change plans the motion anew. Playing samples it at the rate at which moving arms are shown; it ends when the
visitor moves the arm. ``static/program.js`` sends what is pressed and typed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import kin
from app.exports.motion_snippets import SNIPPETS
from app.exports.program_toml import toml_of
from app.exports.snippets import named
from app.viewer.own_arm import KEY
from app.viewer.panel.status import Notice
from app.viewer.tabs.program import program as rows
from app.viewer.tabs.program import views
from app.viewer.tabs.program.compare import CHOICES
from app.viewer.tabs.program.drawing import Shown
from app.viewer.tabs.program.files import motion_file, read
from app.viewer.tabs.program.plan import find_fault
from app.viewer.tabs.program.playback import RATES
from app.viewer.tabs.program.postures import Chart, compute
from app.viewer.tabs.program.program import MOST, PAUSE, Segments, recorded, replaced
from app.viewer.tabs.program.screen import Screen
from app.viewer.tabs.workspace.background import run_in_background
from app.viewer.takehome.sending import send_page
from kin import InputError, KinematicsError
from kin.files.numbers import index_of
from kin.motion import Circ, Dwell, Program, Ptp, Spline
from kin.motion.program import Kind, Segment, Target
from kin.transforms import Array
from kin.typed import EntryError
from kin.warmup import MOTIONS

REPLAN = 0.2  # s without a change of the obstacles until the motion is planned again
LINK = 7000  # bytes of all programs in a link
_LABELS = {
    "record": "Record a pose", "pause": "Add a pause", "set": "Set to this pose", "duplicate": "Duplicate",
    "up": "Move up", "down": "Move down", "delete": "Delete", "go": "Go to", "scrub": "Time of the program",
    "clear": "Clear the program", "upload": "Open a program", "loop": "Loop", "field": "Waypoint",
    "via": "Via point", "ptp": "PTP instead", "take": "Joints of arrival", "add-point": "Add a point",
    "shift-point": "Move a point", "delete-point": "Delete a point", "start": "Start in another posture",
    "begin": "Start in another posture", "searched": "Find a way",
}  # fmt: skip


class ProgramTab(Screen):
    """What a visitor, or a connected program, does with the programs."""

    key = "program"
    title = "Program"
    shared = True
    kernels = (MOTIONS,)

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case (str(name), int(index), *_) if name in _ROW_HANDLERS and 0 <= index < len(self._segments):
                _ROW_HANDLERS[name](self, index, value)
            case (str(name), int(), *_) if name in _ROW_HANDLERS:
                pass  # the row was deleted since
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
        program = rows.opened(program, arm.robot, arm.goal)
        self._use(program.segments, None, program)
        if self._segments != program.segments:
            expected = "programs of all arms that fit into a link"
            raise InputError("program", rows.counted(program.segments), expected)
        if self._fault is None:
            self.stage.notify(Notice("hand", f"A program from {name}", rows.counted(program.segments)))

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
        found: dict[str, object] = {
            "items": rows.places(self._segments),
            "playing": self._player.playing,
            "time": self._player.time,
            "duration": self._playback.duration,
            "complete": self._fault is None and self._whole is not None,
        }
        if found != self._progress:
            self._progress = found
        return self._progress

    # Reports of the session

    @property
    def failure(self) -> str:
        return "" if self._fault is None else "the program cannot be driven to its end"

    def on_robot(self) -> None:
        self._chosen, self._joint, self._player.time = None, None, 0.0
        self._playback.stop()
        self._refresh()

    def on_request(self) -> None:
        if find_fault(self._plan, self.stage) != self._fault:
            self._refresh()

    def on_style(self) -> None:
        self._refresh()

    def on_obstacles(self) -> None:
        if self._segments:
            self._stale, self.due = time.perf_counter() + REPLAN, REPLAN

    def tick(self, now: float) -> None:
        if self._stale is not None and now >= self._stale:
            self._refresh()
        self.due = self._playback.tick(now)
        if self._stale is not None:
            self.due = min(self.due or REPLAN, REPLAN)

    def state(self) -> dict[str, object]:
        usual = {"loop": False, "rate": 1.0, "path": True, "ghosts": False, "frames": False, "compare": None}
        now = {
            "loop": self._player.loop, "rate": self._player.rate, "path": self._shown.path,
            "ghosts": self._shown.ghosts, "frames": self._shown.frames, "compare": self._compared,
        }  # fmt: skip
        programs = {key: rows.pack(program) for key, program in self._programs.items()}
        return {"programs": programs} | {key: value for key, value in now.items() if value != usual[key]}

    def restore(self, state: dict[str, object]) -> None:
        programs = state.get("programs")
        robots = {robot.id: robot for robot in self.stage.store.robots}
        if self.stage.own is not None:
            robots[KEY] = self.stage.own.robot
        given = programs.items() if isinstance(programs, dict) else ()
        read = {key: rows.unpack(value, robots[key]) for key, value in given if key in robots}
        self._programs = {key: program for key, program in read.items() if program is not None}
        rate, compared = state.get("rate", 1.0), state.get("compare")
        self._player.loop = state.get("loop") is True
        self._player.rate = next((each for each in RATES if each == rate), 1.0)
        self._compared = next((each for each in CHOICES if each == compared), None)
        ghosts, frames = (state.get(each) is True for each in ("ghosts", "frames"))
        self._shown = Shown(state.get("path") is not False, ghosts, frames)
        self._playback.stop()
        self._refresh()

    def on_leave(self) -> None:
        self._ways.cancel()
        if self._chart is not None:
            self._chart.cancelled.set()

    def remove(self) -> None:
        self.on_leave()
        self._playback.stop()
        self._erase()

    # The program

    def _use(self, segments: Segments, chosen: int | None, program: Program | None = None) -> None:
        """Take other rows, with this one open; `program`: with the other fields of this program."""
        arm = self.stage.now
        segments, count = rows.begun(segments, arm.robot, arm.goal), rows.places(self._segments)
        programs = {key: value for key, value in self._programs.items() if key != self._key}
        if segments:
            programs[self._key] = replace(program or self._program or Program(segments), segments=segments)
        packed = json.dumps({key: rows.pack(value) for key, value in programs.items()}, ensure_ascii=False)
        if rows.places(segments) > max(count, MOST):
            self._refuse("The program is full", f"It may have {MOST} waypoints and pauses.")
        elif rows.places(segments) > count and len(packed.encode()) > LINK:
            self._refuse("The link is full", "Delete waypoints, or save the program as a file and clear it.")
        else:
            self._programs = programs
            self._open(chosen)
            self._playback.stop()
            self._refresh()
            self._say_fault()

    def _open(self, index: int | None) -> None:
        """Open a row, and the last point of a spline that was not open."""
        if index != self._chosen:
            self._point = MOST
        self._chosen = index if index is not None and index < len(self._segments) else None

    def _say_fault(self) -> None:
        """Say in the status card where the program ends, if it cannot be driven to its end."""
        if self._fault is None:
            return
        index, count = self._fault.index, len(self._segments)
        where = "on the way back to the start" if index >= count else f"on the way to {index + 1} of {count}"
        if index == rows.start_of(self._segments):
            where = "at its start"
        self.stage.notify(Notice("error", f"The program ends {where}", self._fault.words))

    # Changes of the rows

    def _put(self, index: int, *new: Segment) -> None:
        """Put rows in the place of one, which stays open."""
        self._use(replaced(self._segments, index, *new), self._chosen)

    def _insert(self, index: int, row: Segment, choose: bool = True) -> None:
        found = self._segments
        self._use((*found[:index], row, *found[index:]), index if choose else None)

    def _record(self, _: object) -> None:
        self._insert(len(self._segments), Ptp(recorded(self.stage.now.goal)), choose=False)

    def _pause(self, _: object) -> None:
        """Add a pause behind the open row, else at the end."""
        self._insert(len(self._segments) if self._chosen is None else self._chosen + 1, Dwell(PAUSE))

    def _choose(self, index: int, _: object) -> None:
        self._open(None if index == self._chosen else index)
        self._show_list()

    def _set_target(self, index: int, q: Array, point: int = -1) -> None:
        """Give a row, or a point of a spline, these joint values ``(n,)``."""
        row = self._segments[index]
        if not isinstance(row, Dwell):
            self._put(index, rows.with_target(row, point, recorded(q), self.stage.now.robot))

    def _set_pose(self, index: int, _: object) -> None:
        self._open(index)
        self._set_target(
            index, self.stage.now.goal, min(self._point, len(rows.targets(self._segments[index])) - 1)
        )

    def _set_via(self, index: int, _: object) -> None:
        if isinstance(row := self._segments[index], Circ):
            self._put(index, replace(row, via=rows.point(self.stage.now.T_goal[:3, 3])))

    def _move(self, index: int, to: int) -> None:
        if 0 <= to < len(self._segments):
            self._use(rows.moved(self._segments, index, to), to)

    def _delete(self, index: int, _: object) -> None:
        found = replaced(self._segments, index)
        self._use(found, min(index, len(found) - 1) if found else None)

    def _set_kind(self, index: int, kind: Kind, opens: bool = False) -> None:
        """Make a row one of another kind, or a row for each point of a spline; `opens`: it is open then."""
        found = self._plan
        if found is None or not found.q[index] or kind == "dwell":
            return
        before = found.before(index)
        start = found.q[index][0] if before is None else found.q[before][-1]
        segments, at = rows.as_kind(self._segments, index, kind, found.q[index], start, self.stage.now.robot)
        self._use(segments, at if opens or self._chosen == index else self._chosen)

    # Points of a spline

    def _use_points(self, index: int, change: Callable[[Spline], tuple[Sequence[Target], int]]) -> None:
        """Change the points of the open spline; `change` returns them, and which one is open then."""
        if isinstance(row := self._segments[index], Spline) and index == self._chosen:
            points, point = change(row)
            if points:
                self._point = point
                self._put(index, replace(row, points=tuple(points)))

    def _choose_point(self, index: int, text: object) -> None:
        found = index_of(text, len(rows.targets(self._segments[index])))
        if found is not None and index == self._chosen:
            self._point = found
            self._show_list(anew=True)

    def _add_point(self, index: int, _: object) -> None:
        def change(row: Spline) -> tuple[Sequence[Target], int]:
            here, at = rows.as_point(row, recorded(self.stage.now.goal), self.stage.now.robot), self._point + 1
            return [*row.points[:at], here, *row.points[at:]], at

        self._use_points(index, change)

    def _delete_point(self, index: int, _: object) -> None:
        at = self._point
        self._use_points(index, lambda row: ([*row.points[:at], *row.points[at + 1 :]], max(at - 1, 0)))

    def _shift_point(self, index: int, step: object) -> None:
        def change(row: Spline) -> tuple[Sequence[Target], int]:
            points, to = list(row.points), self._point + (1 if step == "1" else -1)
            if not 0 <= to < len(points):
                return (), 0
            points.insert(to, points.pop(self._point))
            return points, to

        self._use_points(index, change)

    # Arrivals in other joint values than recorded

    def _take(self, index: int, _: object) -> None:
        """Record the joint values in which the arm arrives at a waypoint."""
        arrival = None if self._plan is None else self._plan.arrives_otherwise(index)
        if arrival is not None:
            self._set_target(index, arrival.q)

    def _start(self, index: int, _: object) -> None:
        """Change the posture at the waypoint before, so that the arm arrives as recorded."""
        found = None if self._plan is None else self._plan.start_as_recorded(index)
        if found is not None:
            self._set_target(*found)

    # Postures along the way

    def _show_postures(self, index: int, _: object) -> None:
        """Compute the chart of the way to a waypoint, in the background."""
        self._close_postures()
        if self._plan is None:
            return
        self._chart = chart = Chart(index, self._plan, self.stage.now)
        self._keep_postures()

        def work() -> None:
            compute(chart)
            self.post(("charted",), chart)

        run_in_background(work, "postures", lambda key, value: self.post((key,), value))

    def _charted(self, chart: object) -> None:
        if chart is self._chart:
            self._keep_postures()

    def _failed(self, error: object) -> None:
        self._close_postures()
        self._ways.close()
        if isinstance(error, BaseException):
            raise error

    def _begin(self, index: int, row: object) -> None:
        """Start in a posture of the chart: the waypoint before takes its joint values."""
        chart = self._chart
        found = None if chart is None or chart.index != index else chart.found
        if self._plan is None or found is None or (place := index_of(row, len(found.postures))) is None:
            return
        before = self._plan.before(index)
        if found.reach[0, place] < 0 or before is None:
            return
        q, as_recorded = found.q[0, place], self._plan.start_as_recorded(index)
        if as_recorded is not None and kin.branch_of(found.robot, as_recorded[1]) == found.postures[place]:
            q = as_recorded[1]  # of this posture, the whole turns from which it arrives as recorded
        self._set_target(before, q)

    # A way around obstacles

    def _searched(self, search: object) -> None:
        """Put the waypoints of a way into the program."""
        found = self._ways.ended(search)
        if found is None or found.found is None:
            return
        chosen = self._chosen
        self._use(found.found, chosen if chosen is None or chosen < found.index else chosen + found.count)
        touch = None if self._plan is None or self._plan.touch is None else self._plan.touch.segment
        touched = touch if self._fault is None else self._fault.index
        if self._segments == found.found and (touched is None or not found.leads_by(touched)):
            self.stage.notify(Notice("hand", *found.said()))

    # Fields

    def _type(self, index: int, value: object) -> None:
        match value:
            case ["kind", str(kind)] if kind in views.KINDS:
                self._set_kind(index, next(each for each in views.KINDS if each == kind), opens=True)
            case ["values", ("joints" | "pose") as shown]:
                self._by_pose = shown == "pose"
                self._show_list()
            case [str(field), text]:
                q = () if self._plan is None else self._plan.q[index]
                point = self._point if index == self._chosen else 0
                try:
                    row = self._fields.read(field, text, self._segments[index], q, min(point, len(q) - 1))
                except EntryError as error:
                    self._refuse(error.title, error.detail)
                    return
                self._use(replaced(self._segments, index, row), index)
                self._show_list(anew=True)
            case _:
                raise InputError("field", value, "the name of a field, and a text")

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

    def _go_to_row(self, index: int, _: object) -> None:
        """Move the arm to where it is at the end of a row, or at the open point of a spline."""
        if self._plan is None:
            return
        row = self._segments[index]
        time, q = self._plan.met(index, self._point if index == self._chosen else MOST)
        if time is not None:
            self._playback.note(time)
        title = row.name or ("Pause" if isinstance(row, Dwell) else f"Waypoint {index + 1}")
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
        self._shown = replace(self._shown, **{name: bool(on)})
        self._draw()
        self._show_player()

    def _set_joint(self, text: object) -> None:
        self._joint = index_of(text, self.stage.now.robot.n)
        self._show_plot()

    def _compare(self, value: object) -> None:
        self._compared = next((each for each in CHOICES if each == value), None)
        self._refresh()

    def _set_zone(self, text: object) -> None:
        if not isinstance(text, str):
            raise InputError("zone", text, "a text")
        try:
            self._zone = self._fields.blend(text)
        except EntryError as error:
            self.stage.notify(Notice("error", error.title, error.detail))
        self._refresh()

    def _set_language(self, name: object) -> None:
        if name not in SNIPPETS:
            raise InputError("language", name, "one of " + ", ".join(SNIPPETS))
        self._language = str(name)
        self._show_files()

    # Files

    def _send(self, name: str, data: bytes, words: str) -> None:
        self.stage.client.send_file_download(name, data, save_immediately=True)
        self.stage.notify(Notice("hand", f"{name} is saved", words))

    def _download(self, _: object) -> None:
        if self._plan is None:
            return
        robot = named(self.stage.now.robot) if self._own else self.stage.now.robot
        program = replace(self._plan.motion.program, name=robot.name[:100])
        data = toml_of(program, robot.name).encode()
        self._send(f"{robot.id}-program.toml", data, "Your browser has put it where it puts downloads.")

    def _save(self, name: object) -> None:
        """Download the motion over time, or the part of it that can be driven."""
        if self._motion is None:
            return
        motion = replace(self._motion, robot=named(self._motion.robot)) if self._own else self._motion
        try:
            file, data, sampled = motion_file(motion, name)
        except InputError as error:
            self._refuse("The motion was not saved", f"This format is for {error.expected}.")
            return
        part = "" if self._whole is not None else "Only up to where the program ends. "
        self._send(file, data, f"{part}{sampled}Radians, metres and seconds.")

    def _upload(self, value: object) -> None:
        arm = self.stage.now
        try:
            name, program = read(value, arm.robot)
            program = rows.opened(program, arm.robot, arm.goal)
        except KinematicsError as error:
            self._refuse("The file was not used", str(error))
            return
        self._use(program.segments, None, program)
        if self._fault is None and self._segments == program.segments:
            self.stage.notify(Notice("hand", name, rows.counted(program.segments)))


_ROW_HANDLERS: dict[str, Callable[[ProgramTab, int, object], None]] = {
    "choose": ProgramTab._choose,
    "point": ProgramTab._choose_point,
    "add-point": ProgramTab._add_point,
    "shift-point": ProgramTab._shift_point,
    "delete-point": ProgramTab._delete_point,
    "field": ProgramTab._type,
    "go": ProgramTab._go_to_row,
    "set": ProgramTab._set_pose,
    "via": ProgramTab._set_via,
    "ptp": lambda tab, index, _: tab._set_kind(index, "ptp"),
    "take": ProgramTab._take,
    "postures": ProgramTab._show_postures,
    "way": lambda tab, index, _: tab._ways.open(tab._plan, index),
    "begin": ProgramTab._begin,
    "start": ProgramTab._start,
    "duplicate": lambda tab, index, _: tab._insert(index + 1, tab._segments[index]),
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
    "close-postures": lambda tab, _: tab._close_postures(),
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
ProgramTab.messages = frozenset({*_ROW_HANDLERS, *_HANDLERS} - _OWN)
