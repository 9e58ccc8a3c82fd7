"""A page of the viewer, as an object: assign what it should show, read what it shows."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

import kin
from app.live.client.connection import Connection, Message, RefusedError
from app.live.client.drawing import Drawing
from app.live.recording import Bounds, Recording, read, save
from kin import InputError, KinematicsError, Obstacle, Robot
from kin.motion import Motion, Program
from kin.motion.program import checked_opening
from kin.motors.joints import moving_motors, of_moving
from kin.transforms import Array, pose_from_position_wxyz

VALUES: Final = ("q", "gripper", "target", "result", "contacts", "program")
RATE: Final = 30.0  # news a second
TIMEOUT: Final = 10.0  # s for an answer
SLACK: Final = 1e-6  # rad or m beyond a limit
KEPT: Final = 256  # events of a kind that cannot be replaced which wait for a slow reader


@dataclass(frozen=True)
class Event:
    """Something that has happened in the page.

    Attributes:
        kind: ``"q"``, ``"gripper"``, ``"target"``, ``"result"``, ``"contacts"``, ``"program"``, ``"robot"``;
            ``"problem"`` for a value that was refused later; ``"pressed"``; ``"disconnected"``, ``"connected"``.
        value: as the property of that name has it; of a problem, the `RefusedError`; of a press, the name of the
            button.
    """

    kind: str
    value: Any = None


class Page:
    """A page that this program is connected to. Every method may be called by any thread.

    Use it as a context manager, or call `close`. After a lost connection it comes back by itself, and shows again
    what it has drawn; once the page has ended the connection, every use raises `KinematicsError` with the reason.

    Args:
        address, code, name, token: as for `kin.connect`.
        rate: how often a second the page is to report what it shows, at most.
        drives: see there.
    """

    def __init__(
        self,
        address: str,
        code: str,
        name: str | None = None,
        token: str | None = None,
        rate: float = RATE,
        drives: str | None = None,
    ) -> None:
        self._lock = threading.Condition()
        self._values: dict[str, Any] = {}
        self._sent: int | None = None  # number of the newest configuration that is not answered
        self._refused: RefusedError | None = None
        self._measured: Array | None = None
        self._measured_gripper: float | None = None
        self._readings: Array | None = None
        self._drives: str | None = None
        self._announced: dict[str, Any] | None = None
        self._rate = rate
        self._readers: list[_Reader] = []
        self._recordings: list[Recording] = []
        self._robot: Robot
        self.draw = Drawing(self._draw)
        self._name = name or Path(sys.argv[0] or "").name or "Python"
        self._connection = Connection(address, code, self._name, token, self._take, self._beginning, self._note)
        with self._lock:
            if not self._lock.wait_for(lambda: "q" in self._values or bool(self._connection.ended), TIMEOUT):
                self._connection.close()
                raise KinematicsError("the page does not say what it shows")
        if drives is not None:
            try:
                self.drives = drives
            except KinematicsError:
                self._connection.close()
                raise

    # What it shows

    @property
    def robot(self) -> Robot:
        """The arm on show. Assign the id of one of the service's, or an arm, to show another one."""
        self._check()
        return self._robot

    @robot.setter
    def robot(self, robot: str | Robot) -> None:
        sent = robot if isinstance(robot, str) else kin.robot_to_dict(robot)
        if isinstance(robot, Robot) and kin.builtin_robots().get(robot.id) == robot:
            sent = robot.id
        self._ask(robot=sent)

    @property
    def q(self) -> Array:
        """The configuration ``(n,)``, radians (metres): what was assigned last, or done in the page since.

        Assigning returns at once; of values that follow each other faster than 100 a second only the newest are
        sent. Raises `kin.InputError` for a value that does not fit the arm or its limits.
        """
        self._check()
        with self._lock:
            return np.array(self._values["q"])

    @q.setter
    def q(self, value: ArrayLike) -> None:
        robot = self._robot
        q = robot.check_q(value)
        inside = (q >= robot.lower - SLACK) & (q <= robot.upper + SLACK)
        if not inside.all():
            i = int(np.argmin(inside))
            low, high = robot.lower[i], robot.upper[i]
            raise InputError(f"q[{i}]", float(q[i]), f"{low:.6g} to {high:.6g}, the limits of the joint")
        with self._lock:
            refused, self._refused = self._refused, None
            if refused is None:
                self._sent = self._connection.stream(q=robot.clip(q).tolist())
                self._values["q"] = robot.clip(q)
        if refused is not None:
            raise refused

    @property
    def gripper(self) -> float | None:
        """How far the gripper is open, a part of its range: 0 is closed, 1 open. None: the arm has none.

        It is what was assigned last, or done in the page since. Assigning returns at once, as for `q`.
        """
        found = self._value("gripper")
        return None if found is None else float(found)

    @gripper.setter
    def gripper(self, value: float) -> None:
        opening = self._checked_opening("gripper", value)
        with self._lock:
            self._connection.stream(gripper=opening)
            self._values["gripper"] = opening

    def _checked_opening(self, field: str, value: float) -> float:
        """How far a gripper is open; raises `kin.InputError` for none, and while the arm on show has none."""
        opening = checked_opening(field, value)
        if self.gripper is None:
            raise InputError(field, value, f"an arm with a gripper that opens; the page shows {self._robot.name}")
        return opening

    @property
    def measured(self) -> Array | None:
        """Where a real arm is ``(n,)``: a ghost beside the one that is commanded. None: there is none."""
        return None if self._measured is None else self._measured.copy()

    @measured.setter
    def measured(self, value: ArrayLike | None) -> None:
        q = None if value is None else self._robot.check_q(value, "measured")
        self._connection.stream(measured=None if q is None else q.tolist())
        self._measured = q

    @property
    def measured_gripper(self) -> float | None:
        """How far the gripper of a real arm is open, from 0 (closed) to 1 (open). None: it is not known."""
        return self._measured_gripper

    @measured_gripper.setter
    def measured_gripper(self, value: float | None) -> None:
        opening = None if value is None else self._checked_opening("measured_gripper", value)
        self._connection.stream(measured_gripper=opening)
        self._measured_gripper = opening

    @property
    def readings(self) -> Array | None:
        """What the motors of a real arm read ``(m,)``, in their order and units: see `kin.motors.q_from_readings`.

        Those of all motors may be assigned, too: what moves no joint, such as a gripper, is left out.

        The page shows the arm as `measured`, and *Match motors* takes them. None: they are not known.
        """
        return None if self._readings is None else self._readings.copy()

    @readings.setter
    def readings(self, value: ArrayLike | None) -> None:
        moving_motors(self._robot)
        read = None if value is None else of_moving(self._robot.motors, value)
        self._connection.stream(readings=None if read is None else read.tolist())
        self._readings = read

    @property
    def drives(self) -> str | None:
        """What this program moves, such as ``"SO-101 at /dev/ttyACM0"``; None: nothing.

        Assigning returns when the page has its red frame with this name, or has it no more. The frame goes with
        the connection, and comes back with it.
        """
        return self._drives

    @drives.setter
    def drives(self, name: str | None) -> None:
        self._ask(drives=name)
        self._drives = name

    @property
    def target(self) -> Array | None:
        """The pose ``(4, 4)`` that the arm is asked for; None while it follows the tool.

        Assign a pose ``(4, 4)``, or a point ``(3,)`` that keeps the orientation; it returns when `q` and `result`
        are those of this target.
        """
        self._check()
        with self._lock:
            return self._values.get("target")

    @target.setter
    def target(self, value: ArrayLike) -> None:
        given = np.asarray(value, dtype=float)
        if given.shape not in ((3,), (4, 4)) or not np.isfinite(given).all():
            raise InputError("target", value, "a pose (4, 4) or a point (3,) of finite numbers")
        self._ask(target={"position" if given.ndim == 1 else "matrix": given.tolist()})

    @property
    def result(self) -> dict[str, Any] | None:
        """The last answer of inverse kinematics, as REST gives it; None while a question asks for it."""
        found = self._value("result")
        return None if found is None else dict(found)

    @property
    def contacts(self) -> list[dict[str, Any]]:
        """What the arm touches, the deepest first, as REST gives it."""
        return list(self._value("contacts") or ())

    @property
    def program(self) -> dict[str, Any]:
        """The program of the page: how many ``items``, ``playing``, ``time``, ``duration``, ``complete``."""
        return dict(self._value("program") or {})

    @property
    def connected(self) -> bool:
        """Whether there is a connection now."""
        return self._connection.connected and not self._connection.ended

    # What it does

    def play(self, motion: Motion | Program | Mapping[str, Any] | None = None) -> None:
        """Show a program in the tab *Program* and play it; None: the one that is there."""
        if isinstance(motion, Motion):
            motion = motion.program
        if isinstance(motion, Program):
            motion = kin.motion.program_to_dict(motion)
        self._ask(**({} if motion is None else {"program": motion}), play=True)

    def stop(self) -> None:
        """Stop the program that is played."""
        self._ask(play=False)

    def announce(self, words: str | None, buttons: Sequence[Mapping[str, Any]] = (), state: str = "ready") -> None:
        """Say in the status card of the page how this program does, and offer buttons there; None: no longer.

        A press by its visitor is an event: ``pressed``, with the name of the button. Returns when the page shows
        them; they come back with the connection.

        Args:
            words: one sentence.
            buttons: at most four, each ``{"name": "enable", "label": "Enable"}``; with ``"confirm"``, a sentence
                with which the page asks first; with ``"stops": True``, one that can be pressed whatever else is
                withheld.
            state: ``"ready"``, ``"enabled"``, ``"stopped"`` or ``"fault"``.
        """
        offered = [dict(each) for each in buttons]
        said = None if words is None else {"words": words, "state": state, "buttons": offered}
        self._ask(announce=said)
        self._announced = said

    def place(self, obstacles: Sequence[Obstacle | Mapping[str, Any]]) -> None:
        """Place these obstacles, in place of all that there are."""
        self._ask(obstacles=[_plain(each) for each in obstacles])

    @contextlib.contextmanager
    def record(
        self, path: str | Path | None = None, seconds: float = 3600.0, megabytes: float = 256.0
    ) -> Iterator[Recording]:
        """Record what this program sends and hears meanwhile: ``with page.record("run.mcap") as recording: …``.

        The recording has ``track()``: times, the configurations that were commanded and measured, and how far the
        gripper was open. It ends by itself when another arm is shown, or it has reached these bounds;
        ``recording.ended`` says why.

        Args:
            path: where it is written at the end, ``.mcap`` or ``.csv``; None: nowhere.
        """
        if path is not None and Path(path).suffix.lower() not in (".mcap", ".csv"):
            raise InputError("path", str(path), "a name that ends with .mcap or .csv")
        self._check()
        with self._lock:
            recording = Recording(self._robot, self._name, Bounds(seconds, int(megabytes * 1e6)))
            recording.add("/heard/q", {"q": self._values["q"].tolist()})
            if (opening := self._values.get("gripper")) is not None:
                recording.add("/heard/gripper", {"gripper": opening})
            self._recordings.append(recording)
        try:
            yield recording
        finally:
            recording.end()
            with self._lock:
                self._recordings.remove(recording)
            if path is not None:
                save(recording, path)

    def replay(self, recording: Recording | str | Path, rate: float = 1.0) -> None:
        """Show a recording, or that of an MCAP or CSV file, in the page, that many times as fast; ends with it.

        Raises:
            KinematicsError: it is no recording, or of an arm with other joints than that on show.
        """
        if not isinstance(recording, Recording):
            recording = read(Path(recording).read_bytes(), self.robot)
        if recording.robot.n != self._robot.n or not (recording.robot.revolute == self._robot.revolute).all():
            raise InputError("recording", f"one of the {recording.robot.name}", f"one of the {self._robot.name}")
        if not 0.01 <= rate <= 100.0:
            raise InputError("rate", rate, "a number from 0.01 to 100")
        track, began = recording.track(), time.monotonic()
        rows = zip(track.t, track.commanded, track.measured, track.opening, track.measured_opening, strict=True)
        for t, q, measured, opening, seen in rows:
            time.sleep(max(0.0, began + t / rate - time.monotonic()))
            if not np.isnan(q).any():
                self.q = self._robot.clip(q)
            if self.gripper is not None:
                if not np.isnan(opening):
                    self.gripper = opening
                self.measured_gripper = None if np.isnan(seen) else seen
            self.measured = None if np.isnan(measured).any() else measured

    def events(self) -> Iterator[Event]:
        """What happens in the page from now on; ends when the page is closed.

        A slow reader gets the newest value of each kind.
        """
        reader = _Reader()
        with self._lock:
            self._readers.append(reader)
        return self._read(reader)

    def _read(self, reader: _Reader) -> Iterator[Event]:
        try:
            while True:
                with self._lock:
                    self._lock.wait_for(lambda: bool(reader.waiting) or bool(self._connection.ended))
                    if not reader.waiting:
                        return
                    event = reader.waiting.popleft()
                yield event
        finally:
            with self._lock:
                self._readers.remove(reader)

    def close(self) -> None:
        """End the connection. What the program has drawn leaves the page."""
        self._connection.close()
        with self._lock:
            self._lock.notify_all()

    def __enter__(self) -> Page:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "connected" if self.connected else self._connection.ended or "not connected"
        return f"<Page with {self._robot.name}, {state}>"

    # The connection

    def _check(self) -> None:
        if self._connection.ended:
            raise KinematicsError(f"the connection to the page has ended: {self._connection.ended}")

    def _value(self, name: str) -> Any:
        self._check()
        with self._lock:
            return self._values.get(name)

    def _ask(self, **fields: Any) -> None:
        with self._lock:
            self._sent = None
        self._connection.request(TIMEOUT, **fields)

    def _draw(self, **fields: Any) -> None:
        self._connection.request(TIMEOUT, **fields)

    def _beginning(self) -> list[Message]:
        """What is sent after each connection."""
        found: list[Message] = [{"subscribe": {"values": list(VALUES), "rate": self._rate}}]
        if self._drives is not None:
            found.append({"drives": self._drives})
        if self._announced is not None:
            found.append({"announce": self._announced})
        if self._measured is not None:
            found.append({"measured": self._measured.tolist()})
        if self._measured_gripper is not None:
            found.append({"measured_gripper": self._measured_gripper})
        return found + [{"draw": {name: drawn}} for name, drawn in self.draw.shown.items()]

    def _note(self, message: Message) -> None:
        """Record a message that was sent."""
        for recording in list(self._recordings):
            recording.take("sent", message)

    def _take(self, message: Message) -> None:
        """Take a message of the page; called by the thread that receives."""
        kind = message["type"]
        for recording in list(self._recordings):
            recording.take("heard", {name: value for name, value in message.items() if name != "asked"})
        with self._lock:
            if kind == "welcome":
                self._robot = robot_of(message["robot"])
                self._tell(Event("connected"))
            elif kind == "news":
                for name, value in message.items():
                    if name != "type":
                        self._hear(name, value)
            elif kind in ("done", "problem") and message.get("id") == self._sent:
                self._sent = None
            if kind == "problem" and not message.get("asked"):
                self._refused = RefusedError(message["problem"])
                self._tell(Event("problem", self._refused))
            elif kind == "pressed":
                self._tell(Event("pressed", message["button"]))
            elif kind == "disconnected":
                self._sent = None
                self._tell(Event("disconnected"))
            self._lock.notify_all()

    def _hear(self, name: str, value: Any) -> None:
        if name == "robot":
            self._robot = value = robot_of(value)
            for recording in self._recordings:
                recording.end("another arm was shown")
            self._measured = self._readings = self._measured_gripper = None
            self._sent = None
        elif name == "q":
            if self._sent is not None and "q" in self._values:
                return  # a newer one is on its way there
            self._values["q"] = value = np.array(value)
        else:
            if name == "target" and value is not None:
                value = pose_from_position_wxyz(value["position"], value["wxyz"])
            self._values[name] = value
        self._tell(Event(name, value))

    def _tell(self, event: Event) -> None:
        for reader in self._readers:
            reader.add(event)


class _Reader:
    """The events that wait for one reader."""

    def __init__(self) -> None:
        self.waiting: deque[Event] = deque(maxlen=KEPT)

    def add(self, event: Event) -> None:
        if event.kind in VALUES:
            older = next((each for each in self.waiting if each.kind == event.kind), None)
            if older is not None:
                self.waiting.remove(older)
        self.waiting.append(event)


def robot_of(described: Mapping[str, Any]) -> Robot:
    """The arm that a page describes."""
    known = kin.builtin_robots().get(described["id"])
    if known is not None and kin.robot_to_dict(known) == described["description"]:
        return known
    return kin.robot_from_dict(described["description"])


def _plain(obstacle: Obstacle | Mapping[str, Any]) -> dict[str, Any]:
    if not isinstance(obstacle, Obstacle):
        return dict(obstacle)
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in asdict(obstacle).items()
        if value is not None
    }
