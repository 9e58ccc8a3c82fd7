"""A recording: every message with its time, and what the arm was commanded and measured to do in it.

A recording belongs to one arm, and is bounded in time and in memory: it ends by itself, and says why. Its topics
are ``/sent/…`` and ``/heard/…`` with the name of a field or the type of a message, and ``/page/q`` and
``/page/gripper`` for the configurations that the page showed, and how far the gripper was open there.
"""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final
from weakref import WeakSet

import numpy as np

from kin import InputError, Robot
from kin.parsing import Limits, TextError, read_json
from kin.transforms import Array

SHOWN: Final = "/page/q"
OPENED: Final = "/page/gripper"
MEASURED: Final = "/sent/measured"
MEASURED_GRIPPER: Final = "/sent/measured_gripper"
# What was commanded, where the page itself was not recorded.
SPOKEN: Final = {SHOWN: ("/sent/q", "/heard/q"), OPENED: ("/sent/gripper", "/heard/gripper")}
READ: Final = "read from a file"  # why one has ended that was not made here
ENTRY: Final = 120  # bytes of an entry beside its data
LARGEST: Final = 1e6  # radians, metres
MESSAGE: Final = Limits(16 * 1024, 512, 4)  # of a message with a configuration
STEP: Final = 1 << 20  # bytes between two looks at all recordings of a process

_shared: WeakSet[Recording] = WeakSet()
_shared_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Entry:
    """A message: seconds since the beginning, topic, and the JSON text of an object."""

    time: float
    topic: str
    data: bytes


@dataclass(frozen=True, eq=False)
class Track:
    """The arm over time.

    Attributes:
        t: times ``(k,)`` of changes, seconds.
        commanded, measured: configurations ``(k, n)``, radians (metres); NaN before the first one.
        opening: how far the gripper was to be open ``(k,)``, 0 (closed) to 1 (open); NaN before the first one.
        measured_opening: how far it was measured to be open ``(k,)``; NaN where it is not known.
    """

    t: Array
    commanded: Array
    measured: Array
    opening: Array
    measured_opening: Array

    def at(self, time: float) -> tuple[Array | None, Array | None]:
        """What was commanded and measured at a time ``(n,)``, or at the first one; None: nothing yet."""
        if not len(self.t):
            return None, None
        found = self.commanded[self._row(time)], self.measured[self._row(time)]
        return tuple(None if np.isnan(q).any() else q for q in found)  # type: ignore[return-value]

    def opening_at(self, time: float) -> float | None:
        """How far the gripper was to be open at a time, or at first; None: nothing says it."""
        later = self.opening[self._row(time) :]
        known = later[:1] if not np.isnan(later[:1]).any() else later[~np.isnan(later)]
        return float(known[0]) if len(known) else None

    def measured_opening_at(self, time: float) -> float | None:
        """How far the gripper was measured to be open at a time; None: it is not known."""
        found = self.measured_opening[self._row(time) :][:1]
        return None if np.isnan(found).any() or not len(found) else float(found[0])

    def _row(self, time: float) -> int:
        return max(int(np.searchsorted(self.t, time, side="right")) - 1, 0)


@dataclass(frozen=True)
class Bounds:
    """What a recording may take.

    Attributes:
        seconds: its length.
        size: bytes in memory, and of its file.
        shared: bytes of all recordings of this process that have this bound; None: it does not count among them.
    """

    seconds: float = 3600.0
    size: int = 256 << 20
    shared: int | None = None


class Recording:
    """See the module. All methods are thread-safe.

    Args:
        robot: the arm.
        name: of the program.
        bounds: what it may take.
        started: when it began (ns since 1970); None: now.

    Attributes:
        ended: why it has ended; None: it has not.
        entries: the messages so far.
        size: their bytes in memory.
    """

    def __init__(
        self,
        robot: Robot,
        name: str = "",
        bounds: Bounds = Bounds(),
        started: int | None = None,
    ) -> None:
        self.robot, self.name = robot, name
        self.bounds = bounds
        self.started = time.time_ns() if started is None else started
        self.ended: str | None = None
        self.entries: list[Entry] = []
        self.size = 0
        self._began = time.monotonic()
        self._end = 0.0
        self._lock = threading.Lock()
        if bounds.shared is not None:
            with _shared_lock:
                _shared.add(self)

    @property
    def seconds(self) -> float:
        """How long it is."""
        return min(time.monotonic() - self._began, self.bounds.seconds) if self.ended is None else self._end

    def take(self, way: str, message: Mapping[str, Any]) -> None:
        """Record a message of the connection, ``"sent"`` or ``"heard"``: each value under its own topic.

        Args:
            way: which of both, as the program sees it.
            message: as `json.loads` returns it.
        """
        if self.ended is not None:
            return
        number = {} if message.get("id") is None else {"id": message["id"]}
        kind = "news" if way == "sent" else message.get("type")
        if kind == "news":
            for field, value in message.items():
                if field not in ("id", "type"):
                    self.add(f"/{way}/{field}", {field: value, **number})
        else:
            self.add(f"/{way}/{kind}", {name: value for name, value in message.items() if name != "type"})

    def add(self, topic: str, message: Mapping[str, Any]) -> None:
        """Record a message; it ends the recording if there is no room for it, or no time."""
        if self.ended is not None:
            return
        data = json.dumps(message, separators=(",", ":")).encode()
        now, cost = time.monotonic() - self._began, len(data) + ENTRY
        with self._lock:
            if now > self.bounds.seconds:
                self._finish(
                    self.bounds.seconds, f"it has reached {self.bounds.seconds:g} s, the most there may be"
                )
            elif self.size + cost > self.bounds.size:
                self._finish(now, f"it has reached {self.bounds.size / 1e6:.0f} MB, the most there may be")
            elif self.size // STEP != (self.size + cost) // STEP and self._crowded():
                self._finish(now, "the recordings of all pages have filled the service's memory for them")
            elif self.ended is None:
                self.entries.append(Entry(now, topic, data))
                self.size += cost

    def end(self, why: str = "stopped") -> None:
        """End it."""
        with self._lock:
            self._finish(min(time.monotonic() - self._began, self.bounds.seconds), why)

    def restored(self, entries: list[Entry], seconds: float) -> Recording:
        """This recording with the entries of a file, in the order of their times.

        Raises:
            InputError: times before its beginning, more of them or more bytes than it may have, configurations
                that are none, or no room for it in this process.
        """
        end = max(seconds if math.isfinite(seconds) else 0.0, entries[-1].time if entries else 0.0)
        size = sum(len(each.data) + ENTRY for each in entries)
        if entries and entries[0].time < 0.0:
            raise InputError("recording", f"a time of {entries[0].time:g} s", "times from its beginning on")
        if end > self.bounds.seconds:
            raise InputError("recording", f"{end:g} s", f"at most {self.bounds.seconds:g} s")
        if size > self.bounds.size:
            raise too_large(self.bounds.size)
        if self._crowded(size):
            raise InputError("recording", "no room in the service for it", "another try, when others are closed")
        _track(entries, self.robot.n)  # before it counts: an error may keep what it has seen for long
        with self._lock:
            self.entries, self.size = entries, size
            self._finish(end, READ)
        return self

    def _finish(self, seconds: float, why: str) -> None:
        if self.ended is None:
            self._end, self.ended = seconds, why

    def _crowded(self, more: int = 0) -> bool:
        if self.bounds.shared is None:
            return False
        with _shared_lock:
            return sum(each.size for each in _shared) + more + STEP > self.bounds.shared

    def track(self) -> Track:
        """The arm over time."""
        return _track(list(self.entries), self.robot.n)


def too_large(most: int) -> InputError:
    """The messages of a recording take more than it may have."""
    return InputError("recording", f"more than {most / 1e6:.3g} MB in memory", f"at most {most / 1e6:.3g} MB")


def _track(entries: list[Entry], n: int) -> Track:
    topics = {each.topic for each in entries}
    spoken = {topic for page, said in SPOKEN.items() for topic in ((page,) if page in topics else said)}
    wanted = [each for each in entries if each.topic in spoken or each.topic in (MEASURED, MEASURED_GRIPPER)]
    sizes = {"q": n, "measured": n, "gripper": 1, "measured_gripper": 1}
    now = {name: np.full(size, np.nan) for name, size in sizes.items()}
    found = np.empty((len(wanted), 2 * n + 2))
    for k, each in enumerate(wanted):
        field = each.topic.rpartition("/")[2]
        try:
            value = read_json(each.data, MESSAGE)[field]
        except TextError as error:
            if error.syntax:
                raise
            raise InputError(f"recording, {each.topic}", error.value, error.expected) from None
        if field.endswith("gripper"):
            now[field][:] = _opening(value)
        else:
            now[field][:] = np.nan if value is None or len(value) != n else _values(value, n)
        found[k] = np.concatenate([*now.values()])
    t = np.array([each.time for each in wanted])
    return Track(t, found[:, :n], found[:, n : 2 * n], found[:, 2 * n], found[:, 2 * n + 1])


def _opening(given: object) -> float:
    """How far a gripper is open; NaN where it is no number from 0 to 1."""
    return float(given) if isinstance(given, int | float) and 0.0 <= given <= 1.0 else math.nan


def _values(given: object, n: int) -> Array:
    """A configuration; NaN where it is none that can be drawn."""
    values = np.array(given, dtype=float)
    if values.shape != (n,):
        raise InputError("recording", str(given), f"configurations of {n} numbers")
    return values if (np.abs(values) < LARGEST).all() else np.full(n, np.nan)
