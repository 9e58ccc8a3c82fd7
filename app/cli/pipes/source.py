"""Where configurations and targets come from: CSV, NumPy, Parquet or JSON lines, recognised by how they begin.

Lines are handed on as they arrive. A program at the other end of two pipes can therefore send one line, and read
its answer before it sends the next one.
"""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.columns import POSE, Columns
from app.cli.pipes.parquet import MAGIC, opened_columns, rows_of
from kin import InputError, Robot, Task
from kin.ik.problem import read_pose
from kin.solvers import contract
from kin.transforms import frame_from_approach, pose_from_position_wxyz

Array = NDArray[np.float64]
Form = Literal["csv", "npy", "ndjson"]
AT_ONCE = 4096  # rows of one piece
LONGEST_LINE = 1 << 20
_CHUNK = 1 << 16
_UNIT = 0.1  # by how much a quaternion's length may differ from 1: further away, one of its numbers is wrong
_NUMPY = b"\x93NUMPY"
_EXAMPLE = '{"position": [0.4, 0.1, 0.3], "wxyz": [0, 1, 0, 0]}'
_GIVEN = ("position", "wxyz", "approach", "matrix", "frame")


class Goal(NamedTuple):
    """One target.

    Attributes:
        task: what its form implies, "pose" for tables and arrays.
        T: in its frame ``(4, 4)``, as it was sent: its digits tell how closely it can be met.
        frame: name of its frame; None: that of ``--frame``.
    """

    task: Task
    T: Array
    frame: str | None = None


class Source:
    """Rows that have been opened.

    Attributes:
        form: what they are written in; "csv" for any table, also of a Parquet file.
        field: the option that names them.
    """

    def __init__(self, file: BinaryIO, field: str) -> None:
        self._file = file
        self._first = _read(file)
        while self._first and any(magic.startswith(self._first) for magic in (_NUMPY, MAGIC)):
            # A pipe may give single bytes.
            more = _read(file)
            if not more:
                break
            self._first += more
        self.field = field
        start = self._first.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]
        self.form: Form = "npy" if self._first.startswith(_NUMPY) else "ndjson" if start in (b"{", b"[") else "csv"

    def configurations(self, robot: Robot) -> Iterator[Array]:
        """Joint values ``(m, n)`` in radians (metres), piece by piece; rows of NaN where there are none.

        A table has the columns ``q1`` to ``qn`` among others, or nothing but these numbers in each row. A JSON
        line is a list of them, or an answer with `q` or `solutions`, of which the first counts.
        """
        names = [f"q{i + 1}" for i in range(robot.n)]
        if self.form == "npy":
            done = 0
            for q in self._arrays((robot.n,), f"an array of configurations (k, {robot.n})"):
                wrong = ~np.isfinite(q).all(axis=1) & ~np.isnan(q).all(axis=1)
                for i in np.flatnonzero(wrong).tolist():
                    self._q(robot, q[i].tolist(), done + i)
                done += len(q)
                yield q
        elif self.form == "csv":
            for first, rows in self._table(names):
                yield np.array([self._q(robot, row, first + i) for i, row in enumerate(rows)])
        else:
            for first, lines in self._lines():
                yield np.array(
                    [self._q(robot, self._json(each, first + i), first + i) for i, each in enumerate(lines)]
                )

    def goals(self) -> Iterator[list[Goal]]:
        """Targets, piece by piece.

        A table has the columns `POSE` among others, or nothing but these numbers in each row. A JSON line is a
        target of REST, or an answer with a `pose`.
        """
        if self.form == "npy":
            for T in self._arrays((4, 4), "an array of poses (k, 4, 4)"):
                yield [Goal("pose", each) for each in T]
        elif self.form == "csv":
            for first, rows in self._table(POSE):
                yield [Goal("pose", pose_of(row, f"{self.field}[{first + i}]")) for i, row in enumerate(rows)]
        else:
            for first, lines in self._lines():
                yield [
                    self._goal(self._json(each, first + i), f"{self.field}[{first + i}]")
                    for i, each in enumerate(lines)
                ]

    def objects(self) -> Iterator[dict[str, Any]]:
        """The objects of JSON lines, one by one."""
        for first, lines in self._lines():
            for i, line in enumerate(lines):
                found = self._json(line, first + i)
                if not isinstance(found, dict):
                    raise InputError(f"{self.field}[{first + i}]", found, "an object in braces")
                yield found

    def _q(self, robot: Robot, values: object, place: int) -> Array:
        field = f"{self.field}[{place}]"
        if isinstance(values, dict):
            solutions = values.get("solutions", [values])
            if solutions == []:
                return np.full(robot.n, np.nan)
            first = solutions[0] if isinstance(solutions, list) else None
            values = first.get("q") if isinstance(first, dict) else None
        if not isinstance(values, list) or any(isinstance(value, list) for value in values):
            raise InputError(field, values, f"a list of {robot.n} joint values")
        if len(values) == robot.n and all(value != value for value in values):
            return np.full(robot.n, np.nan)
        return robot.check_q(values, field)

    def _goal(self, data: object, field: str) -> Goal:
        if isinstance(data, dict) and isinstance(data.get("pose"), dict):
            data = data["pose"]
        if not isinstance(data, dict):
            raise InputError(field, data, f"a target such as {_EXAMPLE}")
        given = {name: value for name, value in data.items() if value is not None}
        for name in given:
            if name not in _GIVEN:
                raise InputError(f"{field}.{name}", given[name], "only the fields " + ", ".join(_GIVEN))
        frame = given.get("frame")
        if frame is not None and not isinstance(frame, str):
            raise InputError(f"{field}.frame", frame, "the name of a frame")
        if "matrix" in given:
            read_pose(given["matrix"], contract.POSE, f"{field}.matrix")
            return Goal("pose", np.array(given["matrix"], dtype=np.float64), frame)
        if "position" not in given or ("wxyz" in given and "approach" in given):
            raise InputError(field, sorted(given), "position, with wxyz, approach or neither; or matrix")
        try:
            T = pose_from_position_wxyz(given["position"], given.get("wxyz"))
            if "approach" in given:
                T[:3, :3] = frame_from_approach(given["approach"])
        except InputError as error:
            raise error.within(field) from None
        task: Task = "pose" if "wxyz" in given else "approach" if "approach" in given else "position"
        return Goal(task, T, frame)

    def _json(self, line: str, place: int) -> object:
        try:
            return json.loads(line)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{self.field}[{place}]", line, f"a line of JSON ({error})") from None

    def _table(self, names: tuple[str, ...] | list[str]) -> Iterator[tuple[int, list[list[float]]]]:
        """The named numbers of each row, and the place of the first row."""
        if self._first.startswith(MAGIC):
            yield from self._parquet(names)
            return
        columns: Columns | None = None
        done, separator = 0, ","
        for _, lines in self._lines():
            if columns is None:
                separator = Columns.separator(lines[0])
            rows = list(csv.reader(lines, delimiter=separator))
            if columns is None:
                columns = Columns.of(rows[0], names, self.field, "." if separator == "," else ",")
                rows = rows[columns.has_heading :]
            some = [columns.numbers(row, f"{self.field}[{done + i}]") for i, row in enumerate(rows)]
            if some:
                yield done, some
            done += len(some)
        if not done:
            raise InputError(self.field, "a heading alone", "at least one row")

    def _parquet(self, names: tuple[str, ...] | list[str]) -> Iterator[tuple[int, list[list[float]]]]:
        """The named numbers of each row of a Parquet file, and the place of the first row."""
        file = io.BytesIO(self._first + self._file.read())
        expected = "a Parquet file with the columns " + ", ".join(names)
        with opened_columns(file, names, self.field, expected) as table:
            if not table.metadata.num_rows:
                raise InputError(self.field, "a Parquet file without rows", "at least one row")
            for first, rows in rows_of(table, names, AT_ONCE, self.field, expected):
                yield first, rows.tolist()

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        """Lines as they arrive, without empty ones, and the place of the first."""
        rest, done, chunk = b"", 0, self._first.removeprefix(b"\xef\xbb\xbf")
        while chunk or rest:
            *whole, rest = (rest + chunk).split(b"\n") if chunk else [rest, b""]
            if len(rest) > LONGEST_LINE:
                raise InputError(self.field, f"a line of more than {LONGEST_LINE} bytes", "shorter lines")
            lines = [self._text(line, done + i) for i, line in enumerate(whole)]
            lines = [line for line in lines if line.strip()]
            for start in range(0, len(lines), AT_ONCE):
                yield done, lines[start : start + AT_ONCE]
                done += len(lines[start : start + AT_ONCE])
            chunk = _read(self._file)  # only now: the sender may wait for the answers to these lines
        if not done:
            raise InputError(self.field, "nothing", "at least one row")

    def _text(self, line: bytes, place: int) -> str:
        try:
            return line.decode().removesuffix("\r")
        except UnicodeDecodeError:
            raise InputError(f"{self.field}[{place}]", line, "text in UTF-8") from None

    def _arrays(self, shape: tuple[int, ...], expected: str) -> Iterator[Array]:
        data = self._first + self._file.read()
        try:
            found: Any = np.load(io.BytesIO(data), allow_pickle=False)
        except (ValueError, EOFError):
            raise InputError(self.field, "a broken .npy file", expected) from None
        if found.ndim != len(shape) + 1 or found.shape[1:] != shape or found.dtype.kind not in "fiu":
            raise InputError(self.field, f"an array {found.shape} of {found.dtype}", expected)
        if not len(found):
            raise InputError(self.field, f"an array {found.shape}", "at least one row")
        for start in range(0, len(found), AT_ONCE):
            yield np.ascontiguousarray(found[start : start + AT_ONCE], dtype=np.float64)


@contextmanager
def opened_source(path: str, field: str) -> Iterator[Source]:
    """A file, or standard input for "-"; raises `InputError` if it cannot be read."""
    if path == "-":
        yield Source(sys.stdin.buffer, field)
        return
    with ExitStack() as stack:
        try:
            file = stack.enter_context(Path(path).open("rb"))
        except OSError as error:
            raise InputError(field, path, f"a file that can be read ({error.strerror})") from None
        yield Source(file, field)


def pose_of(numbers: list[float], field: str) -> Array:
    """Seven numbers of a row as a pose ``(4, 4)``."""
    length = math.hypot(*numbers[3:])
    if abs(length - 1.0) > _UNIT:
        what = "is zero" if length == 0.0 else f"has the length {length:.3g}"
        expected = f"qw, qx, qy, qz of length 1: this quaternion {what}"
        raise InputError(field, numbers, expected + ("; 1, 0, 0, 0 is no rotation" if length == 0.0 else ""))
    try:
        return pose_from_position_wxyz(numbers[:3], numbers[3:])
    except InputError:
        raise InputError(field, numbers, "seven numbers: " + ", ".join(POSE)) from None


def _read(file: BinaryIO) -> bytes:
    """What is there, at least one byte; nothing at the end."""
    read: Callable[[int], bytes] = getattr(file, "read1", file.read)
    return read(_CHUNK)
