"""A recording that the visitor opens: it arrives in parts, and is read behind the page.

Recordings come from anybody, and a large one takes seconds to read: one thread of low priority reads one after the
other, for all pages of the process.
"""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial
from typing import Final

from app.live.recording import Bounds, Recording, read
from app.shared.memory.answers import Reservation
from app.shared.threads import lower_priority
from app.shared.threads.executor import DaemonExecutor
from app.viewer.feature import Stage
from app.viewer.meshes.incoming import Incoming
from app.viewer.panel import Post
from kin import Robot

MOST_TEXT: Final = 0  # recordings are sent as bytes, tables too
_reader: Final = DaemonExecutor(1, "recordings", lower_priority)


class Opening:
    """See the module. Posts ``("read", number)`` with a future of the recording.

    Args:
        bounds: of a recording that is opened.
    """

    def __init__(self, stage: Stage, post: Post, bounds: Bounds) -> None:
        self._stage, self._post, self._bounds = stage, post, bounds
        self._incoming = Incoming(stage.meshes.memory, MOST_TEXT, bounds.size, "a recording")
        self._future: Future[Recording] | None = None
        self._number = 0
        self.name = ""  # of the file that is being read or was read last

    @property
    def busy(self) -> tuple[str, float] | None:
        """What goes on, and how far it is, in per cent; None: nothing."""
        if self._future is not None:
            return f"Reading “{self.name}” …", 100.0
        if self._incoming.name:
            total = max(self._incoming.total, 1)
            return f"Receiving “{self._incoming.name}” …", round(
                min(100.0 * self._incoming.arrived / total, 100.0)
            )
        return None

    def take(self, value: object) -> None:
        """A part of a file.

        Raises:
            MeshError: it is too large, there is no room for it, or a part of it is missing.
            kin.InputError: no part of a file.
        """
        self._cancel()
        file = self._incoming.take(value)
        if file is None:
            return
        self.name, content, room = file
        data = content.encode() if isinstance(content, str) else content
        self._number += 1
        self._future = _reader.submit(_read, data, self._stage.now.robot, self._bounds, room)
        self._future.add_done_callback(partial(self._post, ("read", self._number)))

    def result(self, number: int, done: object) -> Recording | None:
        """What has been read, if it is still wanted; raises `kin.InputError`: nothing that can be played."""
        if number != self._number or self._future is None or not isinstance(done, Future):
            return None
        self._future = None
        found: Recording = done.result()
        return found

    def stalled(self, now: float, timeout: float) -> str:
        """End a file whose next part does not come; returns its name, "" if there is none."""
        left = self._incoming.left(now, timeout)
        name = self._incoming.name if left is not None and left <= 0.0 else ""
        if name:
            self._incoming.forget()
        return name

    def stop(self) -> None:
        """End what goes on."""
        self._incoming.forget()
        self._cancel()

    def _cancel(self) -> None:
        if self._future is not None:
            self._future.cancel()
            self._future = None


def _read(data: bytes, robot: Robot, bounds: Bounds, room: Reservation) -> Recording:
    try:
        return read(data, robot, bounds)
    finally:
        room.release()
