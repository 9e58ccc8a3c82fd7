"""A file that the page's own script sends in parts, because a message has a limit (static/upload.js)."""

from __future__ import annotations

import base64
import binascii
import time

from app.shared.memory.answers import AnswerMemory, MemoryFullError, Reservation
from app.viewer.meshes.archive import MB, MeshError
from app.viewer.meshes.reader import full
from kin import InputError
from kin.typed import cut


class Incoming:
    """A file that arrives in parts: text, or bytes in base64.

    Args:
        memory: where room for bytes is reserved while they arrive.
        most_text: characters of a text.
        most_bytes: of bytes.
        kind: what bytes are, such as "a zip".

    Attributes:
        name: of the file of which more is to come; empty if there is none.
        last: when the last part came, as `time.perf_counter` tells it.
        total: bytes of a file of which more is to come, as its sender says.
    """

    def __init__(self, memory: AnswerMemory, most_text: int, most_bytes: int, kind: str) -> None:
        self._memory = memory
        self._most_text, self._most_bytes, self._kind = most_text, most_bytes, kind
        self.forget()

    def forget(self) -> None:
        """Drop what has arrived."""
        self.name, self.last, self.total = "", 0.0, 0
        self._parts: list[str | bytes] = []
        self._length = 0
        self._room = self._memory.reserve(0)

    @property
    def arrived(self) -> int:
        """Bytes of a file of which more is to come."""
        return self._length if self._parts and isinstance(self._parts[0], bytes) else 0

    def take(self, value: object) -> tuple[str, str | bytes, Reservation] | None:
        """Add a part; name, content and room of the file if it was the last one.

        Raises:
            MeshError: the file is too large; its parts are forgotten.
            kin.InputError: not a part of a file.
        """
        name, first, last, part, from_, total = _part(value)
        from_ = self._length if from_ is None else from_
        if first:
            self.forget()
            self.name, self.total = name, total
        elif not self._parts:
            return None  # the rest of a file that was refused
        elif not self._follows(name, part, from_):
            self.forget()
            raise MeshError(f"{name}: part", "a part that does not follow the one before", "another try")
        self._parts.append(part)
        self.last = time.perf_counter()
        self._length += len(part)
        most = self._most_text if isinstance(part, str) else self._most_bytes
        try:
            self._room.resize(0 if isinstance(part, str) else min(self._length, most))
        except MemoryFullError:
            self.forget()
            raise full() from None
        if self._length > most:
            self.forget()
            limit = f"{most // 1000} kB" if isinstance(part, str) else f"{most // MB} MB for {self._kind}"
            raise MeshError(f"{name}: size", "it is too large", f"at most {limit}")
        if not last:
            return None
        empty: str | bytes = type(part)()
        content, room = empty.join(self._parts), self._room  # type: ignore[arg-type]
        self.forget()
        return name, content, room

    def left(self, now: float, timeout: float) -> float | None:
        """Seconds until the next part, which may take `timeout`, is late; None: nothing is awaited.

        Args:
            now: `time.perf_counter`'s.
        """
        return self.last + timeout - now if self.name else None

    def _follows(self, name: str, part: str | bytes, before: int) -> bool:
        """Whether a part continues what has arrived."""
        same = name == self.name and type(part) is type(self._parts[0])
        return same and before == self._length


def late(timeout: float) -> str:
    """What is said about an upload whose next part does not come."""
    return f"For {timeout:g} s no part of it has come. Open it again."


def _part(value: object) -> tuple[str, bool, bool, str | bytes, int | None, int]:
    """Name, whether it is the first and the last part, content; of bytes how many came before, and of how many."""
    match value:
        case [str(name), bool(first), bool(last), str(part)] if part or last:
            return cut(name), first, last, part, None, 0
        case [str(name), bool(first), bool(last), str(part), "base64", int(before), int(total)] if part or last:
            try:
                return cut(name), first, last, base64.b64decode(part, validate=True), before, total
            except (binascii.Error, ValueError):
                pass
    raise InputError("upload", value, "name, whether it is the first part, the last part, and its text or base64")
