"""A recording that the visitor opens: it is read behind the page.

Recordings come from anybody, and a large one takes seconds to read: one thread of low priority reads one after the
other, for all pages of the process.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Final

from app.live.recording import Bounds, Recording, read
from app.shared.memory.answers import Reservation
from app.shared.threads import in_short_turns, lower_priority
from app.viewer.feature import Stage
from app.viewer.meshes.incoming import Awaited, IncomingFile
from app.viewer.panel import Post
from app.viewer.panel.status import Notice
from kin import Robot

_reader: Final = ThreadPoolExecutor(1, "recordings", lower_priority)


class Opening:
    """See the module. Posts ``("read", number)`` with a future of the recording.

    Args:
        bounds: of a recording that is opened.
    """

    def __init__(self, stage: Stage, post: Post, bounds: Bounds) -> None:
        self._stage, self._post, self._bounds = stage, post, bounds
        self._awaited = Awaited(lambda *words: stage.status.show(Notice("error", *words)))
        self._future: Future[Recording] | None = None
        self._number = 0
        self.name = ""  # of the file that is being read or was read last

    @property
    def busy(self) -> tuple[str, float] | None:
        """What goes on, and how far it is, in per cent; None: nothing."""
        if self._future is not None:
            return f"Reading “{self.name}” …", 100.0
        if (file := self._awaited.coming) is not None:
            return f"Receiving “{file.name}” …", round(100.0 * file.arrived / max(file.total, 1))
        return None

    def expect(self, file: IncomingFile) -> None:
        """A file is on its way, or has failed, which is said."""
        if self._awaited.expect(file):
            self._cancel()

    def take(self, file: IncomingFile) -> None:
        """A file that is whole, unless it was cancelled meanwhile."""
        if not self._awaited.take(file):
            return
        self._cancel()
        self.name = file.name
        self._number += 1
        self._future = _reader.submit(_read, file.content(), self._stage.arm.now.robot, self._bounds, file.room)
        self._future.add_done_callback(partial(self._post, ("read", self._number)))

    def result(self, number: int, done: object) -> Recording | None:
        """What has been read, if it is still wanted; raises `kin.InputError`: nothing that can be played."""
        if number != self._number or self._future is None or not isinstance(done, Future):
            return None
        self._future = None
        found: Recording = done.result()
        return found

    def stop(self) -> None:
        """End what goes on."""
        self._awaited.drop()
        self._cancel()

    def _cancel(self) -> None:
        if self._future is not None:
            self._future.cancel()
            self._future = None


def _read(data: bytes, robot: Robot, bounds: Bounds, room: Reservation) -> Recording:
    try:
        with in_short_turns():
            return read(data, robot, bounds)
    finally:
        room.release()
