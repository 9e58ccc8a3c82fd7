"""Files that a page sends by HTTP requests: room is reserved, the feature hears of each, one replaces another.

A feature lists in `Feature.files` what it takes. It gets the event ``("arriving", key)`` with the file when it
begins to come, several times a second while it does, and when it fails, and a message with the file when it is
whole. That is subject to what the page may do as all messages are.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Final, NoReturn

from app.shared.connection import FileRefused, SentFile
from app.shared.memory.answers import AnswerMemory, AnswerTooLargeError, MemoryFullError
from app.shared.security import Rights
from app.viewer.feature import Feature
from app.viewer.meshes.archive import MB
from app.viewer.meshes.incoming import CUT_OFF, IncomingFile
from app.viewer.panel import Post
from app.viewer.session.channel.channel import MAY_LOOK
from kin.typed import cut

NOTED_EVERY: Final = 0.2  # s between two reports of how far a file is


class Files:
    """The files of one page. The event loop uses it.

    Args:
        features: those on show.
        memory: where room for files is reserved.
    """

    def __init__(
        self, post: Post, features: Callable[[], Iterable[Feature]], memory: AnswerMemory, rights: Rights
    ) -> None:
        self._post, self._features = post, features
        self._memory, self._rights = memory, rights
        self._arriving: dict[tuple[str, str], IncomingFile] = {}
        self._numbers = itertools.count(-1, -1)  # no message of the page has such a number

    async def receive(self, sent: SentFile, parts: AsyncIterator[bytes]) -> None:
        """Receive a file, and give it to its feature; raises `FileRefused`."""
        file = self._begin(sent)
        noted = time.monotonic()
        try:
            async for part in parts:
                if file.cancelled:
                    raise FileRefused(409, "The file is not wanted any more.", said=True)
                file.add(part)
                if time.monotonic() - noted >= NOTED_EVERY:
                    noted = time.monotonic()
                    file.note()
            file.finish()
            file.note()  # its feature may not get it
        except ValueError as error:
            file.fail(CUT_OFF)
            raise FileRefused(400, f"The file does not have its length: {error}.", said=True) from None
        except BaseException:  # the client has left, or was too slow
            if not file.cancelled:
                file.fail(CUT_OFF)
            raise
        finally:
            if self._arriving.get((sent.feature, sent.key)) is file:
                del self._arriving[sent.feature, sent.key]
        self._post(("message", "feature", next(self._numbers)), [sent.feature, [sent.key], file])

    def _begin(self, sent: SentFile) -> IncomingFile:
        """A file with its room, in place of one that is still coming; raises `FileRefused`."""
        if not self._rights.compute:
            raise FileRefused(403, MAY_LOOK)
        feature = next((each for each in self._features() if each.key == sent.feature), None)
        most = None if feature is None else feature.files.get(sent.key)
        if most is None:
            raise FileRefused(404, "The page has no place for such a file.")
        name = cut(sent.name)
        if (before := self._arriving.pop((sent.feature, sent.key), None)) is not None:
            before.cancel()
        if sent.size > most:
            self._refuse(sent, 413, f"{name}: size: it is too large, expected at most {_size(most)}.")
        try:
            room = self._memory.reserve(sent.size)
        except (MemoryFullError, AnswerTooLargeError):
            self._refuse(sent, 503, f"{name}: the service holds as many files as it may, try later.")
        file = IncomingFile(name, sent.size, room, lambda changed: self._note(sent, changed))
        self._arriving[sent.feature, sent.key] = file
        file.note()
        return file

    def _refuse(self, sent: SentFile, status: int, why: str) -> NoReturn:
        """Say in the page, too, why a file is not taken."""
        file = IncomingFile(cut(sent.name), sent.size, self._memory.reserve(0), lambda _: None)
        file.fail(why)
        self._note(sent, file)
        raise FileRefused(status, why, said=True)

    def _note(self, sent: SentFile, file: IncomingFile) -> None:
        self._post(("feature", sent.feature, ("arriving", sent.key)), file)


def _size(most: int) -> str:
    return f"{most // MB} MB" if most >= MB else f"{most // 1000} kB"
