"""The tab *Robot*: the DH table of the arm on show with a field for every number, and what the arm is.

The first change makes the arm the visitor's own. ``static/robot.js`` sends what is typed, cell by cell. A cell
that gives no valid arm is marked, and the last valid arm stays.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import viser

import kin
from app.exports.snippets import named
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, kept, memory
from app.viewer.declared.panel import Html, Native, Node
from app.viewer.feature import save_file
from app.viewer.meshes.archive import MOST_BYTES, MeshError
from app.viewer.meshes.incoming import IncomingFile, not_sent
from app.viewer.own_arm import OwnArm
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
from kin.typed import LONGEST, cut

UNUSED = "The file was not used"
# What undo calls a message; others have the title of the tab.
STEPS = {
    **dict.fromkeys(("start", "reset", "upload", "urdf", "tip", "mended"), "Another arm"),
    **dict.fromkeys(("frame-add", "frame-remove"), "Workpiece frames"),
    **dict.fromkeys(("other", "agree", "other-text"), "Compare with"),
    "delete": "Own arm deleted",
    "convention": "Convention",
    "apply": "Mistake mended",
}


@dataclass(frozen=True)
class RobotTabSettings(Settings):
    """What the visitor has typed.

    Attributes:
        texts: what the fields show beside the numbers of the arm.
        rows: counts other rows and units: a message about earlier ones is out of date.
        written: counts how often the fields are written anew: what a browser has typed over is sent again.
        converting: whether the arm is shown in the other convention too.
    """

    texts: Texts = kept(Texts(), to_json=Texts.state, from_json=lambda entry, _: Texts.of(entry))
    rows: int = memory(0, renew=False)
    written: int = memory(0, renew=False)
    converting: bool = memory(False, renew=False)


class RobotTab(DeclaredFeature[RobotTabSettings, Facts[RobotTabSettings]]):
    """The visitor's own arm: a table to change it, examples to start from, files to keep it."""

    key = "robot"
    title = "Robot"
    settings_of, facts_of = RobotTabSettings, Facts
    messages = frozenset(
        {
            *("cell", "row", "start", "convention", "convert", "reset", "delete", "discard", "left"),
            *("download", "upload", "urdf", "tip", "cancel", "mended"),
            *("frame-add", "frame-remove"),
            *("other", "agree", "other-text", "apply", "compare-stop"),
        }
    )
    files = MappingProxyType({"upload": MOST_BYTES, "other-text": 4 * MOST})

    # Declared

    def built(self) -> None:
        self._uploads = Uploads(self.stage, self.post, lambda own, words: self._beginnings.begin(own, words))
        self._beginnings = Beginnings(self.stage, lambda: self._uploads.last)

    def started(self) -> None:
        s = self.settings
        self._uploads.waiting = None
        self.change(texts=s.texts.valid(), rows=s.rows + 1)

    @cached_property
    def _comparing(self) -> Comparing:
        """Built where its controls are to be."""
        return self.adopt(Comparing(self.stage, self))

    def _place(self, order: float) -> viser.GuiFolderHandle:
        self._comparing.place.order = order
        return self._comparing.place

    def panel(self) -> Sequence[Node]:
        s, robot, units, stage = self.settings, self.read.robot, self.stage.display.units, self.stage
        tables = [
            Html(views.table, (robot, units, s.rows, s.written, s.texts)),
            Html(views.motion, (robot, units, s.texts)),
            Html(views.conversion, (robot, s.converting, units)),
        ]
        if self.hides("table"):
            tables = [Html(views.withheld), Html(str), Html(str)]
        start = robot, self._beginnings.origin, self._own is not None, stage.services.store.robots, s.texts
        meshes, uploads = "" if self._own is None else stage.bodies.file_of(self._own), self._uploads
        heavy = bool(meshes) or stage.bodies.detailed
        return [
            Html(views.start, start),
            tables[0],
            Html(views.wrong, ("wrong", s.texts)),
            Html(views.about, (robot, units)),
            tables[1],
            Html(views.wrong, ("wrong-motion", s.texts)),
            Html(views.frames, (robot, units, stage.display.frames, s.texts)),
            Html(views.wrong, ("wrong-frames", s.texts)),
            tables[2],
            Native(self._place),
            Html(views.files, (uploads.waiting, uploads.busy, meshes, heavy)),
            Html(str, (uploads.doctor.html(),)),
        ]

    def state(self) -> dict[str, object]:
        return {key: part for key, part in super().state().items() if part}

    def restore(self, state: dict[str, object]) -> None:
        super().restore({"texts": {}, "compare": {}, **state})

    def on_style(self) -> None:
        before, other = self.settings, self.read.units != self.stage.display.units
        texts = before.texts.valid(lambda cell: other or workpieces.workpiece_of(cell[0]) is not None)
        self.change(texts=texts, rows=before.rows + other)
        self._say_lost(_lost(before.texts, texts))
        super().on_style()

    def on_leave(self) -> None:
        super().on_leave()
        self._uploads.forget()
        self.stage.bodies.clear()

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case ("cell", int() | str() as where, str(column)):
                self._type(where, column, value)
            case ("row", str(action), int(index)):
                self._change_rows(action, index)
            case ("meshes", int(number)):
                self._uploads.use_meshes(number, value)
            case ("refused",):
                if words := self._uploads.refuse(value):
                    self._refuse(UNUSED, words)
            case ("reading", int(number)):
                self._uploads.note_progress(number, value)
            case ("arriving", "upload") if isinstance(value, IncomingFile):
                self._uploads.expect(value)
            case ("arriving", "other-text") if isinstance(value, IncomingFile):
                if value.failure:
                    self._refuse(*value.notice)
            case (str(name),) if name in self.messages:
                self._act(name, value)
            case _:
                raise InputError("robot", key, "the key of a field or a button")

    def _act(self, name: str, value: object) -> None:
        match name:
            case "start":
                self._beginnings.start(value)
            case "convention":
                self._reread(value)
            case "convert":
                self._convert(value)
            case "reset":
                if words := self._beginnings.reset():
                    self._refuse("There is nothing to reset to", words)
            case "delete":
                self._beginnings.delete()
            case "discard":
                self._write_fields(self.settings.texts.valid())
            case "left":
                self._write_fields(self.settings.texts)
            case "download":
                self._download(value)
            case "upload":
                self._upload(value)
            case "urdf" | "tip":
                self._open(lambda: self._uploads.choose(name, value))
            case "mended":
                self._use_mended(value)
            case "cancel":
                if words := self._uploads.stop():
                    self.stage.status.show(Notice("hand", "Cancelled", words))
            case "frame-add":
                self.stage.display.use_frames(workpieces.added(self.stage))
            case "frame-remove":
                self.stage.display.use_frames(workpieces.removed(self.stage.display.frames, value))
            case "other":
                self._comparing.choose(value)
            case "agree":
                self._comparing.use_frames(value)
            case "other-text":
                self._take_other(value)
            case "apply":
                self._try(lambda: self._comparing.proposed(value, self._own))
            case "compare-stop":
                self._comparing.stop()
            case _:
                raise InputError("robot", name, "the key of a field or a button")

    def step_name(self, key: Hashable) -> str:
        match key:
            case ("cell", int() | str() as where, str(column)):
                words = edits.name_of((where, column))
                return f"{words[0].upper()}{words[1:]}"
            case ("row", str(action), int(index)):
                return f"Row {index + 1}: {action}"
            case (str(name), *_):
                return STEPS.get(name, self.title)
        return self.title

    @property
    def _own(self) -> OwnArm | None:
        """The visitor's own arm if it is on show."""
        return self._beginnings.own

    # Changes

    def _write_fields(self, texts: Texts) -> None:
        """Write every field anew, with these texts."""
        self.change(texts=texts, written=self.settings.written + 1)

    def _edit(self, own: OwnArm, texts: Texts, *typed: Cell) -> None:
        """Show a changed arm, and these texts in its fields; `typed`: the cells that made it."""
        mine, before, replaced = self._own is not None, self.settings, None
        lost = _lost(before.texts, texts, *typed)
        self.change(texts=texts)
        if not edits.alike(own.robot, self.stage.arm.now.robot, mine or ("arm", "name") in typed):
            replaced = None if mine else self.stage.robots.own
            self.stage.robots.edit(own)  # which calls `on_robot`
            self.change(texts=texts, rows=before.rows if typed else self.settings.rows)
            self.schedule()
        if replaced is not None:
            self._beginnings.say_replaced(replaced, f"{own.robot.name} is now your own arm.", lost)
        else:
            self._say_lost(lost)

    def _say_lost(self, lost: str) -> None:
        if lost:
            self.stage.status.show(Notice("advice", "A field that was not valid is as before", lost))

    def _type(self, where: int | str, column: str, value: object) -> None:
        """A cell was typed into. Cells that were wrong before may be valid together with it."""
        framed = workpieces.workpiece_of(where) is not None
        cell = (where, column) if framed else self._cell(where, column)
        match value:
            case [int(revision), str(text)]:
                text = text[: LONGEST + 1]  # still too long to be valid, and a name is shorter
                if isinstance(where, int) and revision != self.settings.rows:
                    return  # the rows are others by now
            case _:
                raise InputError("cell", value, "a revision and a text")
        if framed:
            self._type_workpiece(cell, text)
            return
        texts, robot, units = self.settings.texts, self.stage.arm.now.robot, self.stage.display.units
        kept = texts.valid(lambda other: column == "kind" and other[0] == where)  # the row has other fields then
        others = {key: wrong for key, (wrong, _) in kept.wrong.items() if workpieces.workpiece_of(key[0]) is None}
        for typed in ({**others, cell: text}, {cell: text}):
            try:
                own = edits.typed(robot, self._own, typed, units)
            except EditError as error:
                texts = texts.refused(cell, text, error.message)
            else:
                self._edit(own, kept.taken(typed), *typed)
                return
        self.change(texts=texts)

    def _cell(self, where: int | str, column: str) -> Cell:
        """A cell of the page; raises `InputError` if there is none."""
        columns = {"arm": ("name", *edits.PLACE)}
        valid = edits.COLUMNS if isinstance(where, int) else columns.get(where, edits.AXES)
        rows = range(len(self.stage.arm.now.robot.rows))
        if where not in (rows if isinstance(where, int) else ("arm", *edits.FRAMES)) or column not in valid:
            raise InputError("cell", (where, column), "a cell of the table")
        return where, column

    def _type_workpiece(self, cell: Cell, text: str) -> None:
        texts = self.settings.texts
        try:
            frames = workpieces.typed(self.stage.display.frames, cell, text, self.stage.display.units)
        except EditError as error:
            self.change(texts=texts.refused(cell, text, error.message))
        else:
            self.change(texts=texts.valid())  # `on_style`, called next, would say they are lost
            self.stage.display.use_frames(frames)
            self.change(texts=texts.taken({cell: text}))
            self.schedule()

    def _change_rows(self, action: str, index: int) -> None:
        robot, own = self.stage.arm.now.robot, self._own
        count = len(robot.rows)
        if not 0 <= index < count:
            raise InputError("row", index, f"0 to {count - 1}")
        change = edits.row_change(action, index, robot.units)
        if action == "add" and count >= MAX_ROWS:
            self._refuse("The table is full", f"An arm has at most {MAX_ROWS} rows.")
        elif action == "remove" and count == 1:
            self._refuse("The row stays", "An arm needs at least one row.")
        elif 0 <= index + {"up": -1, "down": 1}.get(action, 0) < count:
            texts = self.settings.texts.moved(action, index)
            self._try(lambda: edits.changed_rows(robot, own, change), texts)

    def _reread(self, convention: object) -> None:
        if convention not in kin.robot.CONVENTIONS:
            raise InputError("convention", convention, "one of " + ", ".join(kin.robot.CONVENTIONS))
        self._try(lambda: edits.reread(self.stage.arm.now.robot, self._own, str(convention)))

    def _convert(self, action: object) -> None:
        """Show the arm in the other convention, take that table, or close it."""
        if action not in ("show", "use", "close"):
            raise InputError("convert", action, "show, use or close")
        self.change(converting=action == "show")
        if action == "use":
            self._try(lambda: edits.converted(self.stage.arm.now.robot, self._own))

    def _try(self, change: Callable[[], OwnArm], texts: Texts | None = None) -> None:
        """Change the arm; `texts`: what its fields show then, if not those that are valid now."""
        try:
            own = change()
        except EditError as error:
            self._refuse("The arm stays as it is", error.message)
        else:
            self._edit(own, self.settings.texts.valid() if texts is None else texts)

    def _refuse(self, title: str, detail: str) -> None:
        """Say why something is not done, and write the fields anew."""
        self._write_fields(self.settings.texts)
        self.stage.status.show(Notice("error", title, detail))

    def commands(self) -> Iterable[tuple[str, tuple[str | int, ...], object]]:
        return [(f"Save the arm as {about}", ("download",), kind) for kind, (about, *_) in KINDS.items()]

    # Files

    def _download(self, kind: object) -> None:
        if self.hides("table"):
            words = "The file would contain the table that the open exercise asks for."
            self.stage.status.show(Notice("advice", "Not now", words))
            return
        robot = self.stage.arm.now.robot if self._own is None else named(self.stage.arm.now.robot)
        name, text = text_of(robot, kind)
        save_file(self.stage, name, text)

    def _upload(self, value: object) -> None:
        if isinstance(value, IncomingFile):
            self._open(lambda: self._uploads.take(value))
        else:
            self.stage.status.show(Notice("error", *not_sent(value)))

    def _open(self, act: Callable[[], None]) -> None:
        """Take a file, or a choice about it, a step further."""
        try:
            act()
        except RobotFileError as error:
            self._refuse(UNUSED, str(error))

    def _use_mended(self, action: object) -> None:
        """Choose what is mended in the URDF, save or open it, or close the report about it."""
        doctor = self._uploads.doctor
        if action == "close":
            doctor.close()
        elif action == "save":
            save_file(self.stage, doctor.file_name, doctor.mended.text)
        elif action == "open":
            self._open(self._uploads.open_mended)
        else:
            doctor.choose(str(action))

    def _take_other(self, value: object) -> None:
        """A text with the arm to compare with."""
        if not isinstance(value, IncomingFile):
            self.stage.status.show(Notice("error", *not_sent(value)))
            return
        try:
            self._comparing.take(value)
        except (KinematicsError, MeshError) as error:
            self._refuse(UNUSED, str(error))


def _lost(before: Texts, now: Texts, *typed: Cell) -> str:
    """For the status: what was not valid and is neither kept nor among the cells that are valid now."""
    lost = before.wrong.keys() - now.wrong.keys() - set(typed)
    gone = [f"{edits.name_of(cell)} (“{cut(text)}”)" for cell, (text, _) in before.wrong.items() if cell in lost]
    more = f" and {len(gone) - 3} more" if len(gone) > 3 else ""
    return f"Not used: {', '.join(gone[:3])}{more}." if gone else ""
