"""The tab *Robot*: the DH table of the arm on show with a field for every number, and what the arm is.

The first change makes the arm the visitor's own. ``static/robot.js`` sends what is typed, cell by cell. A cell
that gives no valid arm is marked, and the last valid arm stays. The part of the tab in which the visitor types is
not sent again; the rest is.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from types import MappingProxyType

import kin
from app.exports.snippets import named
from app.shared.answers.inspection import inspect
from app.viewer.feature import Feature, Stage, save_file
from app.viewer.frames import Frames
from app.viewer.meshes.archive import MOST_BYTES, MeshError
from app.viewer.meshes.incoming import IncomingFile, not_sent
from app.viewer.own_arm import OwnArm
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
from app.viewer.panel.status import Notice
from app.viewer.tabs.robot import edits, views, workpieces
from app.viewer.tabs.robot.beginnings import Beginnings
from app.viewer.tabs.robot.compare.comparing import Comparing
from app.viewer.tabs.robot.edits import Cell, EditError
from app.viewer.tabs.robot.files import KINDS, MOST, text_of
from app.viewer.tabs.robot.texts import Texts
from app.viewer.tabs.robot.uploads import Uploads
from kin import InputError, KinematicsError, RobotFileError
from kin.files.read import MAX_ROWS
from kin.robot import Convention
from kin.transforms import Array
from kin.typed import LONGEST, cut

PARTS = ("start", "table", "wrong", "about", "motion", "wrong-motion", "frames", "wrong-frames", "convert")
OTHER: dict[Convention, Convention] = {"standard": "modified", "modified": "standard"}
UNUSED = "The file was not used"


class RobotTab(Feature):
    """The visitor's own arm: a table to change it, examples to start from, files to keep it."""

    key = "robot"
    title = "Robot"
    messages = frozenset(
        {
            *("cell", "row", "start", "convention", "convert", "reset", "delete", "discard", "left"),
            *("download", "upload", "urdf", "tip", "cancel", "mended"),
            *("frame-add", "frame-remove"),
            *("other", "agree", "other-text", "apply", "compare-stop"),
        }
    )
    files = MappingProxyType({"upload": MOST_BYTES, "other-text": 4 * MOST})

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._wrong: dict[Cell, tuple[str, str]] = {}  # what was typed, and what is wrong with it
        self._texts = Texts()
        self._revision = 0  # of the rows and units: a message about others is out of date
        self._written = 0  # how often the table was sent: what a browser has typed over is sent again
        self._editing = ""  # the part of the tab in which the visitor types; "kind": rows and units stay
        self._uploads = Uploads(stage, self.post, lambda own, words: self._beginnings.begin(own, words))
        self._beginnings = Beginnings(stage, lambda: self._uploads.last)
        self._converting = False
        gui = stage.client.gui
        self._html = {name: add_html(gui) for name in PARTS}
        self._comparing = Comparing(stage, self)
        self._html |= {name: add_html(gui) for name in ("files", "doctor")}
        self._handlers: dict[str, Callable[[object], None]] = {
            "start": self._beginnings.start,
            "convention": self._reread,
            "reset": lambda _: self._reset(),
            "delete": lambda _: self._beginnings.delete(),
            "discard": lambda _: self._refresh(),
            "left": lambda _: self._leave_table(),
            "convert": self._convert,
            "download": self._download,
            "upload": self._upload,
            "urdf": lambda value: self._open(lambda: self._uploads.choose("urdf", value)),
            "tip": lambda value: self._open(lambda: self._uploads.choose("tip", value)),
            "cancel": lambda _: self._cancel(),
            "mended": self._use_mended,
            "frame-add": lambda _: self._use_frames(workpieces.added(self.stage)),
            "frame-remove": lambda index: self._use_frames(workpieces.removed(self.stage.frames, index)),
            "other": self._comparing.choose,
            "agree": self._comparing.use_frames,
            "other-text": self._take_other,
            "apply": lambda index: self._try(lambda: self._comparing.proposed(index, self._own)),
            "compare-stop": lambda _: self._comparing.stop(),
        }
        self._refresh()

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("cell", int() | str() as where, str(column)):
                self._type(where, column, value)
            case ("row", str(action), int(index)):
                self._change_rows(action, index)
            case ("meshes", int(number)):
                self._uploads.use_meshes(number, value)
                self._show_files()
            case ("refused",):
                if words := self._uploads.refuse(value):
                    self._refuse(UNUSED, words)
            case ("reading", int(number)):
                self._uploads.note_progress(number, value)
                self._show_files()
            case ("arriving", "upload") if isinstance(value, IncomingFile):
                self._uploads.expect(value)
                self._show_files()
            case ("arriving", "other-text") if isinstance(value, IncomingFile):
                if value.failure:
                    self._refuse(*value.notice)
            case ("compare", inner) | (("done", ()) as inner):
                self._comparing.handle(inner, value)
                self._plan()
            case (str(name),) if name in self._handlers:
                self._handlers[name](value)
                self._plan()
            case _:
                raise InputError("robot", key, "the key of a field or a button")

    def tick(self, now: float) -> None:
        self._comparing.tick(now)
        self._plan()

    def _plan(self) -> None:
        """When to look at what is under way."""
        self.due = self._comparing.due

    def step_name(self, key: Hashable) -> str:
        match key:
            case ("cell", int() | str() as where, str(column)):
                words = edits.name_of((where, column))
                return f"{words[0].upper()}{words[1:]}"
            case ("row", str(action), int(index)):
                return f"Row {index + 1}: {action}"
            case ("start" | "reset" | "upload" | "urdf" | "tip" | "mended", *_):
                return "Another arm"
            case ("delete",):
                return "Own arm deleted"
            case ("convention",):
                return "Convention"
            case ("frame-add" | "frame-remove",):
                return "Workpiece frames"
            case ("apply",):
                return "Mistake mended"
            case ("other" | "agree" | "other-text",):
                return "Compare with"
        return self.title

    def state(self) -> dict[str, object]:
        parts = {"texts": self._texts.state(), "compare": self._comparing.state()}
        return {key: part for key, part in parts.items() if part}

    def restore(self, state: Mapping[str, object]) -> None:
        self._texts.restore(state.get("texts"))
        if state.get("compare", {}) != self._comparing.state():
            self._comparing.restore(state.get("compare"))
            self._plan()
        self._refresh()

    def on_robot(self) -> None:
        self._uploads.waiting = None
        self._revision += self._editing == ""
        self._refresh()
        self._comparing.on_robot()
        self._plan()

    def on_pose(self, T_base_tool: Array) -> None:
        self._comparing.on_pose(T_base_tool)
        self._plan()

    def on_style(self) -> None:
        self._revision += 1
        self._refresh()
        self._comparing.on_style()
        self._plan()

    def on_activity(self) -> None:
        if self.stage.activity.withheld != self._withheld:
            self._refresh()
            self._comparing.start()
            self._plan()

    # Drawing

    def _refresh(self) -> None:
        """Show the arm as it is, but not in the part in which the visitor types."""
        robot, units = self.stage.now.robot, self.stage.units
        self._withheld = self.stage.activity.withheld
        self._wrong = {cell: why for cell, why in self._wrong.items() if edits.part_of(cell) == self._editing}
        if self._editing != "table":
            self._written += 1
            self._show("table", self._table())
        if self._editing != "motion":
            withheld = "table" in self._withheld
            self._show("motion", "" if withheld else views.motion(robot, units, self._texts))
        if self._editing != "frames":
            self._show("frames", views.frames(robot, units, self.stage.frames, self._texts))
        if self._editing != "start":
            self._show(
                "start",
                views.start(robot, self._beginnings.origin, self._own is not None, self.stage.store.robots),
            )
        self._show("about", views.about(inspect(robot), robot, units))
        self._show_conversion()
        self._show_files()
        self._show_wrong()

    def _table(self) -> str:
        if "table" in self.stage.activity.withheld:
            return views.withheld()
        robot, units = self.stage.now.robot, self.stage.units
        return views.table(robot, units, self._revision, self._written, self._texts)

    def _show(self, name: str, html: str) -> None:
        update_html(self._html[name], html)

    def _show_wrong(self) -> None:
        messages = {cell: message for cell, (_, message) in self._wrong.items()}
        self._show("wrong", views.wrong(messages))
        for part in ("motion", "frames"):
            self._show(f"wrong-{part}", views.wrong_in(part, messages))

    def _show_conversion(self) -> None:
        robot = self.stage.now.robot
        if "table" in self.stage.activity.withheld:
            self._show("convert", "")
            return
        other = kin.dh.convert_dh(robot, OTHER[robot.convention]) if self._converting else None
        self._show("convert", views.conversion(robot, other, self.stage.units))

    def _show_files(self) -> None:
        own = self._own
        file = "" if own is None else self.stage.bodies.file_of(own)
        heavy, uploads = bool(file) or self.stage.bodies.detailed, self._uploads
        self._show("files", views.files(uploads.waiting, uploads.busy, file, heavy))
        self._show("doctor", uploads.doctor.html())

    def _leave_table(self) -> None:
        """The visitor has left the fields: write every value as it is read, unless something is wrong."""
        if not self._wrong:
            self._refresh()

    @property
    def _own(self) -> OwnArm | None:
        """The visitor's own arm if it is on show."""
        return self._beginnings.own

    # Changes

    def _edit(self, own: OwnArm, editing: str = "") -> None:
        mine = self._own is not None
        if edits.alike(own.robot, self.stage.now.robot, mine) and (mine or editing != "start"):
            return
        replaced = None if mine else self.stage.own
        before = self._wrong
        self._editing = editing
        try:
            self.stage.edit_arm(own)
        finally:
            self._editing = ""
        lost = self._lost(before)
        if replaced is not None:
            self._beginnings.say_replaced(replaced, f"{own.robot.name} is now your own arm.", lost)
        elif lost:
            self.stage.notify(Notice("advice", "A field that was not valid is as before", lost))

    def _lost(self, before: Mapping[Cell, tuple[str, str]]) -> str:
        """For the status: cells that were wrong `before` and are now as they were written first."""
        gone = [
            f"{edits.name_of(cell)} (“{cut(text)}”)"
            for cell, (text, _) in before.items()
            if cell not in self._wrong
        ]
        more = f" and {len(gone) - 3} more" if len(gone) > 3 else ""
        return f"Not used: {', '.join(gone[:3])}{more}." if gone else ""

    def _type(self, where: int | str, column: str, value: object) -> None:
        """A cell was typed into. Cells that were wrong before may be valid together with it."""
        framed = workpieces.workpiece_of(where) is not None
        cell = (where, column) if framed else self._cell(where, column)
        match value:
            case [int(revision), str(text)]:
                text = text[: LONGEST + 1]  # still too long to be valid, and a name is shorter
                if isinstance(where, int) and revision != self._revision:
                    return  # the rows are others by now
            case _:
                raise InputError("cell", value, "a revision and a text")
        editing = edits.part_of(cell)
        robot, units = self.stage.now.robot, self.stage.units
        if framed:
            self._type_workpiece(cell, text)
            return
        others = {key: typed for key, (typed, _) in self._wrong.items() if workpieces.workpiece_of(key[0]) is None}
        before = {key: typed for key, typed in others.items() if key != cell}
        self._wrong.pop(cell, None)
        if column == "kind":
            editing, before = "kind", {}
        if column == "mounting":
            editing = column  # the fields of the base and of the floor are written again
        for texts in ({**before, cell: text}, {cell: text}):
            try:
                own = edits.typed(robot, self._own, texts, units)
            except EditError as error:
                self._wrong[cell] = text, error.message
            else:
                for key, valid in texts.items():
                    self._wrong.pop(key, None)
                    self._texts.remember(key, valid)
                self._edit(own, editing)
                break
        self._show_wrong()

    def _cell(self, where: int | str, column: str) -> Cell:
        """A cell of the page; raises `InputError` if there is none."""
        columns = {"arm": ("name", *edits.PLACE)}
        valid = edits.COLUMNS if isinstance(where, int) else columns.get(where, edits.AXES)
        rows = range(len(self.stage.now.robot.rows))
        if where not in (rows if isinstance(where, int) else ("arm", *edits.FRAMES)) or column not in valid:
            raise InputError("cell", (where, column), "a cell of the table")
        return where, column

    def _type_workpiece(self, cell: Cell, text: str) -> None:
        self._wrong.pop(cell, None)
        try:
            frames = workpieces.typed(self.stage.frames, cell, text, self.stage.units)
        except EditError as error:
            self._wrong[cell] = text, error.message
            self._show_wrong()
        else:
            self._texts.remember(cell, text)
            self._use_frames(frames, "frames")

    def _use_frames(self, frames: Frames, editing: str = "") -> None:
        self._editing = editing
        try:
            self.stage.use_frames(frames)
        finally:
            self._editing = ""

    def _change_rows(self, action: str, index: int) -> None:
        robot, own = self.stage.now.robot, self._own
        count = len(robot.rows)
        if not 0 <= index < count:
            raise InputError("row", index, f"0 to {count - 1}")
        change = edits.row_change(action, index, robot.units)
        if action == "add" and count >= MAX_ROWS:
            self._refuse("The table is full", f"An arm has at most {MAX_ROWS} rows.")
        elif action == "remove" and count == 1:
            self._refuse("The row stays", "An arm needs at least one row.")
        elif 0 <= index + {"up": -1, "down": 1}.get(action, 0) < count:
            self._try(lambda: edits.changed_rows(robot, own, change), (action, index))

    def _reread(self, convention: object) -> None:
        if convention not in kin.robot.CONVENTIONS:
            raise InputError("convention", convention, "one of " + ", ".join(kin.robot.CONVENTIONS))
        self._try(lambda: edits.reread(self.stage.now.robot, self._own, str(convention)))

    def _convert(self, action: object) -> None:
        """Show the arm in the other convention, take that table, or close it."""
        if action not in ("show", "use", "close"):
            raise InputError("convert", action, "show, use or close")
        self._converting = action == "show"
        if action == "use":
            self._try(lambda: edits.converted(self.stage.now.robot, self._own))
        self._show_conversion()

    def _try(self, change: Callable[[], OwnArm], rows: tuple[str, int] | None = None) -> None:
        """Change the arm; `rows`: how its rows are changed."""
        try:
            own = change()
        except EditError as error:
            self._refuse("The arm stays as it is", error.message)
        else:
            if rows is not None:
                self._texts.move_rows(*rows)
            self._edit(own)

    def _refuse(self, title: str, detail: str) -> None:
        before = self._wrong
        self._refresh()
        self.stage.notify(Notice("error", title, f"{detail} {self._lost(before)}".strip()))

    def _reset(self) -> None:
        if words := self._beginnings.reset():
            self._refuse("There is nothing to reset to", words)

    def commands(self) -> Iterable[tuple[str, tuple[str | int, ...], object]]:
        return [(f"Save the arm as {about}", ("download",), kind) for kind, (about, *_) in KINDS.items()]

    # Files

    def _download(self, kind: object) -> None:
        if "table" in self.stage.activity.withheld:
            words = "The file would contain the table that the open exercise asks for."
            self.stage.notify(Notice("advice", "Not now", words))
            return
        robot = self.stage.now.robot if self._own is None else named(self.stage.now.robot)
        name, text = text_of(robot, kind)
        save_file(self.stage, name, text)

    def _upload(self, value: object) -> None:
        if isinstance(value, IncomingFile):
            self._open(lambda: self._uploads.take(value))
        else:
            self.stage.notify(Notice("error", *not_sent(value)))

    def _open(self, act: Callable[[], None]) -> None:
        """Take a file, or a choice about it, a step further."""
        try:
            act()
        except RobotFileError as error:
            self._refuse(UNUSED, str(error))
        self._show_files()

    def _use_mended(self, action: object) -> None:
        """Choose what is mended in the URDF, save or open it, or close the report about it."""
        doctor = self._uploads.doctor
        if action == "close":
            doctor.close()
            self._show_files()
        elif action == "save":
            save_file(self.stage, doctor.file_name, doctor.mended.text)
        elif action == "open":
            self._open(self._uploads.open_mended)
        else:
            doctor.choose(str(action))
            self._show_files()

    def _take_other(self, value: object) -> None:
        """A text with the arm to compare with."""
        if not isinstance(value, IncomingFile):
            self.stage.notify(Notice("error", *not_sent(value)))
            return
        try:
            self._comparing.take(value)
        except (KinematicsError, MeshError) as error:
            self._refuse(UNUSED, str(error))

    def _cancel(self) -> None:
        """End what goes on with a file."""
        if words := self._uploads.stop():
            self.stage.notify(Notice("hand", "Cancelled", words))
        self._show_files()

    def on_leave(self) -> None:
        self._uploads.forget()
        self._comparing.on_leave()
        self.stage.bodies.clear()
