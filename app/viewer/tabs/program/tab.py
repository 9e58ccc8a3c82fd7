"""The tab *Program*: waypoints recorded from the arm, planned as one motion, played and plotted.

Playing samples the motion at the rate at which moving arms are shown; it ends when the visitor moves the arm.
``static/program.js`` sends what is pressed and typed, and shows the time.
"""

from __future__ import annotations

import json
import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

import kin
import kin.way
from app.exports.motion import FORMATS
from app.exports.program_toml import toml_of
from app.exports.snippets import named
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.work import Sweep, Work, in_background
from app.viewer.feature import save_file, sent_text
from app.viewer.own_arm import KEY
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.program import grip, postures, scene, views, ways
from app.viewer.tabs.program import program as rows
from app.viewer.tabs.program.plan import Asked
from app.viewer.tabs.program.plot import plot_html
from app.viewer.tabs.program.program import LARGEST, MOST, PAUSE, Segments, recorded, replaced, targets
from app.viewer.tabs.program.settings import Planned, ProgramFacts, ProgramSettings
from app.viewer.tabs.program.typed import Fields
from app.viewer.takehome.sending import send_page
from kin import InputError, KinematicsError
from kin.files.numbers import index_of
from kin.motion import Circ, Dwell, Gripper, Program, Ptp, Spline, parse_program
from kin.motion.program import Kind, Pause, Segment, Target
from kin.path import PathPostures
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import general

REPLAN = 0.2  # s without a change of the obstacles until the motion is planned again
REPORT = 0.1  # s between two looks at the progress of a search
LINK = 7000  # bytes of all programs in a link
RATE, MOST_SAMPLES = 100.0, 30_000  # of a saved motion, a second and in all: a longer one has fewer a second
USUAL = ProgramSettings().state()  # a link holds what is different
CHOICES = ("loop", "rate", "path", "ghosts", "frames", "compare", "language")  # settings that the page sends
# What undo calls a change of a row, and of the program; "": the title of the tab.
ROWS = {
    "choose": "", "field": "Waypoint", "go": "Go to", "set": "Set to this pose", "via": "Via point",
    "ptp": "PTP instead", "take": "Joints of arrival", "start": "Start in another posture",
    "begin": "Start in another posture", "postures": "", "way": "", "duplicate": "Duplicate", "up": "Move up",
    "down": "Move down", "delete": "Delete", "point": "", "add-point": "Add a point",
    "shift-point": "Move a point", "delete-point": "Delete a point",
}  # fmt: skip
ACTS = {
    "record": "Record a pose", "pause": "Add a pause", "gripper": "Add the gripper",
    "clear": "Clear the program", "play": "",
    "scrub": "Time of the program", "joint": "", "zone": "", "download": "", "save": "", "page": "",
    "upload": "Open a program", "close-postures": "", "search": "", "way-seconds": "", "way-seed": "",
    "close-way": "", **dict.fromkeys(CHOICES, ""), "loop": "Loop",
}  # fmt: skip


class ProgramTab(DeclaredFeature[ProgramSettings, ProgramFacts]):
    """What a visitor, or a connected program, does with the programs."""

    key = "program"
    title = "Program"
    shared = True
    settings_of, facts_of = ProgramSettings, ProgramFacts
    messages = frozenset({*ROWS, *ACTS})
    undo: ClassVar[dict[str, str]] = {"on_way": "Find a way"}

    # Declared

    @cached_property
    def _planned(self) -> Planned:
        return Planned()

    def sources(self) -> Mapping[str, Any]:
        return {"planned": self._planned}

    def panel(self) -> Sequence[Node]:
        f, s, units = self.read, self.settings, self.stage.display.units
        opened, drawn = (f.chosen, f.point), (s.path, s.ghosts, s.frames)
        grips = self.stage.arm.opening is not None
        form = [self.spec(name).cell(f"way-{name}", getattr(s, name), units) for name in ("seconds", "seed")]
        found = f.work("way") if s.search else None
        return [
            Html(views.player, (f.plan, f.playable, s.rate, s.loop, drawn, units)),
            Html(views.clock, (f.plan, f.time, s.playing)),
            Html(views.list_html, (f.plan, opened, f.fault, s.loop, self._fields, s.by_pose, s.revision, grips)),
            Html(postures.html, (f.chart, f.work("postures").value, units)),
            Html(ways.html, (f.way, found, s.seconds, form, units)),
            Html(plot_html, (f.motion, s.joint, units, f.other)),
            Html(views.summary, (f.plan, s.own, units)),
            Html(views.comparison, (f.whole, f.other, s.compare, s.zone, units)),
            Html(views.files, (f.motion, bool(f.segments), s.own, self.stage.links.service, s.language)),
        ]

    def scene(self) -> Sequence[Lazy]:
        f, s = self.facts, self.settings
        if f.plan is None or not s.path:
            return ()
        return [Lazy("drawing", scene.nodes, (f.plan, f.fault, s.ghosts, s.frames, f.other))]

    def running(self) -> Sequence[Work | Sweep]:
        f, s = self.facts, self.settings
        found: list[Work | Sweep] = []
        if f.segments:
            found.append(Work("obstacles", tuple, (f.arm.obstacles,), rest=REPLAN, keep=True))
        if f.chart is not None:
            found.append(Work("postures", in_background(postures.compute), (f.chart,)))
        if f.way is not None and s.search:
            args = f.way, *s.limits, s.search
            found.append(Work("way", in_background(ways.search), args, poll=REPORT))
        if s.playing:
            found.append(Sweep(self._play_on, self.stage.services.pace.interval, math.inf))
        return found

    def worked(self, key: str) -> None:
        if self.facts.work(key).error is not None:
            self.change(chart=None, search=0)
        if isinstance(self.facts.work(key).value, ways.Found):
            self.post(("do", self.event(self.on_way), 0, 0))  # a step that can be undone
        super().worked(key)

    def tick(self, now: float) -> None:
        self.invalidate()
        if self.settings.way is not None and self.facts.way is None:
            self.change(way=None, search=0)  # for good: undo would begin the search again
        super().tick(now)

    def started(self) -> None:
        own = self.stage.robots.own
        self.change(own=own is not None and own.robot == self.stage.arm.now.robot)

    @property
    def failure(self) -> str:
        return "" if self.facts.fault is None else "the program cannot be driven to its end"

    def extents(self) -> Sequence[Sphere]:
        plan = self.facts.plan
        if plan is None or not self.settings.path:
            return []
        points = kin.fk(plan.motion.robot, plan.waypoints)[:, :3, 3]
        return [round_points(np.vstack([points, plan.path[0][:, :3, 3]]))]

    def state(self) -> dict[str, object]:
        changed = {name: value for name, value in super().state().items() if value != USUAL[name]}
        return {"programs": rows.packed(self.settings.programs or {}), **changed}

    def restore(self, state: dict[str, object]) -> None:
        robots = {robot.id: robot for robot in self.stage.services.store.robots}
        if self.stage.robots.own is not None:
            robots[KEY] = self.stage.robots.own.robot
        given = state.get("programs")
        items = given.items() if isinstance(given, dict) else ()
        read = {key: rows.unpack(value, robots[key]) for key, value in items if key in robots}
        self._stop()
        self.change(programs={key: program for key, program in read.items() if program is not None})
        super().restore(USUAL | state)

    def on_robot(self) -> None:
        self._stop()
        super().on_robot()

    def remove(self) -> None:
        self._stop()
        super().remove()

    # What a connected program does

    def load(self, program: Program, name: str) -> None:
        """Take a program in place of the one on show; raises `InputError`, and nothing has changed then."""
        if not self._open_program(program, f"A program from {name}"):
            expected = "programs of all arms that fit into a link"
            raise InputError("program", rows.counted(program.segments), expected)

    def start(self, on: bool) -> None:
        """Play from the beginning, or stop; raises `InputError` if nothing can be played."""
        self._stop()
        self.schedule()
        self.invalidate()
        f = self.facts
        if on and not f.playable:
            words = "no program" if f.fault is None else f.fault.words
            raise InputError("play", words, "a program of at least two poses that can be driven")
        if on:
            self._play(0.0)

    @property
    def progress(self) -> dict[str, object]:
        """See `ProgramFacts`."""
        self.invalidate()
        return self.facts.progress

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case (str(name), int(index), *_) if name in ROWS:
                if 0 <= index < len(self.facts.segments):  # otherwise the row was deleted since
                    self._act_on_row(name, index, value)
            case (str(name), *_) if name in CHOICES:
                value = float(value) if type(value) is int else value
                self.change(**{name: self.spec(name).unpack(name, value, self.facts.robot)})
                if name == "loop":
                    self._stop()
            case (str(name), *_) if name in ACTS:
                self._act(name, value)
            case _:
                super().heard(key, value)

    def step_name(self, key: Hashable) -> str:
        label = (ROWS | ACTS).get(str(key[0])) if isinstance(key, tuple) else ""
        return label or super().step_name(key)

    def _act(self, name: str, value: object) -> None:
        f, s, here = self.facts, self.settings, self.stage.arm.now.goal
        match name:
            case "record":
                self._insert(len(f.segments), Ptp(recorded(here)), chosen=None)
            case "pause":
                self._add(Dwell(PAUSE))
            case "gripper" if (opening := self.stage.arm.opening) is not None:
                self._add(Gripper(round(opening, 2)))
            case "gripper":
                self._refuse("This arm has no gripper that opens", "Tab Robot: a motor without a joint is one.")
            case "clear":
                self._use(())
            case "play" if s.playing:
                self._stop()
            case "play" if f.playable:
                self._play(0.0 if f.time >= f.duration else f.time)
            case "play":
                words = "Record at least two poses." if f.fault is None else f.fault.words
                self._refuse("The program cannot be played", words)
            case "scrub":
                self._scrub(value)
            case "joint":
                self.change(joint=index_of(value, f.robot.n))
            case "zone" | "way-seconds" | "way-seed":
                self._type_setting(name.removeprefix("way-"), value)
            case "download":
                self._download()
            case "save":
                self._save(value)
            case "page":
                send_page(self.stage, f.motion)
            case "upload":
                self._upload(value)
            case "close-postures":
                self.change(chart=None)
            case "search":
                if f.way is not None and not f.searches and kin.way.is_installed():
                    limits = s.seconds, s.seed
                    self.change(way=self._asked(f.way.index), search=s.search + 1, limits=limits)
            case "close-way":  # a search is cancelled, back to its form
                self.change(way=f.way if f.searches else None, search=0)

    def _act_on_row(self, name: str, index: int, value: object) -> None:
        f, row = self.facts, self.facts.segments[index]
        match name:
            case "choose":
                self._open(None if index == f.chosen else index)
            case "field":
                self._type(index, value)
            case "go":
                self._go_to_row(index)
            case "set" if isinstance(row, Gripper):
                if (opening := self.stage.arm.opening) is not None:
                    self._put(index, replace(row, opening=round(opening, 2)))
            case "set":
                self._open(index)
                self._set_target(index, self.stage.arm.now.goal, min(self.settings.point, len(targets(row)) - 1))
            case "via" if isinstance(row, Circ):
                self._put(index, replace(row, via=rows.point(self.stage.arm.now.T_goal[:3, 3])))
            case "ptp":
                self._set_kind(index, "ptp")
            case "take" if f.plan is not None and (arrival := f.plan.arrives_otherwise(index)) is not None:
                self._set_target(index, arrival.q)
            case "start" | "begin":
                self._arrive(name, index, value)
            case "postures":
                self.change(chart=self._asked(index))
            case "way":
                plan = f.plan
                can = plan is not None and plan.can_have_way(index)
                self.change(way=self._asked(index) if can else None, search=0)
            case "duplicate":
                self._insert(index + 1, row, index + 1)
            case "up" | "down":
                to = index - 1 if name == "up" else index + 1
                if 0 <= to < len(f.segments):
                    self._use(rows.moved(f.segments, index, to), to)
            case "delete":
                found = replaced(f.segments, index)
                self._use(found, min(index, len(found) - 1) if found else None)
            case _ if isinstance(row, Spline) and index == f.chosen:
                self._change_points(name, index, row, value)

    def _asked(self, index: int) -> Asked | None:
        plan = self.facts.plan
        return None if plan is None else Asked(index, plan, self.stage.arm.now)

    def _refuse(self, title: str, detail: str) -> None:
        """Say why a change is not made; fields show what is true again."""
        self.change(revision=self.settings.revision + 1)
        self.stage.status.show(Notice("error", title, detail))

    # The program

    def _use(self, segments: Segments, chosen: int | None = None, program: Program | None = None) -> bool:
        """Take other rows, with this one open; `program`: with the other fields of this program.

        Returns whether there was room for them.
        """
        f = self.facts
        segments, count = rows.begun(segments, f.robot, self.stage.arm.now.goal), rows.places(f.segments)
        programs = {key: value for key, value in (self.settings.programs or {}).items() if key != f.key}
        if segments:
            programs[f.key] = replace(program or f.program or Program(segments), segments=segments)
        size = len(json.dumps(rows.packed(programs), ensure_ascii=False).encode())
        if rows.places(segments) > max(count, MOST):
            self._refuse("The program is full", f"It may have {MOST} waypoints and pauses.")
        elif rows.places(segments) > count and size > LINK:
            self._refuse("The link is full", "Delete waypoints, or save the program as a file and clear it.")
        else:
            self._stop()
            self.change(programs=programs)
            self._open(chosen)
            self.invalidate()
            self._say_fault()
            return True
        return False

    def _open_program(self, program: Program, title: str) -> bool:
        """Take a program from elsewhere, and say so; returns whether there was room for it."""
        self.schedule()
        self.invalidate()
        program = rows.opened(program, self.facts.robot, self.stage.arm.now.goal)
        taken = self._use(program.segments, None, program)
        if taken and self.facts.fault is None:
            self.stage.status.show(Notice("hand", title, rows.counted(program.segments)))
        return taken

    def _open(self, index: int | None) -> None:
        """Open a row, and the last point of a spline that was not open."""
        if index != self.settings.chosen:
            self.change(chosen=index, point=MOST)

    def _say_fault(self) -> None:
        """Say in the status card where the program ends, if it cannot be driven to its end."""
        f = self.facts
        if f.fault is None:
            return
        index, count = f.fault.index, len(f.segments)
        where = "on the way back to the start" if index >= count else f"on the way to {index + 1} of {count}"
        if index == rows.start_of(f.segments):
            where = "at its start"
        self.stage.status.show(Notice("error", f"The program ends {where}", f.fault.words))

    # Changes of the rows

    def _put(self, index: int, *new: Segment) -> None:
        """Put rows in the place of one, which stays open."""
        self._use(replaced(self.facts.segments, index, *new), self.settings.chosen)

    def _insert(self, index: int, row: Segment, chosen: int | None) -> None:
        found = self.facts.segments
        self._use((*found[:index], row, *found[index:]), chosen)

    def _add(self, row: Dwell | Gripper) -> None:
        """Insert a row behind the open one, else at the end, and open it."""
        segments, chosen = self.facts.segments, self.facts.chosen
        at = len(segments) if chosen is None else chosen + 1
        self._insert(at, row, at)

    def _set_target(self, index: int, q: Array, point: int = -1) -> None:
        """Give a row, or a point of a spline, these joint values ``(n,)``."""
        row = self.facts.segments[index]
        if not isinstance(row, Pause):
            self._put(index, rows.with_target(row, point, recorded(q), self.facts.robot))

    def _set_kind(self, index: int, kind: Kind, opens: bool = False) -> None:
        """Make a row one of another kind, or a row for each point of a spline; `opens`: it is open then."""
        f = self.facts
        if f.plan is None or not f.plan.q[index]:
            return
        before = f.plan.before(index)
        start = f.plan.q[index][0] if before is None else f.plan.q[before][-1]
        segments, at = rows.as_kind(f.segments, index, kind, f.plan.q[index], start, f.robot)
        self._use(segments, at if opens or f.chosen == index else f.chosen)

    def _change_points(self, name: str, index: int, row: Spline, value: object) -> None:
        """Choose, add, move or delete a point of the open spline."""
        points, at = list[Target](row.points), self.facts.point
        match name:
            case "point":
                found = index_of(value, len(points))
                self.change(point=at if found is None else found, revision=self.settings.revision + 1)
                return
            case "add-point":
                at += 1
                points.insert(at, rows.as_point(row, recorded(self.stage.arm.now.goal), self.facts.robot))
            case "delete-point" if len(points) > 1:
                points.pop(at)
                at = max(at - 1, 0)
            case "shift-point" if 0 <= (to := at + (1 if value == "1" else -1)) < len(points):
                points.insert(to, points.pop(at))
                at = to
            case _:
                return
        self.change(point=at)
        self._put(index, replace(row, points=tuple(points)))

    def _arrive(self, name: str, index: int, value: object) -> None:
        """Change the waypoint before, so that one is met as recorded, or (*begin*) in a posture of the chart."""
        f = self.facts
        if f.plan is None:
            return
        before, start = f.plan.before(index), f.plan.start_as_recorded(index)
        q = None if start is None else start[1]
        if name == "begin":
            chart = f.work("postures").value
            if not isinstance(chart, PathPostures) or f.chart is None or f.chart.index != index:
                return
            place = index_of(value, len(chart.postures))
            if place is None or chart.reach[0, place] < 0:
                return
            # Of this posture, the whole turns from which it arrives as recorded.
            if q is None or kin.branch_of(chart.robot, q) != chart.postures[place]:
                q = chart.q[0, place]
        if q is not None and before is not None:
            self._set_target(before, q)

    def on_way(self) -> None:
        """Put the waypoints of a way into the program."""
        f = self.facts
        found = f.work("way").value
        if f.way is None or not isinstance(found, ways.Found):
            return
        chosen = f.chosen
        if chosen is not None and chosen >= found.index:
            chosen += found.count
        self.change(way=None, search=0)
        taken = self._use(found.segments, chosen)
        f = self.facts
        touch = None if f.plan is None or f.plan.touch is None else f.plan.touch.segment
        touched = touch if f.fault is None else f.fault.index
        if taken and (touched is None or not found.leads_by(touched)):
            self.stage.status.show(Notice("hand", *found.said()))

    # Fields

    @property
    def _fields(self) -> Fields:
        """How values are written and read."""
        arm, stage = self.stage.arm.now, self.stage
        return Fields(arm.robot, stage.display.units, stage.display.frames.pose(arm.robot, arm.goal), arm.task)

    def _type(self, index: int, value: object) -> None:
        f = self.facts
        match value:
            case ["kind", str(kind)] if kind in views.KINDS:
                self._set_kind(index, next(each for each in views.KINDS if each == kind), opens=True)
            case ["values", ("joints" | "pose") as shown]:
                self.change(by_pose=shown == "pose")
            case [str(field), text]:
                q = () if f.plan is None else f.plan.q[index]
                point = f.point if index == f.chosen else 0
                try:
                    row = self._fields.read(field, text, f.segments[index], q, min(point, len(q) - 1))
                except EntryError as error:
                    self._refuse(error.title, error.detail)
                    return
                self._use(replaced(f.segments, index, row), index)
                self.change(revision=self.settings.revision + 1)
            case _:
                raise InputError("field", value, "the name of a field, and a text")

    def _type_setting(self, name: str, text: object) -> None:
        """The radius of zones to compare with, or a limit of a search."""
        if not isinstance(text, str):
            raise InputError(name, text, "a text")
        try:
            self.change(**{name: self.spec(name).typed(text, self.stage.display.units)})
        except EntryError as error:
            self._refuse(error.title, error.detail)

    # Playing

    def _play(self, time: float) -> None:
        """Go on from a time; the arm first comes to where the motion is."""
        self.change(playing=True, leads=True)
        self._go(time, ease=True)
        self.stage.arm.playing = True

    def _stop(self) -> None:
        """Leave the arm where it is."""
        if self.settings.playing:
            self.change(playing=False)
            self.stage.arm.playing = False

    def _play_on(self, seconds: float) -> None:
        """Show the next frame."""
        f, s, now = self.facts, self.settings, self.stage.arm.now
        if not f.playable or s.sent is None or not np.array_equal(s.sent, now.goal):
            self._stop()  # the visitor has moved the arm, or changed the program
        elif s.leads:
            self.change(leads=not np.array_equal(now.q, now.goal))
        elif (time := f.after(seconds)) is not None:
            self._go(time)
        else:
            assert f.plan is not None
            self._go(f.duration, views.ended(f.plan, s.rate, self.stage.display.units))
            self._stop()

    def _go(self, time: float, notice: Notice | None = None, ease: bool = False) -> None:
        """Move the arm to where the motion is at a time; `notice`: by default which row is driven."""
        f = self.facts
        assert f.motion is not None
        assert f.plan is not None
        q = f.robot.clip(f.motion.derivatives(time)[0])
        self.change(time=time, sent=q, opened=grip.show(self.stage, f.motion, time, self.settings.opened))
        self.stage.arm.move_to(q, notice or views.playing(f.plan, f.plan.row_at(time)), at_once=not ease)

    def _scrub(self, time: object) -> None:
        if not isinstance(time, int | float) or isinstance(time, bool) or not 0.0 <= time < 1e9:
            raise InputError("time", time, "seconds, 0 or more")
        f = self.facts
        if f.motion is not None and not (f.fault is not None and f.fault.whole):
            self._stop()
            time = min(float(time), f.duration)
            self._go(time, Notice("hand", f"The program at {time:.2f} s"))

    def _go_to_row(self, index: int) -> None:
        """Move the arm to where it is at the end of a row, or at the open point of a spline."""
        f = self.facts
        if f.plan is None:
            return
        time, q = f.plan.met(index, f.point if index == f.chosen else MOST)
        if time is not None:
            self._stop()
            self.change(time=time, opened=grip.show(self.stage, f.motion, time, self.settings.opened))
        self.stage.arm.move_to(f.robot.clip(q), Notice("hand", views.title(index, f.segments[index])))

    def commands(self) -> Iterable[tuple[str, tuple[str | int, ...], object]]:
        grips = ["gripper"] * (self.stage.arm.opening is not None)
        yield from ((ACTS[name], (name,), None) for name in ("record", "pause", *grips, "clear"))
        yield "Play or stop the program", ("play",), None
        yield "Save the program", ("download",), None
        yield from ((f"Save the motion as {title}", ("save",), name) for name, title in views.MOTIONS.items())

    # Files

    def _download(self) -> None:
        f = self.facts
        if f.plan is None:
            return
        robot = named(f.robot) if self.settings.own else f.robot
        program = replace(f.plan.motion.program, name=robot.name[:100])
        save_file(self.stage, f"{robot.id}-program.toml", toml_of(program, robot.name))

    def _save(self, name: object) -> None:
        """Download the motion over time, or the part of it that can be driven."""
        f, motion = self.facts, self.facts.motion
        if motion is None:
            return
        motion = replace(motion, robot=named(motion.robot)) if self.settings.own else motion
        rate = min(RATE, MOST_SAMPLES / max(motion.duration, 1e-9))
        try:
            if not isinstance(name, str) or name not in views.MOTIONS:
                raise InputError("format", name, "one of " + ", ".join(views.MOTIONS))
            kind = FORMATS[name]
            data = b"".join(kind.pieces(motion, rate))
        except InputError as error:
            self._refuse("The motion was not saved", f"This format is for {error.expected}.")
            return
        part = "" if f.whole is not None else "Only up to where the program ends. "
        sampled = "" if name == "urscript" else f"{general(rate, 4)} samples per second. "
        words = f"{part}{sampled}Radians, metres and seconds."
        save_file(self.stage, f"{motion.robot.id}-motion{kind.suffix}", data, words)

    def _upload(self, value: object) -> None:
        try:
            name, text = sent_text(value, LARGEST)
            self._open_program(parse_program(text, self.facts.robot), name or "program")
        except KinematicsError as error:
            self._refuse("The file was not used", str(error))
