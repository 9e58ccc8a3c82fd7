"""Reads meshes, one request at a time, each in a process of its own, and bounds the memory of all meshes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from app.shared.memory.answers import AnswerMemory, MemoryFullError, Reservation
from app.shared.threads import DaemonExecutor, lower_priority
from app.viewer.meshes.archive import MOST_BYTES, MeshError
from app.viewer.meshes.surface import Surface, unpack

MOST_TRIANGLES = 80_000  # of an arm, in the browser
PATIENCE = 60.0  # seconds for one request, on a busy machine
MOST_WAITING = 8  # requests
_KEPT = ("PATH", "LANG", "LC_ALL", "SYSTEMROOT", "OPENBLAS_CORETYPE")  # variables that the process needs


@dataclass(frozen=True, eq=False)
class Meshes:
    """The surfaces of mesh files, by name.

    Attributes:
        triangles: how many there were before they were simplified, each file as often as it is drawn.
        room: the memory they take, given back when they are forgotten.
    """

    files: Mapping[str, list[Surface]]
    triangles: int
    room: Reservation


class MeshReader:
    """The reader of one service process. Any thread may use it.

    Args:
        most: bytes of all meshes, and of zips that arrive, that the process holds.
    """

    def __init__(self, most: int = 128 * 1024 * 1024) -> None:
        self.memory = AnswerMemory(max(MOST_BYTES, most), most)
        self._executor = DaemonExecutor(1, "meshes", lower_priority)
        self._lock = threading.Lock()
        self._waiting = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def read(self, files: Mapping[str, int], source: bytes | Path) -> Future[Meshes]:
        """Read meshes of a zip, or of a folder that is trusted.

        Args:
            files: their names, and how often each is drawn.

        Raises:
            MeshError: too many requests wait.
        """
        with self._lock:
            if self._waiting >= MOST_WAITING:
                raise MeshError("meshes", f"{self._waiting} requests are waiting", "another try in a moment")
            self._waiting += 1
        future = self._executor.submit(self._read, dict(files), source)
        future.add_done_callback(lambda _: self._done())
        return future

    def close(self) -> None:
        """End what is being read; returns at once."""
        self._closed = True
        self._executor.shutdown()
        process = self._process
        if process is not None:
            process.kill()

    def _done(self) -> None:
        with self._lock:
            self._waiting -= 1

    def _read(self, files: dict[str, int], source: bytes | Path) -> Meshes:
        request: dict[str, object] = {"files": files, "most": MOST_TRIANGLES}
        if isinstance(source, Path):
            request["folder"], source = str(source), b""
        found, triangles = unpack(list(files), self._answer(json.dumps(request).encode() + b"\n" + source))
        size = sum(surface.size for surfaces in found.values() for surface in surfaces)
        try:
            return Meshes(found, triangles, self.memory.reserve(size))
        except MemoryFullError:
            raise full() from None

    def _answer(self, request: bytes) -> bytes:
        command = [sys.executable, "-c", f"from {__package__}.child import main; main()"]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=_environment()
        ) as process:
            self._process = process
            if self._closed:
                process.kill()
            try:
                answer, _ = process.communicate(request, PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                answer = b""
            self._process = None
        if answer[:1] == b"E":
            raise MeshError(*json.loads(answer[1:]))
        if answer[:1] != b"N" or process.returncode != 0:
            raise MeshError("meshes", "too much work or memory", "fewer or simpler meshes")
        return answer[1:]


def full() -> MeshError:
    """The error when there is no room for meshes."""
    return MeshError("meshes", "the service holds as many as it may", "another try later")


def _environment() -> dict[str, str]:
    """What the process needs of the environment: nothing of the settings, which hold the token."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    return kept | {"PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
