"""The line between a page and the program that is connected to it.

What the program sends waits in the line until the page's worker takes it: of each kind only the newest value, so
that a fast program makes nobody wait. It also keeps what the page shows, with a number for each change. The
program's connection sends changes as often as the program asks. Both sides are woken by calls that return at once;
all methods are thread-safe.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from app.classroom.tokens import new_code
from app.live.announced import Announcement
from app.live.codes import unused_code
from app.live.recording import Recording
from app.live.recording.recording import OPENED, SHOWN
from app.shared.problems import Problem
from kin import Robot

# What a program may subscribe to.
VALUES: Final = ("q", "gripper", "target", "result", "contacts", "program")
MOVES, DRAWS = EVENTS = ("live", "drawn")  # what a page is to take: what undo restores, and what it does not
MERGED: Final = "draw"  # of this kind the newest value of each name is kept
# What changes nothing that undo restores.
QUIET: Final = frozenset({"drives", "announce", "readings", "measured", "measured_gripper", "draw", "clear"})
REPLIES: Final = 64  # answers that may wait for a program; older ones are dropped
REVOKED: Final = "The page has withdrawn the code."
LEFT: Final = "The page was closed."

Post = Callable[[str, object], None]

RESERVED: Final[set[str]] = set()  # codes of pages that are still to be opened, such as those of a notebook
TICKETS: Final[dict[str, str]] = {}  # of these, the codes of pages with a ticket in their address, by the ticket


def reserved(key: str) -> str:
    """The code that is reserved for a page with `key` in its address, or empty.

    The key is the code, which any page may have again, or a ticket. A ticket counts once: other users of the
    machine may read the address that a browser is started with.
    """
    return key if key in RESERVED else TICKETS.pop(key, "")


def invite() -> tuple[str, str]:
    """Reserve a code for one page of this process; returns the ticket for its address, and the code."""
    ticket, code = new_code() + new_code(), unused_code(RESERVED)
    expect(ticket, code)
    return ticket, code


def expect(ticket: str, code: str) -> None:
    """Reserve the ticket and the code of an invitation that another process has made, for one page of this one."""
    RESERVED.add(code)
    TICKETS[ticket] = code


class BusyLineError(Exception):
    """Another program is connected to the page; `name` is its name."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name


@dataclass
class Program:
    """A program that is connected.

    Attributes:
        name: as it calls itself.
        session: a word of its own. Who comes with the same one is this program, over a new connection.
        wake: called after each change of what it wants, from any thread.
        delay: seconds that a message and its answer were under way; None: not known yet.
        wants: of `VALUES`, what it has subscribed to.
        rate: how many messages came within the last second.
    """

    name: str
    session: str
    wake: Callable[[], None]
    delay: Callable[[], float | None] = lambda: None
    rate: Callable[[], int] = lambda: 0
    wants: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Reply:
    """What a program hears once.

    That what the message of this number asks for is done, or why it is not; or which of its buttons was pressed.
    """

    number: int | None = None
    problem: Problem | None = None
    pressed: str = ""


@dataclass
class PendingUpdate:
    """What a program has sent since the page last took it, by kind, in the order of the last posts."""

    values: dict[str, Any] = field(default_factory=dict)
    numbers: list[int] = field(default_factory=list)


class Line:
    """See the module.

    Args:
        code: of the page.
        robot: on show.
        post: queues an event for the page, one of `EVENTS`.
    """

    def __init__(self, code: str, robot: Robot, post: Post) -> None:
        self.code = code
        self.robot = robot
        self._post = post
        self._lock = threading.Lock()
        self._program: Program | None = None
        self._pending = {key: PendingUpdate() for key in EVENTS}
        self._values: dict[str, tuple[int, Any]] = {}
        self._count = 0
        self._replies: deque[Reply] = deque(maxlen=REPLIES)
        self.ended = ""  # why, once it has
        self.readings: Sequence[float] | None = None  # the newest ones of the motors of a real arm
        self.measured: Sequence[float] | None = None  # where the real arm was last, in joint values
        self.announced: Announcement | None = None  # the newest one of the program
        self.recording: Recording | None = None

    def note(self, way: str, text: str | bytes) -> None:
        """Record a message of the connection, if it is recorded.

        Args:
            way: ``"sent"`` or ``"heard"``, as the program sees it.
            text: the message as it crosses the network: an object in JSON.
        """
        recording = self.recording  # once: the page's worker may take it away meanwhile
        if recording is not None and recording.ended is None:
            recording.take(way, json.loads(text))

    # The program

    @property
    def program(self) -> Program | None:
        """The program that is connected now."""
        return self._program

    def connect(self, program: Program) -> None:
        """Connect a program, in place of an earlier connection of its own; raises `BusyLineError`."""
        with self._lock:
            before = self._program
            if before is not None and before.session != program.session:
                raise BusyLineError(before.name)
            self._program = program
            self._replies.clear()
        if before is not None:
            before.wake()
        self._post(DRAWS, None)

    def disconnect(self, program: Program) -> None:
        """The connection of a program has ended; what it has drawn goes with it, unless it is connected again."""
        with self._lock:
            if self._program is not program:
                return
            self._program, self.readings, self.measured, self.announced = None, None, None, None
            left = {"drives": None, "announce": None, "clear": True, "measured": None, "measured_gripper": None}
            self._pending[DRAWS] = PendingUpdate(left)
        self._post(DRAWS, None)

    def send(self, values: Mapping[str, Any], number: int | None = None) -> None:
        """Pass on what a message of the program holds."""
        quiet = {name: value for name, value in values.items() if name in QUIET}
        moving = {name: value for name, value in values.items() if name not in QUIET}
        with self._lock:
            self.readings = quiet.get("readings", self.readings)
            self.measured = quiet.get("measured", self.measured)
            self.announced = quiet.get("announce", self.announced)
            for key, some in ((DRAWS, quiet), (MOVES, moving)):
                waiting = self._pending[key].values
                for name, value in some.items():
                    if name == MERGED:
                        value = {**waiting.get(name, {}), **value}
                    elif name == "clear":
                        waiting.pop(MERGED, None)
                    waiting.pop(name, None)
                    waiting[name] = value
            if number is not None:
                self._pending[MOVES if moving else DRAWS].numbers.append(number)
        if quiet:
            self._post(DRAWS, None)
        if moving:
            self._post(MOVES, None)

    def news(self, known: Mapping[str, int]) -> dict[str, tuple[int, Any]]:
        """What has changed for the program since it saw these numbers of changes, with the numbers of now."""
        with self._lock:
            wants = {"robot", *(self._program.wants if self._program is not None else ())}
            return {
                name: value
                for name, value in self._values.items()
                if name in wants and known.get(name) != value[0]
            }

    def replies(self) -> list[Reply]:
        """What the program hears once, since the last call."""
        with self._lock:
            replies = list(self._replies)
            self._replies.clear()
        return replies

    # The page

    def take(self, key: str) -> PendingUpdate:
        """What the program has sent for this event of the page since the last call."""
        with self._lock:
            pending, self._pending[key] = self._pending[key], PendingUpdate()
        return pending

    def publish(self, name: str, value: object, anew: bool = True) -> None:
        """What the page shows now; unless `anew`, only where it is another object than before."""
        with self._lock:
            before = self._values.get(name)
            if before is not None and before[1] is value and not anew:
                return
            self._count += 1
            self._values[name] = self._count, value
            program = self._program
        recording = self.recording
        if name == "q" and recording is not None:
            recording.add(SHOWN, {"q": value.tolist()})  # type: ignore[attr-defined]
        if name == "gripper" and recording is not None and value is not None:
            recording.add(OPENED, {"gripper": value})
        if program is not None and (name in program.wants or name == "robot"):
            program.wake()

    def use_robot(self, robot: Robot) -> None:
        """The page shows another robot."""
        if robot is not self.robot:
            self.measured = None
        self.robot = robot
        self.publish("robot", robot, anew=False)

    def write(self, number: int | None = None, problem: Problem | None = None) -> None:
        """Tell the program something once."""
        reply = Reply(number, problem)
        with self._lock:
            program = self._program
            if program is not None:
                self._replies.append(reply)
        if program is not None:
            program.wake()

    def press(self, name: str, seen: Announcement | None = None) -> bool:
        """Tell the program that one of its buttons was pressed; False: it does not offer it now.

        Args:
            seen: the announcement that the visitor has seen; None: any, for what stops something.
        """
        with self._lock:
            program, announced = self._program, self.announced
            button = None if announced is None else announced.button(name)
            if program is None or button is None or not (seen is announced or (seen is None and button.stops)):
                return False
            self._replies.append(Reply(pressed=name))
        program.wake()
        return True

    def end(self, why: str) -> None:
        """End the connection of the program, and let no other come."""
        self.ended = why
        if (program := self._program) is not None:
            program.wake()


class Lines:
    """The lines of all pages, by their codes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lines: dict[str, Line] = {}

    def open(self, robot: Robot, post: Post, code: str = "") -> Line:
        """A new line of a page that shows this robot; with a reserved code, in place of an earlier page."""
        with self._lock:
            if code not in RESERVED:
                code = unused_code({*self._lines, *RESERVED})
            before = self._lines.get(code)
            line = self._lines[code] = Line(code, robot, post)
        if before is not None:
            before.end(LEFT)
        return line

    def find(self, code: str) -> Line | None:
        """The line with this code, as `read_code` returns it."""
        return self._lines.get(code)

    def close(self, line: Line, why: str) -> None:
        """End a line; its code counts no more."""
        with self._lock:
            if self._lines.get(line.code) is line:
                del self._lines[line.code]
        line.end(why)


class Listener:
    """The line of one page, while there is one.

    Args:
        post: queues an event for the page.
        locked: whether none may be opened.
    """

    def __init__(self, lines: Lines, post: Post, locked: bool = False) -> None:
        self._lines = lines
        self._post = post
        self.locked = locked
        self.line: Line | None = None

    def open(self, robot: Robot, code: str = "") -> None:
        """Open a line unless there is one."""
        if self.line is None and not self.locked:
            self.line = self._lines.open(robot, self._post, code)
            self.line.use_robot(robot)

    def close(self, why: str = REVOKED) -> None:
        """End the line."""
        if self.line is not None:
            self._lines.close(self.line, why)
            self.line = None
