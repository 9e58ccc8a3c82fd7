"""Where configurations and targets come from: CSV, NumPy, Parquet or JSON lines, recognised by how they begin.

Lines are handed on as they arrive. A program at the other end of two pipes can therefore send one line, and read
its answer before it sends the next one.
"""

from __future__ import annotations

import codecs
import csv
import io
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import dropwhile
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.columns import Columns
from app.cli.pipes.parquet import MAGIC, opened_columns, rows_of
from app.cli.pipes.poses import NOTHING, Goal, PoseTable, Wrong
from kin import InputError, Robot
from kin.ik import Task
from kin.ik.problem import read_pose
from kin.joint import PendantMap
from kin.poses.fields import FIELDS, ORIENTATIONS, orientation, text_target, whole_matrix
from kin.solvers import contract
from kin.transforms import frame_from_approach, pose_from_position_wxyz

Array = NDArray[np.float64]
Form = Literal["csv", "npy", "ndjson"]
_Reads = list[tuple[str, Callable[[], list[float]]]]  # the place of each row, and what reads its numbers
AT_ONCE = 4096  # rows of one piece
LONGEST_LINE = 1 << 20
_CHUNK = 1 << 16
_NUMPY = b"\x93NUMPY"
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)  # as spreadsheets write “Unicode text”
_EXAMPLE = '{"position": [0.4, 0.1, 0.3], "wxyz": [0, 1, 0, 0]}'


class Source:
    """Rows that have been opened.

    Attributes:
        form: what they are written in; "csv" for any table, also of a Parquet file.
        field: the option that names them.

    Of a file with a path, arrays and Parquet are read piece by piece.
    """

    def __init__(self, file: BinaryIO, field: str, path: Path | None = None) -> None:
        self._file, self._path = file, path
        self._first = _read(file)
        while self._first and any(magic.startswith(self._first) for magic in (_NUMPY, MAGIC)):
            # A pipe may give single bytes.
            more = _read(file)
            if not more:
                break
            self._first += more
        if self._first.startswith(_UTF16):
            text = (self._first + self._file.read()).decode("utf-16", "replace")
            self._first, self._file = text.encode(), io.BytesIO()
        self.field = field
        start = self._first.removeprefix(codecs.BOM_UTF8).lstrip()[:1]
        self.form: Form = "npy" if self._first.startswith(_NUMPY) else "ndjson" if start in (b"{", b"[") else "csv"

    def configurations(
        self, robot: Robot, shown: PendantMap | None = None
    ) -> Iterator[tuple[Array, dict[int, Wrong]]]:
        """Joint values ``(m, n)`` in radians (metres), piece by piece; rows of NaN where there are none.

        With each piece comes what is wrong with rows of it, by their index.

        A table has the columns ``q1`` to ``qn`` among others, or nothing but these numbers in each row. A JSON
        line is a list of them, or an answer with `q` or `solutions`, of which the first counts.

        Args:
            shown: of values as the pendant shows them. Answers have joint values all the same.
        """
        names = [f"q{i + 1}" for i in range(robot.n)]
        if self.form == "npy":
            done = 0
            for q in self._arrays((robot.n,), f"an array of configurations (k, {robot.n})"):
                odd = np.flatnonzero(~np.isfinite(q).all(axis=1) & ~np.isnan(q).all(axis=1)).tolist()
                _, wrong = self._rows(robot, [(f"{self.field}[{done + i}]", q[i].tolist) for i in odd], shown)
                done += len(q)
                yield q if shown is None else shown.joint_values(q), {odd[k]: each for k, each in wrong.items()}
        elif self.form == "csv":
            for rows in self._table(names):
                yield self._rows(robot, rows, shown)
        else:
            for lines in self._lines():
                yield self._rows(
                    robot, [(place, partial(self._json, line, place)) for place, line in lines], shown
                )

    def goals(self, table: PoseTable, maker: str = "", first: int = 0) -> Iterator[list[Callable[[], Goal]]]:
        """What reads each target, piece by piece; a row that is none says what is wrong with it.

        A table has the columns of `table` among others, or nothing but these numbers in each row. A JSON line is a
        target of REST, or an answer with a `pose`.

        Args:
            maker: of the arm, which decides what a `text` with letters of several makers means.
            first: how many rows of a table or an array are left out.
        """
        if self.form == "npy":
            for poses in self._arrays((4, 4), "an array of poses (k, 4, 4)", first):
                yield [partial(Goal, f"{self.field}[{first + i}]", "pose", T) for i, T in enumerate(poses)]
                first += len(poses)
        elif self.form == "csv":
            for rows in self._table(table.names, first):
                yield [partial(_goal, place, partial(_row, table, place, read)) for place, read in rows]
        else:
            for lines in self._lines():
                yield [partial(_goal, place, partial(self._line, place, line, maker)) for place, line in lines]

    def numbers(self, names: Sequence[str]) -> list[tuple[str, list[float]]]:
        """The rows of a table with these columns among others, or nothing but these numbers; each with its place.

        Raises:
            InputError: no table, or a row without numbers in these columns.
        """
        if self.form != "csv":
            raise InputError(
                self.field, self.form, "a table (CSV or Parquet) with the columns " + ", ".join(names)
            )
        return [(place, read()) for rows in self._table(names) for place, read in rows]

    def objects(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """The objects of JSON lines, one by one, each with its place."""
        for lines in self._lines():
            for place, line in lines:
                found = self._json(line, place)
                if not isinstance(found, dict):
                    raise InputError(place, found, "an object in braces")
                yield place, found

    def _rows(
        self, robot: Robot, rows: Sequence[tuple[str, Callable[[], object]]], shown: PendantMap | None
    ) -> tuple[Array, dict[int, Wrong]]:
        """The configurations of rows, each with its place and what reads it."""
        q, wrong = np.full((len(rows), robot.n), np.nan), dict[int, Wrong]()
        for i, (place, read) in enumerate(rows):
            try:
                q[i] = self._q(robot, read(), place, shown)
            except InputError as error:
                wrong[i] = Wrong.of(error)
        return q, wrong

    def _q(self, robot: Robot, values: object, field: str, shown: PendantMap | None) -> Array:
        answered = isinstance(values, dict)
        if isinstance(values, dict):
            solutions = values.get("solutions", [values])
            if solutions == []:
                return np.full(robot.n, np.nan)
            first = solutions[0] if isinstance(solutions, list) else None
            values = first.get("q") if isinstance(first, dict) else None
        if not isinstance(values, list) or any(isinstance(value, list) for value in values):
            raise InputError(field, values, f"a list of {robot.n} joint values")
        if len(values) != robot.n:
            raise InputError(field, values, f"a list of {robot.n} joint values")
        if all(value != value for value in values):
            return np.full(robot.n, np.nan)
        q = robot.check_q(values, field)
        return q if answered or shown is None else shown.joint_values(q)

    def _line(self, place: str, line: str, maker: str) -> Goal:
        return self._goal(self._json(line, place), place, maker)

    def _goal(self, data: object, field: str, maker: str) -> Goal:
        if isinstance(data, dict) and isinstance(data.get("pose"), dict):
            data = data["pose"]
        if not isinstance(data, dict):
            raise InputError(field, data, f"a target such as {_EXAMPLE}")
        given = {name: value for name, value in data.items() if value is not None}
        for name in given:
            if name not in FIELDS:
                raise InputError(f"{field}.{name}", given[name], "only the fields " + ", ".join(FIELDS))
        frame = given.pop("frame", None)
        if frame is not None and not isinstance(frame, str):
            raise InputError(f"{field}.frame", frame, "the name of a frame")
        if "matrix" in given:
            rows = whole_matrix(given["matrix"])
            read_pose(rows, contract.POSE, f"{field}.matrix")
            return Goal(field, "pose", np.array(rows, dtype=np.float64), frame)
        if "text" in given and not set(given) - {"text", "form"}:
            return Goal(field, *text_target(given["text"], given.get("form"), field, maker), frame)
        turned = [name for name in (*ORIENTATIONS, "approach") if name in given]
        if "position" not in given or len(given) > 1 + len(turned) or len(turned) > 1:
            expected = f"position, with one of {', '.join(ORIENTATIONS)}, approach or none; or matrix; or text"
            raise InputError(field, sorted(given), expected)
        try:
            T = pose_from_position_wxyz(given["position"])
            if turned:
                name, values = turned[0], given[turned[0]]
                T[:3, :3] = frame_from_approach(values) if name == "approach" else orientation(name, values)
        except InputError as error:
            raise error.within(field) from None
        task: Task = "position" if not turned else "approach" if turned == ["approach"] else "pose"
        return Goal(field, task, T, frame)

    def _json(self, line: str, field: str) -> object:
        try:
            return json.loads(line)
        except (ValueError, RecursionError) as error:
            raise InputError(field, line, f"a line of JSON ({error})") from None

    def _table(self, names: Sequence[str], first: int = 0) -> Iterator[_Reads]:
        """The rows from the first one on; what reads the named numbers of one may raise `InputError`."""
        if self._first.startswith(MAGIC):
            for start, rows in self._parquet(names, first):
                yield [(f"{self.field}[{start + i}]", partial(list, row)) for i, row in enumerate(rows)]
            return
        columns: Columns | None = None
        done, separator = 0, ","
        for lines in self._lines():
            if columns is None:
                lines = list(dropwhile(lambda line: Columns.is_preface(line[1]), lines))
                if not lines:
                    continue
                separator = Columns.separator(lines[0][1])
            cells = list(self._cells(lines, separator))
            if columns is None:
                columns = Columns.of(cells[0], names, self.field, "." if separator == "," else ",")
                lines, cells = lines[columns.has_heading :], cells[columns.has_heading :]
            pairs = zip(lines, cells, strict=True)
            some: _Reads = [(place, partial(columns.numbers, row, place)) for (place, _), row in pairs]
            if len(some) > first - done:
                yield some[max(0, first - done) :]
            done += len(some)
        if not done:
            raise InputError(self.field, "a heading alone", "at least one row")

    def _cells(self, lines: list[tuple[str, str]], separator: str) -> Iterator[list[str]]:
        """The cells of each line."""
        for place, line in lines:
            try:
                yield next(csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True))
            except csv.Error as error:
                raise InputError(place, str(error), "a row of a table") from None

    def _parquet(self, names: Sequence[str], first: int) -> Iterator[tuple[int, list[list[float]]]]:
        """The named numbers of each row of a Parquet file, and the place of the first row."""
        file = self._path or io.BytesIO(self._first + self._file.read())
        expected = "a Parquet file with the columns " + ", ".join(names)
        with opened_columns(file, names, self.field, expected) as table:
            if not table.metadata.num_rows:
                raise InputError(self.field, "a Parquet file without rows", "at least one row")
            for start, rows in rows_of(table, names, AT_ONCE, self.field, expected, first):
                yield start, rows.tolist()

    def _lines(self) -> Iterator[list[tuple[str, str]]]:
        """Lines as they arrive, without empty ones, each with its place."""
        rest, done, number, chunk = b"", 0, 0, self._first.removeprefix(codecs.BOM_UTF8)
        while chunk or rest:
            *whole, rest = (rest + chunk).split(b"\n") if chunk else [rest, b""]
            if len(rest) > LONGEST_LINE:
                raise InputError(self.field, f"a line of more than {LONGEST_LINE} bytes", "shorter lines")
            places = [f"{self.field} line {number + i + 1}" for i in range(len(whole))]
            number += len(whole)
            lines = [(place, self._text(line, place)) for place, line in zip(places, whole, strict=True)]
            lines = [(place, line) for place, line in lines if line.strip()]
            for start in range(0, len(lines), AT_ONCE):
                yield lines[start : start + AT_ONCE]
            done += len(lines)
            chunk = _read(self._file)  # only now: the sender may wait for the answers to these lines
        if not done:
            raise InputError(self.field, "nothing", "at least one row")

    def _text(self, line: bytes, place: str) -> str:
        try:  # in a table, a column that nobody asks for may be in another encoding
            return line.decode(errors="replace" if self.form == "csv" else "strict").removesuffix("\r")
        except UnicodeDecodeError:
            raise InputError(place, line, "text in UTF-8") from None

    def _arrays(self, shape: tuple[int, ...], expected: str, first: int = 0) -> Iterator[Array]:
        try:
            found: Any = (
                np.load(self._path, mmap_mode="r", allow_pickle=False)
                if self._path
                else np.load(io.BytesIO(self._first + self._file.read()), allow_pickle=False)
            )
        except (ValueError, EOFError):
            raise InputError(self.field, "a broken .npy file", expected) from None
        if found.ndim != len(shape) + 1 or found.shape[1:] != shape or found.dtype.kind not in "fiu":
            raise InputError(self.field, f"an array {found.shape} of {found.dtype}", expected)
        if not len(found):
            raise InputError(self.field, f"an array {found.shape}", "at least one row")
        for start in range(first, len(found), AT_ONCE):
            yield np.array(found[start : start + AT_ONCE], dtype=np.float64, order="C")


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
        yield Source(file, field, Path(path) if file.seekable() else None)


def _row(table: PoseTable, place: str, numbers: Callable[[], list[float]]) -> Goal:
    return Goal(place, "pose", table.pose(numbers(), place))


def _goal(place: str, read: Callable[[], Goal]) -> Goal:
    """The target of a row, or what is wrong with it."""
    try:
        return read()
    except InputError as error:
        return Goal(place, "pose", NOTHING, None, Wrong.of(error))


def _read(file: BinaryIO) -> bytes:
    """What is there, at least one byte; nothing at the end."""
    read: Callable[[int], bytes] = getattr(file, "read1", file.read)
    return read(_CHUNK)
