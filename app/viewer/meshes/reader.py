"""Reads meshes, one request at a time, each in a process of its own, and bounds the memory of all meshes.

Clients take turns, and each may take a share of the queue and of the memory. Bodies of packages have a turn and
memory of their own.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from weakref import WeakValueDictionary

import numpy as np

from app.shared.clients import share_of
from app.shared.memory.answers import AnswerMemory, MemoryFullError, MemoryShare, Reservation
from app.shared.threads import lower_priority
from app.viewer.meshes.archive import MOST_BYTES, MeshError, TooLargeError
from app.viewer.meshes.fitting import checked
from app.viewer.meshes.placing import MOST_DRAWN, Shapes
from app.viewer.meshes.surface import LinkBody, pack, unpack, unpack_fits
from kin.files.urdf.collisions import Fitted

MOST_TRIANGLES = 80_000  # of an arm, in the browser
PATIENCE = 60.0  # seconds for one request, on a busy machine
MOST_WAITING = 8  # requests of all visitors, with the one that is being read
OF_PACKAGES = 32 * 1024 * 1024  # bytes of the bodies of packages
PACKAGES = ""  # the client that asks for them
LONGEST_ANSWER = 64 * MOST_DRAWN  # bytes: each triangle with three points of its own takes 48
_KEPT = ("PATH", "LANG", "LC_ALL", "SYSTEMROOT", "OPENBLAS_CORETYPE")  # variables that the process needs


Progress = Callable[[int, int], None]  # the number of meshes that are read, and of all meshes


@dataclass(frozen=True, eq=False)
class Meshes:
    """What the links of an arm look like, base first.

    Attributes:
        triangles: how many there were before they were simplified, each file as often as it is drawn.
        room: the memory they take, given back when they are forgotten.
        fits: capsules around the collision bodies of each URDF link.
    """

    links: list[LinkBody]
    triangles: int
    room: Reservation
    fits: list[Fitted] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class _Request:
    """Meshes that are wanted, the memory they will take, and the room of the zip, kept as long as its bytes.

    `urdf` is the file of the zip that names the meshes.
    """

    client: str
    shapes: Shapes
    source: bytes | Path
    memory: AnswerMemory
    room: Reservation | None = None
    urdf: str = ""
    progress: Progress = lambda done, count: None
    future: Future[Meshes] = field(default_factory=Future)


class MeshReader:
    """The reader of one service process. Any thread may use it.

    Args:
        most: bytes of all meshes, and of zips that arrive, that the process holds for visitors.
        share: of these bytes, and of the queue, that one client may take.
        receive_timeout: seconds that a zip may pause while it arrives.
    """

    def __init__(self, most: int = 128 * 1024 * 1024, share: float = 0.75, receive_timeout: float = 20.0) -> None:
        self.memory = AnswerMemory(max(MOST_BYTES, most), most)
        self.receive_timeout = receive_timeout
        self._of_packages = AnswerMemory(OF_PACKAGES, OF_PACKAGES)
        self._most_of_one = share_of(MOST_WAITING, share)
        self._memory_of_one = max(MOST_BYTES, int(most * share))
        self._shares: WeakValueDictionary[str, MemoryShare] = WeakValueDictionary()
        self._executor = ThreadPoolExecutor(1, "meshes", lower_priority)
        self._lock = threading.Lock()
        self._count: Counter[str] = Counter()  # requests of each client that are not done
        self._waiting: dict[str, deque[_Request]] = {}  # the client whose turn is next is first
        self._running: Future[Meshes] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def of(self, client: str) -> ClientMeshes:
        """The reader for a visitor of this client."""
        with self._lock:
            memory = self._shares.get(client)
            if memory is None:
                self._shares[client] = memory = MemoryShare(self.memory, self._memory_of_one)
        return ClientMeshes(self, client, memory)

    def read_package(self, shapes: Shapes, folder: Path) -> Future[Meshes]:
        """Read meshes of a folder that is trusted, whose paths are relative to it."""
        return self._add(_Request(PACKAGES, shapes, folder, self._of_packages))

    def cancel(self, future: Future[Meshes]) -> None:
        """End a request that is not wanted any more, whether it waits or is being read."""
        if future.cancel():
            return
        with self._lock:
            if self._running is future:
                self._running = None
                self._kill()

    def close(self) -> None:
        """End what is being read; returns at once."""
        self._closed = True
        self._executor.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            self._kill()

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()

    def _add(self, request: _Request) -> Future[Meshes]:
        client = request.client
        with self._lock:
            if client != PACKAGES:
                count = self._count.total() - self._count[PACKAGES]
                if count >= MOST_WAITING or self._count[client] >= self._most_of_one:
                    raise MeshError("meshes", f"{count} requests are waiting", "another try in a moment")
            self._count[client] += 1
            self._waiting.setdefault(client, deque()).append(request)
        request.future.add_done_callback(lambda _: self._done(client))
        self._executor.submit(self._next)
        return request.future

    def _done(self, client: str) -> None:
        """A request of this client is done; those that were cancelled, and their zips, are forgotten."""
        with self._lock:
            self._count[client] -= 1
            left = deque(one for one in self._waiting.get(client, ()) if not one.future.cancelled())
            if left:
                self._waiting[client] = left  # where it was in the order
            else:
                self._waiting.pop(client, None)
            if not self._count[client]:
                del self._count[client]

    def _next(self) -> None:
        """Read what the client wants whose turn it is, if anything is still wanted."""
        with self._lock:
            client = next(iter(self._waiting), None)
            if client is None:
                return
            queue = self._waiting.pop(client)
            request = queue.popleft()
            if queue:
                self._waiting[client] = queue  # behind the others
            if not request.future.set_running_or_notify_cancel():
                return
            self._running = request.future
        try:
            request.future.set_result(self._read(request))
        except MeshError as error:
            error.__context__ = None  # its frames, and that of this error, hold the zip
            request.future.set_exception(error.with_traceback(None))
        except BaseException as error:  # noqa: BLE001 - the future raises it
            request.future.set_exception(error)

    def _read(self, request: _Request) -> Meshes:
        answer = self._answer(request)
        try:
            links, triangles = unpack(answer, MOST_DRAWN)
            fits = checked(unpack_fits(answer), request.shapes.bodies)
        except (ValueError, KeyError, TypeError):
            raise too_much() from None
        if len(links) != request.shapes.links:
            raise too_much()
        size = sum(surface.size for link in links for surface in link.surfaces)
        try:
            return Meshes(links, triangles, request.memory.reserve(size), fits)
        except MemoryFullError:
            raise full() from None

    def _answer(self, request: _Request) -> bytes:
        command = [sys.executable, "-c", f"from {__package__}.child import main; main()"]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=_environment()
        ) as process:
            with self._lock:
                self._process = process
                if self._closed or self._running is not request.future:
                    process.kill()
            patience = threading.Timer(PATIENCE, process.kill)
            patience.daemon = True
            patience.start()
            sender = threading.Thread(target=_send, args=(process, request), daemon=True)
            sender.start()
            answer = _receive(process, request.progress)
            process.kill()  # if it would say more than it may
            process.wait()
            sender.join()
            patience.cancel()
            with self._lock:
                self._process = self._running = None
        if answer[:1] == b"E":
            raise MeshError(*json.loads(answer[1:]))
        if answer[:1] == b"L":
            raise TooLargeError(*json.loads(answer[1:]))
        if answer[:1] != b"N":
            raise too_much()
        return answer[1:]


def _send(process: subprocess.Popen[bytes], request: _Request) -> None:
    """Tell the process what is wanted."""
    shapes, source = request.shapes, request.source
    solids = pack([LinkBody(shapes.solids, np.empty((0, 3), np.float32))])
    head: dict[str, object] = {
        "pieces": shapes.pieces,
        "bodies": shapes.bodies,
        "links": shapes.links,
        "reach": shapes.reach,
        "most": MOST_TRIANGLES,
        "solids": len(solids),
    }
    if isinstance(source, Path):
        head["folder"], source = str(source), b""
    else:
        head["urdf"] = request.urdf
    assert process.stdin is not None
    with contextlib.suppress(OSError), process.stdin as stdin:  # it may have ended
        stdin.write(json.dumps(head).encode() + b"\n")
        stdin.write(solids)
        stdin.write(source)


def _receive(process: subprocess.Popen[bytes], progress: Progress) -> bytes:
    """The answer of the process, without its reports; cut off if it is too long."""
    assert process.stdout is not None
    answer = process.stdout.readline(LONGEST_ANSWER)
    while report := re.fullmatch(rb"P(\d{1,4}) (\d{1,4})\n", answer):
        progress(int(report[1]), int(report[2]))
        answer = process.stdout.readline(LONGEST_ANSWER)
    return answer + process.stdout.read(LONGEST_ANSWER)


@dataclass(frozen=True, eq=False)
class ClientMeshes:
    """The reader as visitors of one client use it.

    Attributes:
        memory: the client's share, for meshes and zips that arrive.
    """

    reader: MeshReader
    client: str
    memory: MemoryShare

    def read(
        self,
        shapes: Shapes,
        source: bytes,
        urdf: str,
        room: Reservation | None = None,
        progress: Progress = lambda done, count: None,
    ) -> Future[Meshes]:
        """Read meshes of a zip.

        Args:
            urdf: the file of the zip that names them.
            room: of the zip's bytes, kept until the request is done or cancelled.
            progress: called by another thread.

        Raises:
            MeshError: too many requests wait, of this client or of all.
        """
        return self.reader._add(_Request(self.client, shapes, source, self.memory, room, urdf, progress))


def too_much() -> TooLargeError:
    """The error when the process ended without an answer, or with none that can be."""
    return TooLargeError("meshes", "too much work or memory", "fewer or simpler meshes")


def full() -> MeshError:
    """The error when there is no room for meshes."""
    return MeshError("meshes", "the service holds as many as it may", "another try later")


def _environment() -> dict[str, str]:
    """What the process needs of the environment: nothing of the settings, which hold the token."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    return kept | {"PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
