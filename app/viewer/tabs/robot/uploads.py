"""Files that a visitor opens: what is asked about them, and the meshes that are read after the arm is shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial

from app.shared.memory.answers import MemoryFullError, Reservation
from app.viewer.feature import Stage
from app.viewer.meshes.archive import MeshError, TooLargeError
from app.viewer.meshes.incoming import Awaited, IncomingFile
from app.viewer.meshes.links import drawing_of, drawing_without_meshes, fingers_of, shapes_of, size_of
from app.viewer.meshes.placing import Shapes
from app.viewer.meshes.reader import MOST_TRIANGLES, Meshes, full
from app.viewer.own_arm import OwnArm
from app.viewer.panel import Post
from app.viewer.panel.status import Notice
from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.tabs.robot.doctor import Doctor
from app.viewer.tabs.robot.files import (
    MOST,
    Busy,
    Source,
    arm_of,
    bodies_in,
    file_error,
    is_urdf,
    opened,
    tips_of,
    with_capsules,
)
from kin import InputError, KinematicsError, Robot, RobotFileError
from kin.files.urdf.collisions import LinkPieces, without_meshes
from kin.files.urdf.visuals import MeshFile, read_visuals

MOST_BACK = 20  # steps that are taken back to the arm that a refused file has replaced
HERE = "They are in this page only, not in its link."


@dataclass(frozen=True, eq=False)
class _Reading:
    """Meshes that are being read: of which arm and file, how many, and how many have been read.

    Attributes:
        replaced: the id of the robot that was on show before.
        links: its collision bodies.
        fingers: beside it, whose parts are among what is read.
    """

    own: OwnArm
    replaced: str
    source: Source
    count: int
    links: Sequence[LinkPieces]
    fingers: Sequence[Finger] = ()
    done: int = 0

    @property
    def robot(self) -> Robot:
        """The arm."""
        return self.own.robot


class Uploads:
    """The files of one visitor.

    Posts ``("reading", number)`` while meshes are being read, ``("meshes", number)`` when they were, and
    ``("refused",)`` with a reason and whose arm it is when nothing of the file is used.

    Args:
        begin: shows an own arm that a file gave, with what is to be said about it.

    Attributes:
        waiting: a file about which something is to be chosen.
        last: the arm of the file that was opened last.
        doctor: the report about the URDF that was opened last.
    """

    def __init__(self, stage: Stage, post: Post, begin: Callable[[OwnArm, str], None]) -> None:
        self._stage = stage
        self._post = post
        self._begin = begin
        self._awaited = Awaited(lambda *words: stage.status.show(Notice("error", *words)))
        self._number = 0
        self._tip: str | None = None  # of the URDF that was opened last
        self._reading: _Reading | None = None
        self._future: Future[Meshes] | None = None
        self.waiting: Source | None = None
        self.last: OwnArm | None = None
        self.doctor = Doctor()

    @property
    def busy(self) -> Busy | None:
        """What goes on."""
        if (file := self._awaited.coming) is not None:
            return Busy(f"Receiving “{file.name}”", file.arrived, file.total, "MB")
        if self._reading is not None:
            name = self._reading.source.name
            return Busy(f"Reading the meshes of “{name}”", self._reading.done, self._reading.count)
        return None

    def stop(self) -> str:
        """End what goes on; returns what is to be said about it."""
        receiving, reading = self._awaited.drop(), self._reading
        self._reading = None
        self._cancel()
        if receiving:
            return "The file was not used; the arm stays as it is."
        return "" if reading is None else "The arm is a skeleton; open the file again to see its meshes."

    def forget(self) -> None:
        """The visitor has left."""
        self._awaited.drop()
        self.waiting = self._reading = None
        self.doctor.close()
        self._cancel()

    def _cancel(self) -> None:
        """Meshes that wait or are being read are not wanted any more."""
        if self._future is not None:
            self._stage.meshes.reader.cancel(self._future)
            self._future = None

    def expect(self, file: IncomingFile) -> None:
        """A file is on its way, or has failed, which is said."""
        self._awaited.expect(file)

    def take(self, file: IncomingFile) -> None:
        """A file that is whole, unless it was cancelled meanwhile; raises `kin.KinematicsError`."""
        if not self._awaited.take(file):
            return
        try:
            content = file.text_or_zip(MOST)
        except MeshError as error:
            raise file_error("upload", error) from None
        self.waiting = None
        self.doctor.close()
        if isinstance(content, str):
            self.doctor.look(Source(file.name, content))
        self._open(opened(file.name, content, file.room))

    def open_mended(self) -> None:
        """Open the URDF of the report once more, mended; raises `kin.KinematicsError`."""
        source = self.doctor.mended
        self.waiting = None
        self._open(replace(source, tips=tips_of(source.name, source.text)), self._tip)

    def choose(self, what: str, value: object) -> None:
        """The URDF or the tip that was chosen; raises `kin.KinematicsError`."""
        source = self.waiting
        if source is None or not isinstance(value, str) or not value:
            return
        if what == "urdf":
            self._open(source.with_urdf(value))
        elif source.tips:
            self._open(source, tip=value)

    def _open(self, source: Source, tip: str | None = None) -> None:
        if not source.text or (source.tips and tip is None):
            self.waiting = source
            what = ("ends", "the link of the tool") if source.text else ("robots", "one of its URDF files")
            title = f"{source.name} has several {what[0]}"
            self._stage.status.show(Notice("advice", title, f"Choose {what[1]}, below."))
            return
        name = f"{source.name}: {source.urdf}" if source.urdf else source.name
        self._tip = tip
        self.doctor.look(source, tip)
        try:
            own, words = arm_of(name, source.text, tip, reading=source.archive is not None)
        except InputError as error:
            raise RobotFileError(name, error.field, error.value, error.expected) from None
        self.last = own = replace(own, start=own.robot.id)
        self.waiting, self._reading = None, None
        self._cancel()
        wrong = ""
        if is_urdf(source.text):
            try:
                words = f"{words} {self._look(own, source, tip)}".rstrip()
            except KinematicsError as error:
                wrong = str(error)
        self._begin(own, words)
        if wrong:
            self._say_wrong(source, wrong)

    def _look(self, own: OwnArm, source: Source, tip: str | None) -> str:
        """Draw what the links look like, or have their meshes read; returns what is to be said about it."""
        robot, visuals = own.robot, read_visuals(source.text, tip, source.name)
        if source.archive is None:
            plain = [visual for visual in visuals if not isinstance(visual.shape, MeshFile)]
            if plain == list(visuals):
                self._draw_plain(robot, source, shapes_of(robot, plain), fingers_of(robot, plain))
                return ""
            return "Open it together with its meshes, and they are shown."
        links = bodies_in(source.name, source.text, tip, robot)
        shapes = shapes_of(robot, visuals, links if any(link.meshes for link in links) else ())
        count = len(shapes.files)
        if not count and not shapes.bodies:
            self._draw_plain(robot, source, shapes, fingers_of(robot, visuals))
            _, words = with_capsules(own, links, without_meshes(links, robot.reach))
            return words
        self._number += 1
        done, read = ("meshes", self._number), ("reading", self._number)
        try:
            future = self._stage.meshes.read(
                shapes, source.data, source.urdf, source.room, lambda k, _: self._post(read, k)
            )
        except MeshError as error:
            raise file_error(source.name, error) from None
        fingers, kept = fingers_of(robot, visuals), links if shapes.bodies else ()
        self._reading = _Reading(own, self._stage.arm.now.robot.id, source, count, kept, fingers)
        future.add_done_callback(partial(self._post, done))
        self._future = future
        return f"Its {count} meshes are being read." if count else "Its collision meshes are being read."

    def note_progress(self, number: int, done: object) -> None:
        """So many meshes of the file have been read."""
        if self._reading is not None and number == self._number and isinstance(done, int):
            self._reading = replace(self._reading, done=done)

    def use_meshes(self, number: int, done: object) -> None:
        """Draw meshes that were read, unless another file was opened since."""
        reading = self._reading
        if number != self._number or reading is None or not isinstance(done, Future):
            return
        self._reading = self._future = None
        source = reading.source
        try:
            meshes: Meshes = done.result()
            self._draw(reading.robot, source, drawing_of(meshes.links, reading.fingers), meshes.room)
        except TooLargeError as error:
            self._post(("refused",), (reading, str(file_error(source.name, error)), MOST_BACK))
            return
        except (MeshError, KinematicsError) as error:
            known = file_error(source.name, error) if isinstance(error, MeshError) else error
            self._say_wrong(source, str(known))
            return
        words = f"{reading.count} meshes with {meshes.triangles} triangles"
        if meshes.triangles > MOST_TRIANGLES:
            words += f", simplified to about {MOST_TRIANGLES}"
        bodies = self._use_capsules(reading, meshes)
        self._stage.post("body", "")
        self._stage.status.show(
            Notice("hand", f"The meshes of {source.name} are shown", f"{words}. {HERE} {bodies}")
        )

    def _use_capsules(self, reading: _Reading, meshes: Meshes) -> str:
        """Give the arm the capsules of its collision bodies, and say where they are from."""
        if not reading.links:
            _, words = with_capsules(reading.own, (), ())
            return words
        own, words = with_capsules(reading.own, reading.links, meshes.fits)
        if self.last == reading.own:
            self.last = own
        if self._stage.robots.own == reading.own and self._stage.arm.now.robot == reading.robot:
            self._stage.robots.edit(own)
        return words

    def refuse(self, value: object) -> str:
        """Bring back the arm that a refused file has replaced, as undo does.

        Returns:
            What is to be said about it; "" while it is not there yet.
        """
        match value:
            case (_Reading() as reading, str(words), int(left)):
                pass
            case _:
                raise InputError("refused", value, "the file that is refused")
        robot = self._stage.arm.now.robot
        if robot != reading.robot or robot.id == reading.replaced or not left:
            return words
        self._stage.post("undo")  # once more for each step that the visitor has made since
        self._post(("refused",), (reading, words, left - 1))
        return ""

    def _draw_plain(self, robot: Robot, source: Source, shapes: Shapes, fingers: Sequence[Finger]) -> None:
        """Draw boxes, cylinders and spheres."""
        if not shapes.pieces:
            return
        try:
            self._draw(
                robot, source, drawing_without_meshes(shapes, fingers), self._stage.meshes.memory.reserve(0)
            )
        except MeshError as error:
            raise file_error(source.name, error) from None

    def _draw(self, robot: Robot, source: Source, body: Drawing, room: Reservation) -> None:
        try:
            room.resize(size_of(body))
        except MemoryFullError:
            raise file_error(source.name, full()) from None
        if any(body.parts):
            self._stage.bodies.add(robot, body, room, source.name)

    def _say_wrong(self, source: Source, words: str) -> None:
        detail = f"The arm is a skeleton. {words}"
        self._stage.status.show(Notice("error", f"The meshes of {source.name} cannot be shown", detail))
