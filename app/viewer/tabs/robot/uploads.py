"""Files that a visitor opens: what is asked about them, and the meshes that are read after the arm is shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace

from app.shared.memory.answers import MemoryFullError
from app.viewer.feature import Stage
from app.viewer.meshes.archive import MeshError
from app.viewer.meshes.links import drawing_of, mesh_files, size_of
from app.viewer.meshes.reader import MOST_TRIANGLES, Meshes, full
from app.viewer.own_arm import OwnArm
from app.viewer.panel import Post
from app.viewer.panel.status import Notice
from app.viewer.tabs.robot.files import Incoming, Source, arm_of, file_error, is_urdf, opened
from kin import InputError, KinematicsError, Robot, RobotFileError
from kin.files.urdf.visuals import MeshFile, Visual, read_visuals

HERE = "They are in this page only, not in its link."


@dataclass(frozen=True, eq=False)
class _Reading:
    """Meshes that are being read: of which arm and file, and what they are called in the zip."""

    robot: Robot
    source: Source
    visuals: Sequence[Visual]
    names: dict[str, str]


class Uploads:
    """The files of one visitor. Posts ``("meshes", number)`` when meshes were read.

    Args:
        begin: shows an own arm that a file gave, with what is to be said about it.

    Attributes:
        waiting: a file about which something is to be chosen.
        last: the arm of the file that was opened last.
    """

    def __init__(self, stage: Stage, post: Post, begin: Callable[[OwnArm, str], None]) -> None:
        self._stage = stage
        self._post = post
        self._begin = begin
        self._incoming = Incoming(stage.meshes.memory)
        self._number = 0
        self._reading: _Reading | None = None
        self._future: Future[Meshes] | None = None
        self.waiting: Source | None = None
        self.last: OwnArm | None = None

    @property
    def arrived(self) -> int:
        """Bytes of a zip of which more is to come."""
        return self._incoming.arrived

    @property
    def reading(self) -> str:
        """The file whose meshes are being read; empty: none."""
        return "" if self._reading is None else self._reading.source.name

    def forget(self) -> None:
        """The visitor has left."""
        self._incoming.forget()
        self.waiting = self._reading = None
        self._cancel()

    def _cancel(self) -> None:
        """Meshes that wait or are being read are not wanted any more."""
        if self._future is not None:
            self._stage.meshes.reader.cancel(self._future)
            self._future = None

    def take(self, value: object) -> None:
        """A part of a file; raises `kin.KinematicsError`."""
        try:
            file = self._incoming.take(value)
        except MeshError as error:
            raise file_error("upload", error) from None
        if file is not None:
            self.waiting = None
            self._open(opened(*file))

    def end_stalled(self, now: float) -> float | None:
        """End an upload whose next part does not come.

        Args:
            now: `time.perf_counter`'s.

        Returns:
            The seconds after which to call this again; None: nothing is on its way.
        """
        name, last = self._incoming.name, self._incoming.last
        if not name:
            return None
        timeout = self._stage.meshes.reader.receive_timeout
        if now - last < timeout:
            return last + timeout - now
        self._incoming.forget()
        detail = f"For {timeout:g} s no part of it has come. Open it again."
        self._stage.notify(Notice("error", f"{name} did not arrive", detail))
        return None

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
            self._stage.notify(Notice("advice", title, f"Choose {what[1]}, below."))
            return
        name = f"{source.name}: {source.urdf}" if source.urdf else source.name
        try:
            own, words = arm_of(name, source.text, tip)
        except InputError as error:
            raise RobotFileError(name, error.field, error.value, error.expected) from None
        self.last = own = replace(own, start=own.robot.id)
        self.waiting, self._reading = None, None
        self._cancel()
        wrong = ""
        if is_urdf(source.text):
            try:
                words = f"{words} {self._look(own.robot, source, tip)}".rstrip()
            except KinematicsError as error:
                wrong = str(error)
        self._begin(own, words)
        if wrong:
            self._say_wrong(source, wrong)

    def _look(self, robot: Robot, source: Source, tip: str | None) -> str:
        """Draw what the links look like, or have their meshes read; returns what is to be said about it."""
        visuals = read_visuals(source.text, tip, source.name)
        files = mesh_files(visuals)
        if source.archive is None:
            shapes = [visual for visual in visuals if not isinstance(visual.shape, MeshFile)]
            if not files and shapes:
                self._draw(_Reading(robot, source, shapes, {}), self._no_meshes())
            return "Open a zip of this file and its meshes, and they are shown." if files else ""
        try:
            names = {path: source.archive.find(path, source.urdf) for path in files}
        except MeshError as error:
            raise file_error(source.name, error) from None
        reading = _Reading(robot, source, visuals, names)
        if not files:
            self._draw(reading, self._no_meshes())
            return ""
        uses: dict[str, int] = {}
        for path, name in names.items():
            uses[name] = uses.get(name, 0) + files[path]
        self._number += 1
        key = ("meshes", self._number)
        try:
            future = self._stage.meshes.read(uses, source.data, source.room)
        except MeshError as error:
            raise file_error(source.name, error) from None
        self._reading = reading
        future.add_done_callback(lambda done: self._post(key, done))
        self._future = future
        return f"Its {len(uses)} meshes are being read."

    def use_meshes(self, number: int, done: object) -> None:
        """Draw meshes that were read, unless another file was opened since."""
        reading = self._reading
        if number != self._number or reading is None or not isinstance(done, Future):
            return
        self._reading = self._future = None
        try:
            meshes: Meshes = done.result()
            files = {path: meshes.files[name] for path, name in reading.names.items()}
            self._draw(reading, replace(meshes, files=files))
        except (MeshError, KinematicsError) as error:
            known = file_error(reading.source.name, error) if isinstance(error, MeshError) else error
            self._say_wrong(reading.source, str(known))
            return
        self._stage.redraw_body()
        words = f"{len(meshes.files)} meshes with {meshes.triangles} triangles"
        if meshes.triangles > MOST_TRIANGLES:
            words += f", simplified to about {MOST_TRIANGLES}"
        self._stage.notify(Notice("hand", f"The meshes of {reading.source.name} are shown", f"{words}. {HERE}"))

    def _draw(self, reading: _Reading, meshes: Meshes) -> None:
        try:
            body = drawing_of(reading.robot, reading.visuals, meshes)
            meshes.room.resize(size_of(body))
        except MeshError as error:
            raise file_error(reading.source.name, error) from None
        except MemoryFullError:
            raise file_error(reading.source.name, full()) from None
        if any(body.parts):
            self._stage.bodies.add(reading.robot, body, meshes.room, reading.source.name)

    def _no_meshes(self) -> Meshes:
        return Meshes({}, 0, self._stage.meshes.memory.reserve(0))

    def _say_wrong(self, source: Source, words: str) -> None:
        detail = f"The arm is a skeleton. {words}"
        self._stage.notify(Notice("error", f"The meshes of {source.name} cannot be shown", detail))
