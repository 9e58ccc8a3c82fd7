"""A cloud as a file or on standard output, with a progress bar.

A file appears under its name when it is complete: until then it is a hidden file next to it, which is removed if
writing is interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import BinaryIO

from app.exports.formats import FORMATS, encode, slices, table_of
from app.exports.progress import progress_bar
from app.shared.clouds import Cloud, Clouds
from kin.workspace import WorkspaceChunk


def save(cloud: Cloud, target: str, kind: str, with_q: bool, progress: bool) -> int:
    """Write a cloud in the format `kind`, a row of `app.exports.formats.FORMATS`; returns the number of bytes.

    Args:
        cloud: which cloud.
        target: path of the file, or "-" for standard output.
        kind: format.
        with_q: whether to write the configurations as well.
        progress: whether to show progress on standard error.

    Raises:
        OSError: the file cannot be written; nothing is left of it.
    """
    clouds = Clouds(max_bytes=0, threads=os.cpu_count())
    total = cloud.n * FORMATS[kind].passes(table_of(cloud, with_q))
    size = 0
    try:
        with progress_bar(total, "points", progress) as advance:
            pieces = encode(kind, clouds, cloud, with_q, lambda chunk: advance(chunk.done - chunk.start))
            with opened(target) as file, closing(pieces):
                for piece in pieces:
                    file.write(piece)
                    size += len(piece)
                file.flush()
    finally:
        clouds.close()
    return size


@contextmanager
def reading(cloud: Cloud, progress: bool) -> Iterator[Iterator[WorkspaceChunk]]:
    """The slices of a cloud, with progress on standard error as they are read."""
    clouds = Clouds(max_bytes=0, threads=os.cpu_count())
    try:
        with progress_bar(cloud.n, "points", progress) as advance:

            def counted() -> Iterator[WorkspaceChunk]:
                for chunk in slices(clouds, cloud, False):
                    advance(chunk.done - chunk.start)
                    yield chunk

            yield counted()
    finally:
        clouds.close()


@contextmanager
def opened(target: str) -> Iterator[BinaryIO]:
    """A file that gets its name on success; standard output and devices are written to directly."""
    if target == "-":
        yield sys.stdout.buffer
        return
    path = Path(target).resolve()  # of a link, the file behind it is replaced
    if path.exists() and not path.is_file():
        with path.open("wb") as file:
            yield file
        return
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with partial.open("xb") as file:
            yield file
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
