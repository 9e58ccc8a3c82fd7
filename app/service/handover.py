"""Parts of a service: the processes that share its work, and connections that they hand to one another.

Of a process's threads only one at a time runs Python, so visitors who drag would wait for the JSON of programs. On
Linux, programs are therefore answered by processes of their own. There is still one port: the viewer's process
accepts all connections. When the head of a request has arrived that is not for it, and no answer is under way, it
sends the open connection, with the bytes read so far, to a process for REST, and so back for a later request.
A connection belongs to one process at a time, which counts it, bounds it and logs it.

The sockets between processes outlive them: if a process dies, its successor serves what was sent to it. A process
whose partner is away does everything itself, as far as it can: the viewer's process answers REST; a process for
REST accepts connections, and tells visitors that the viewer is warming up.

A program that is to be connected to a page may reach any process of any worker. The code in its address says which
one has the page (:mod:`app.live.codes`), and so do the addresses of a page's channel and files: the processes with
viewers are linked for these connections alone.
"""

from __future__ import annotations

import asyncio
import errno
import itertools
import logging
import socket
import sys
from collections import deque
from collections.abc import Callable, MutableSequence, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final

from app.live import code_in, home_of
from app.shared import metrics
from app.shared.security import place_of_page
from kin.warmup.preparation import SIZE

logger = logging.getLogger("kinboard.connections")

SUPPORTED: Final = sys.platform == "linux"  # what follows needs SO_REUSEPORT and Unix sockets that keep messages
LARGEST: Final = 192 * 1024  # bytes of a message: what fits into the buffer of a Unix socket by default
AT_ONCE: Final = 4  # connections taken in one round of the event loop: see `server.ACCEPTED`
RETRY: Final = 0.01  # seconds until a full socket is tried again
_BUSY: Final = (errno.EAGAIN, errno.ENOBUFS, errno.ETOOMANYREFS)


class Role(Enum):
    """What a process does while its partners are there."""

    ALL = "all"
    VIEWER = "viewer"
    REST = "rest"

    def serves(self, path: str) -> bool:
        """Whether requests for `path`, below the prefix of the service, stay in this process.

        Pages and their files are served by either, so that a browser's connections stay where they are.
        """
        if self is Role.ALL or path in ("/", "/favicon.ico") or path.startswith("/static/"):
            return True
        viewer = path == "/viewer" or path.startswith("/viewer/")
        return viewer is (self is Role.VIEWER)


class Phase(IntEnum):
    """How far the start of a process is. Each process writes its own, the supervisor that it has ended."""

    AWAY = 0
    SERVING = 1
    READY = 2  # what moves an arm is compiled
    COMPLETE = 3  # everything is compiled
    FAILED = 4


@dataclass(frozen=True)
class Member:
    """One process of a service.

    Attributes:
        number: index among all processes of the service.
        listener: the socket of this and its partners.
        phases: of all processes, in memory that they share.
        kernels: memory of `kin.warmup.preparation`, which they share.
        counts: memory of `app.shared.metrics`, which they share.
        group: numbers of this and its partners, the process of the viewer first.
        links: sockets to the partners, and of a process with a viewer to the others with one, by their numbers.
    """

    role: Role
    number: int
    listener: socket.socket
    phases: MutableSequence[int]
    kernels: MutableSequence[int]
    counts: MutableSequence[int]
    group: Sequence[int]
    links: dict[int, socket.socket]

    @property
    def accepts(self) -> bool:
        """Whether this process accepts connections while all are there."""
        return self.role is not Role.REST

    @property
    def partners(self) -> Sequence[int]:
        """The numbers of the others in the group."""
        return [number for number in self.links if number in self.group]

    @property
    def place(self) -> tuple[int, int]:
        """Of the groups, the number of this one, and how many there are."""
        size = len(self.group)
        return self.group[0] // size, len(self.phases) // size

    def home(self, code: str) -> int:
        """The process that has the page with this code."""
        return home_of(code, self.place[1]) * len(self.group)

    def away(self, number: int) -> bool:
        """Whether a process serves nobody."""
        return self.phases[number] == Phase.AWAY

    def report(self, phase: Phase) -> None:
        """Tell the others how far this process is."""
        self.phases[self.number] = phase


def members(
    listeners: Sequence[socket.socket], partners: int, shared: Callable[[int], MutableSequence[int]]
) -> list[Member]:
    """The processes of a service: one for each listener, and so many for REST beside each.

    Args:
        shared: makes an array of bytes in shared memory.
    """
    size = 1 + partners
    count = size * len(listeners)
    memory = shared(count), shared(SIZE), shared(count * metrics.SIZE)
    found = []
    for first, listener in zip(range(0, count, size), listeners, strict=True):
        group = range(first, first + size)
        pairs = {
            number: socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for number in group[1:] if SUPPORTED
        }
        ours = {number: pair[0] for number, pair in pairs.items()}
        role = Role.VIEWER if pairs else Role.ALL
        found.append(Member(role, first, listener, *memory, group, ours))
        for number, pair in pairs.items():
            found.append(Member(Role.REST, number, listener, *memory, group, {first: pair[1]}))
    if SUPPORTED:
        for one, other in itertools.combinations(found[::size], 2):
            ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            one.links[other.number], other.links[one.number] = ends
    return found


class Handover:
    """Sends connections to the partners of this process, and receives theirs. Used by the event loop only.

    Args:
        prefix: of all paths of the service, or nothing.
    """

    def __init__(self, member: Member, prefix: str = "") -> None:
        self._member = member
        self._prefix = prefix
        self._waiting: dict[int, deque[tuple[asyncio.Transport, bytes]]] = {n: deque() for n in member.links}
        self._turns = itertools.cycle(member.partners)
        self._adopt: Callable[[socket.socket, bytes], None]
        self._ended = False
        for link in member.links.values():
            link.setblocking(False)

    def start(self, adopt: Callable[[socket.socket, bytes], None]) -> None:
        """Receive from now on; `adopt` is called with each connection and what was read from it."""
        self._adopt = adopt
        loop = asyncio.get_running_loop()
        for number in self._member.links:
            loop.add_reader(self._member.links[number], self._receive, number)

    def stop(self) -> None:
        """Send nothing more, and take at once what others have sent."""
        self._ended = True
        loop = asyncio.get_running_loop()
        for number, link in self._member.links.items():
            loop.remove_reader(link)
            while self._receive(number):
                pass

    def destination(self, path: str, adopted: bool = False) -> int | None:
        """The process that a request for this path belongs to; None: this one, at least for now.

        Args:
            adopted: whether another process has sent the connection, with this request.
        """
        if self._ended or not self._waiting:
            return None
        if self._prefix and path.startswith(self._prefix + "/"):
            path = path.removeprefix(self._prefix)
        if (code := code_in(path)) is not None:
            return self._towards(self._member.home(code))
        if (place := place_of_page(path)) is not None:
            return self._towards(place * len(self._member.group))
        if adopted or self._member.role.serves(path):
            return None
        for _ in self._member.partners:
            number = next(self._turns)
            if not self._member.away(number):
                return number
        return None

    def _towards(self, home: int) -> int | None:
        """The next process on the way to the one with a page; None: this one, or it is away."""
        number = home if home in self._waiting else self._member.group[0]
        return None if number == self._member.number or self._member.away(number) else number

    def send(self, number: int, transport: asyncio.Transport, data: bytes) -> None:
        """Hand over a connection, from which nothing more is read, and the bytes read from it."""
        waiting = self._waiting[number]
        waiting.append((transport, data))
        if len(waiting) == 1:
            self._flush(number)

    def _flush(self, number: int) -> None:
        waiting = self._waiting[number]
        while waiting:
            transport, data = waiting[0]
            if not transport.is_closing():
                try:
                    file = transport.get_extra_info("socket").fileno()
                    socket.send_fds(self._member.links[number], [data], [file])
                except OSError as error:
                    if error.errno in _BUSY:
                        asyncio.get_running_loop().call_later(RETRY, self._flush, number)
                        return
                    logger.error("a connection could not be handed over: %s", error)
                transport.abort()  # closes our file only; nothing is waiting to be written
            waiting.popleft()

    def _receive(self, number: int) -> bool:
        """Take connections that a partner has sent; returns whether there were any."""
        for k in range(AT_ONCE):
            try:
                data, files, _, _ = socket.recv_fds(self._member.links[number], LARGEST, 1)
            except BlockingIOError:
                return k > 0
            if not data:  # no other process has the far end any more: this one is about to stop
                asyncio.get_running_loop().remove_reader(self._member.links[number])
                return False
            for file in files:  # none if this process may open no more
                connection = socket.socket(fileno=file)
                connection.setblocking(False)
                self._adopt(connection, data)
        return True
