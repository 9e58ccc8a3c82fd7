"""A file that a page sends by an HTTP request of its own, beside its messages (static/upload.js).

The event loop receives it, into room that was reserved from the length that the request announces. The feature
that it is for learns that it is on its way, how far it is, and that it is there or has failed; it may cancel it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from app.shared.memory.answers import Reservation
from app.viewer.meshes.archive import MeshError
from kin import InputError
from kin.typed import cut

ZIP = b"PK"  # begins a zip
PROXY = "Something between the browser and the service takes no file of this size."
CUT_OFF = "The connection ended before all of it had come. Open it again."


class IncomingFile:
    """One file. The event loop calls `add`, `finish` and `fail`; who has the whole file calls the rest.

    Args:
        name: of the file.
        total: bytes that are announced.
        room: where they are counted.
        changed: called when there is more of it, when it is whole and when it has failed.

    Attributes:
        arrived: bytes so far.
        whole: whether all of it is there.
        failure: why it will not come, in words; empty: it has not failed.
        cancelled: whether nobody wants it any more.
    """

    def __init__(self, name: str, total: int, room: Reservation, changed: Callable[[IncomingFile], None]) -> None:
        self.name, self.total, self.room = name, total, room
        self.arrived, self.whole, self.failure, self.cancelled = 0, False, "", False
        self._changed = changed
        self._lock = threading.Lock()  # the room must be given back once
        self._parts: list[bytes] = []

    def add(self, part: bytes) -> None:
        """Take a part; raises `ValueError` if there is more than was announced."""
        if self.arrived + len(part) > self.total:
            raise ValueError(f"more than the {self.total} bytes that were announced")
        self._parts.append(part)
        self.arrived += len(part)

    def note(self) -> None:
        """Report how far it is."""
        self._changed(self)

    def finish(self) -> None:
        """All of it has come; raises `ValueError` if there is less than was announced."""
        if self.arrived != self.total:
            raise ValueError(f"{self.arrived} of {self.total} bytes")
        self.whole = True

    def fail(self, why: str) -> None:
        """Give it up, and its room back."""
        self.failure = why
        self.forget()
        self._changed(self)

    def cancel(self) -> None:
        """Nobody wants it any more."""
        self.cancelled = True
        self.forget()

    def forget(self) -> None:
        """Drop what has come, and give its room back."""
        with self._lock:
            self._parts = []
            self.room.release()

    @property
    def notice(self) -> tuple[str, str]:
        """What is said when it has failed: title and detail."""
        title = f"{self.name} did not arrive" if self.failure == CUT_OFF else "The file was not used"
        return title, self.failure

    @property
    def busy(self) -> bool:
        """Whether more of it is to come."""
        return not (self.whole or self.failure or self.cancelled)

    def content(self) -> bytes:
        """Its bytes, once; the room stays reserved, and belongs to the caller."""
        parts, self._parts = self._parts, []
        return b"".join(parts)

    def text(self, most: int) -> str:
        """It as a text, whose room is given back; raises `MeshError` if it has more than `most` characters."""
        text = self.content().decode("utf-8", "replace").removeprefix("\ufeff")
        self.forget()
        if len(text) > most:
            raise MeshError(f"{self.name}: size", "it is too large", f"at most {most // 1000} kB")
        return text

    def text_or_zip(self, most: int) -> str | bytes:
        """Its bytes if it is a zip, otherwise as `text`."""
        begin = self._parts[0] if self._parts else b""
        return self.content() if begin.startswith(ZIP) else self.text(most)


class Awaited:
    """The file that a part of the page waits for: one at a time, the newest.

    Args:
        refused: called with title and detail of what is said of a file that has failed.
    """

    def __init__(self, refused: Callable[[str, str], object]) -> None:
        self._refused = refused
        self._file: IncomingFile | None = None

    @property
    def coming(self) -> IncomingFile | None:
        """The file, while more of it is to come."""
        return self._file if self._file is not None and self._file.busy else None

    def expect(self, file: IncomingFile) -> bool:
        """A file is on its way, or has failed, which is said. Returns whether it replaces what went on."""
        if file.cancelled:
            return False
        if another := file is not self._file:
            self.drop()
        self._file = None if file.failure else file
        if file.failure:
            self._refused(*file.notice)
        return another

    def take(self, file: IncomingFile) -> bool:
        """A file is whole. Returns whether it is wanted: not if it was cancelled meanwhile."""
        if file is not self._file:
            return False
        self._file = None
        return True

    def drop(self) -> bool:
        """The file is not wanted any more. Returns whether there was one."""
        file, self._file = self._file, None
        if file is not None:
            file.cancel()
        return file is not None


def not_sent(value: object) -> tuple[str, str]:
    """What is said of a file that the page could not send: title and detail.

    Args:
        value: the name of the file and the status of the answer, 0 if there was none.

    Raises:
        kin.InputError: it is something else.
    """
    match value:
        case [str(name), int(status)]:
            why = PROXY if status == 413 else f"The answer was {status}." if status else CUT_OFF
            return f"{cut(name)} did not arrive", why
    raise InputError("upload", value, "the name of a file, and the status that its request was answered with")
