"""A cloud into a file, or standard output, with a line that tells how far it is.

A file appears under its name when it is whole: until then it is a hidden neighbour, which an interruption removes.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import BinaryIO, TextIO

from app.exports.formats import FORMATS, encode, slices, table_of
from app.shared.clouds import Cloud, Clouds
from kin import WorkspaceChunk

_TOLD_EVERY = 0.1  # seconds
_BAR = 24


def save(cloud: Cloud, target: str, kind: str, with_q: bool, progress: bool) -> int:
    """Write a cloud in the format `kind`, a row of `app.exports.formats.FORMATS`; returns the number of bytes.

    Args:
        cloud: which cloud.
        target: path of the file, or "-" for standard output.
        kind: format.
        with_q: whether the configurations come along.
        progress: whether to tell on standard error how far it is.

    Raises:
        OSError: the file cannot be written; nothing is left of it.
    """
    clouds = Clouds(max_bytes=0, threads=os.cpu_count())
    total = cloud.n * FORMATS[kind].passes(table_of(cloud, with_q))
    told = Progress(total, sys.stderr) if progress else None
    size = 0
    try:
        with opened(target) as file, closing(encode(kind, clouds, cloud, with_q, told)) as pieces:
            for piece in pieces:
                file.write(piece)
                size += len(piece)
            file.flush()
    finally:
        clouds.close()
        if told is not None:
            told.end()
    return size


@contextmanager
def reading(cloud: Cloud, progress: bool) -> Iterator[Iterator[WorkspaceChunk]]:
    """The slices of a cloud, told on standard error as they are taken."""
    clouds = Clouds(max_bytes=0, threads=os.cpu_count())
    told = Progress(cloud.n, sys.stderr) if progress else None

    def watched() -> Iterator[WorkspaceChunk]:
        for chunk in slices(clouds, cloud, False):
            if told is not None:
                told(chunk)
            yield chunk

    try:
        yield watched()
    finally:
        clouds.close()
        if told is not None:
            told.end()


@contextmanager
def opened(target: str) -> Iterator[BinaryIO]:
    """A file that gets its name when all went well; standard output and devices are written to as they are."""
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


class Progress:
    """A line rewritten in place: how far, how fast, how long yet."""

    def __init__(self, total: int, out: TextIO) -> None:
        self._total = total
        self._out = out
        self._done = 0
        self._begun = time.perf_counter()
        self._told = -math.inf

    def __call__(self, chunk: WorkspaceChunk) -> None:
        """Count a slice."""
        self._done += chunk.done - chunk.start
        now = time.perf_counter()
        if self._done == self._total or now - self._told >= _TOLD_EVERY:
            self._told = now
            print("\r" + self.line(now - self._begun), end="", file=self._out, flush=True)

    def line(self, seconds: float) -> str:
        """What is told after so many seconds."""
        part = self._done / self._total
        rate = self._done / max(seconds, 1e-9)
        left = (self._total - self._done) / max(rate, 1e-9)
        bar = "#" * int(part * _BAR)
        return f"[{bar:<{_BAR}}] {part:4.0%}  {rate / 1e6:8.3f} M points/s  {left:6.0f} s left"

    def end(self) -> None:
        """Leave the line."""
        print(file=self._out, flush=True)
