"""One run of *Calibrate by touching*: what is touched, the postures asked for, and what was read in them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

import kin
from app.viewer.declared.fields import numbers, ordinal, record, rows
from kin import InputError, Robot
from kin.calibration import Calibration, TouchBoard, TouchFixture, TouchPlan, calibrate, touch_postures
from kin.calibration.fixtures import PAPER
from kin.calibration.model import Model
from kin.comparison import Comparison
from kin.ik.messages.values import listed
from kin.transforms import Array
from kin.typed import ReadError, elements, read_element
from kin.units import Units

LENGTHS = (0.01, 2.0)  # m: of a bar
MOST, BOARDS = 60, 6  # touches and places of one run: they are in the link of the page
COUNT, MORE = 20, 5  # touches that are asked for at first, and besides
FAR = math.radians(20.0), 0.1  # of a joint value from the one that was asked: rad, m
_FARTHEST = 1e3  # m, rad: of any number in a link


class Touched(NamedTuple):
    """What is touched: a "sheet", a "bar" or a "pin", at so many places, and perhaps the table."""

    kind: str
    paper: str
    length: float
    places: int
    plane: bool

    @property
    def fixture(self) -> TouchFixture:
        """The same for the core."""
        return _fixture(self)

    def name(self, socket: int) -> str:
        """What is touched there, as it is called in the page."""
        return "table" if socket < 0 else f"{'cross' if self.kind == 'sheet' else 'socket'} {socket + 1}"


@lru_cache(maxsize=64)
def _fixture(what: Touched) -> TouchFixture:
    boards = {"sheet": lambda: TouchBoard.sheet(what.paper), "bar": lambda: TouchBoard.bar(what.length)}
    board = boards.get(what.kind, TouchBoard.pin)()
    return TouchFixture([board] * what.places, what.plane)


class Touch(NamedTuple):
    """A touch that was made: the index of its posture, what was touched, and what the joints read."""

    at: int
    socket: int
    q: tuple[float, ...]


class Found(NamedTuple):
    """What touches have shown, and how the arm found compares with its nominal table."""

    touches: tuple[Touch, ...]
    calibration: Calibration
    comparison: Comparison


@dataclass(frozen=True, eq=False)
class Run:
    """See the module.

    Attributes:
        robot: the nominal arm.
        what: is touched.
        q: ``(k, n)`` the postures that are asked for.
        sockets: what is touched in each, as `kin.calibration.TouchPlan` has it.
        places: ``(b, 4, 4)`` where the boards are to lie.
        expected: how far the tip is expected to be off, in metres: before, after, bound, by readings alone.
        read: of each posture, None until it is touched.
        at: index of the posture on show.
        course: what was expected after so many touches: their number, the error and its bound.
    """

    robot: Robot
    what: Touched
    q: Array
    sockets: tuple[int, ...]
    places: Array
    expected: tuple[float, ...]
    read: tuple[tuple[float, ...] | None, ...]
    at: int = 0
    course: tuple[tuple[float, ...], ...] = ()

    @property
    def spots(self) -> Array:
        """Where the sockets are to be ``(m, 3)``."""
        fixture = self.what.fixture
        T = self.places[fixture.owner]
        return np.asarray(np.einsum("mij,mj->mi", T[:, :3, :3], fixture.local) + T[:, :3, 3])

    @property
    def touches(self) -> tuple[Touch, ...]:
        """Those that were made."""
        made = zip(self.sockets, self.read, strict=True)
        return tuple(Touch(i, socket, q) for i, (socket, q) in enumerate(made) if q is not None)

    def of(self, robot: Robot) -> Run | None:
        """The same for this arm; None: it has another table. Names, limits and speeds do not count."""
        return replace(self, robot=robot) if _table(self.robot) == _table(robot) else None

    def with_read(self, q: tuple[float, ...] | None) -> Run:
        """The same with this reading in the posture on show; None: it was not touched."""
        read = (*self.read[: self.at], q, *self.read[self.at + 1 :])
        count = sum(each is not None for each in read)
        return replace(self, read=read, course=tuple(each for each in self.course if each[0] < count))

    def to(self, at: int) -> Run:
        """The same at another posture."""
        return replace(self, at=min(max(at, 0), len(self.q) - 1))

    def found(self, found: Found) -> Run:
        """The same with what so many touches have brought."""
        count, e = len(found.touches), found.calibration.expected
        earlier = tuple(each for each in self.course if each[0] < count)
        return replace(self, course=(*earlier, (float(count), e.after, e.bound)))

    def planned(self, plan: TouchPlan) -> Run:
        """The same with further postures. They are met by hand: a few digits will do."""
        e = plan.expected
        return replace(
            self,
            q=np.vstack([self.q, plan.q.round(4)]),
            sockets=(*self.sockets, *plan.sockets.tolist()),
            places=plan.places.round(6),
            expected=tuple(round(x, 6) for x in (e.before, e.after, e.bound, e.readings)),
            read=self.read + (None,) * len(plan.q),
            at=len(self.q),
        )


def _table(robot: Robot) -> object:
    """What decides where the tip is: touches are of arms that have it in common."""
    rows = [(row.theta, row.d, row.a, row.alpha, row.kind) for row in robot.rows]
    return robot.convention, rows, robot.expansion.tolist(), robot.base, robot.tool


def planned(robot: Robot, what: Touched, count: int, run: Run | None, cancel: Callable[[], None]) -> Run:
    """A run at its first posture, or one with so many more; raises `InputError`: what cannot be touched."""
    places = None if run is None else list(run.places)
    touches = () if run is None else run.touches
    done = ([each.q for each in touches], [each.socket for each in touches]) if touches else None
    plan = touch_postures(robot, what.fixture, count, places=places, done=done, cancel=cancel)
    run = Run(robot, what, np.empty((0, robot.n)), (), plan.places, (), ()) if run is None else run
    return run.planned(plan)


def solved(robot: Robot, what: Touched, touches: tuple[Touch, ...], cancel: Callable[[], None]) -> Found:
    """What touches have shown; raises `InputError`: they are in one posture."""
    q, sockets = [each.q for each in touches], [each.socket for each in touches]
    try:
        found = calibrate(robot, q, sockets, what.fixture, cancel=cancel)
    except InputError as error:
        raise error.renamed("touches") from None
    return Found(touches, found, kin.compare(robot, found.robot, explain=False))


# What is typed


def read_joints(text: str, robot: Robot, what: Touched, units: Units) -> tuple[float, ...]:
    """Joint values as they are typed or pasted, in radians (metres); raises `InputError` naming the joint."""
    names = listed([joint.name for joint in robot.joints])
    valid = f"{robot.n} numbers with spaces between: {names}"
    try:
        words = elements(text)
        if len(words) != robot.n:
            raise InputError("joint values", text, valid)
        of = [units.of(bool(turns)) for turns in robot.revolute]
        values = [read_element(word, unit) for word, unit in zip(words, of, strict=True)]
    except ReadError as error:
        raise InputError("joint values", text, f"{valid}: {error.reason}") from None
    return readable(tuple(values), robot, what, units, not units.degrees)


def readable(q: tuple[float, ...], robot: Robot, what: Touched, units: Units, radians: bool) -> tuple[float, ...]:
    """The same joint values, if joints can have them; raises `InputError` naming the joint.

    Args:
        radians: whether they were given in radians, and so may be degrees by mistake.
    """
    least, most = Model.of(robot, what.fixture).readable
    for joint, turns, value, low, high in zip(robot.joints, robot.revolute, q, least, most, strict=True):
        if not low <= value <= high:
            unit = units.of(bool(turns))
            valid = f"{unit.text(low)} to {unit.text(high)}"
            if radians and turns and abs(value) > 2.0 * math.pi:
                valid += "; are these degrees? Here they are radians"
            raise InputError(joint.name, unit.text(value), valid)
    return q


def doubt(robot: Robot, asked: Array, read: tuple[float, ...]) -> str:
    """What to say of a touch that is far from the posture that was asked; "" if it is near."""
    q, most = np.array(read), np.where(robot.revolute, *FAR)
    far = _apart(robot, asked, q) > most
    if not far.any():
        return ""
    tries = {"Are these radians?": np.where(robot.revolute, np.degrees(q), q)}
    tries["Does it count backwards?"] = np.where(far, -q, q)
    if far.sum() == 2:
        i, j = np.flatnonzero(far).tolist()
        exchanged = q.copy()
        exchanged[[i, j]] = q[[j, i]]
        tries["Are the two exchanged?"] = exchanged
    likely = [words for words, tried in tries.items() if (_apart(robot, asked, tried) <= most).all()]
    names = listed([joint.name for joint, away in zip(robot.joints, far, strict=True) if away])
    return " ".join([f"{names[0].upper()}{names[1:]} is far from the posture that was asked.", *likely[:1]])


def _apart(robot: Robot, one: Array, other: Array) -> Array:
    """How far joint values ``(n,)`` are apart; whole turns do not count."""
    gap = np.abs(one - other)
    return np.where(robot.revolute, np.abs((gap + math.pi) % (2.0 * math.pi) - math.pi), gap)


# In links


def to_json(run: Run | None) -> object:
    """The entry of a link."""
    if run is None:
        return None
    return {
        "what": list(run.what),
        "q": run.q.tolist(),
        "sockets": list(run.sockets),
        "places": [T[:3].ravel().tolist() for T in run.places],
        "expected": list(run.expected),
        "read": [None if q is None else [round(value, 7) for value in q] for q in run.read],
        "at": run.at,
        "course": [list(each) for each in run.course],
    }


def from_json(entry: object, robot: Robot) -> Run | None:
    """The run of an entry; raises `InputError`."""
    if entry is None:
        return None
    data: Any = record("run", entry)
    what = _touched(data.get("what"))
    q = rows("q", data.get("q"), MOST)
    read = rows("read", data.get("read"), MOST)
    sockets = numbers("sockets", data.get("sockets"), len(q))
    places = [numbers("places", each, 12, _FARTHEST) for each in rows("places", data.get("places"), BOARDS)]
    at = ordinal("at", data.get("at"))
    if len(read) != len(q) or len(places) != what.places or at is None or at >= len(q):
        raise InputError("run", entry, "postures, and what was read in each")
    return Run(
        robot,
        what,
        np.array([numbers("q", each, robot.n, _FARTHEST) for each in q]),
        tuple(what.fixture.check_sockets(sockets, len(q)).tolist()),
        np.array([[*np.reshape(each, (3, 4)).tolist(), [0.0, 0.0, 0.0, 1.0]] for each in places]),
        numbers("expected", data.get("expected"), 4, _FARTHEST),
        tuple(None if each is None else numbers("read", each, robot.n, _FARTHEST) for each in read),
        at,
        tuple(numbers("course", each, 3, _FARTHEST) for each in rows("course", data.get("course"), MOST)),
    )


def _touched(entry: object) -> Touched:
    """What is touched, in a link."""
    match entry:
        case ["sheet" | "bar" | "pin" as kind, str(paper), float() | int() as length, int(places), bool(plane)]:
            if paper in PAPER and LENGTHS[0] <= length <= LENGTHS[1] and 1 <= places <= BOARDS:
                return Touched(kind, paper, float(length), places, plane)
    raise InputError("what", entry, "a sheet, a bar or a pin with its size, places, and whether the table too")
