"""``kinboard ik --targets``: joint values for a file of targets, to a file.

Targets are read, solved and written in pieces, so memory does not grow with their number. ``FILE.part`` is written
until all is done. A run that was interrupted leaves it there, with ``FILE.state`` beside it: how many targets are
done, and of which question. The same command goes on from there; any other question begins anew. A Parquet file
cannot be continued: its rows stand in ``FILE.part`` as plain records, and become a Parquet file in the end.
"""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import sys
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.parquet import arrow_with_parquet, opened_columns, rows_of
from app.exports.progress import progress_bar
from app.shared.mapreduce import dask_client
from app.shared.threads import processors
from kin import IKOptions, InputError, Robot, Status, solve_ik_many
from kin.transforms import pose_from_position_wxyz, rotations_from_wxyz

Array = NDArray[np.float64]
AT_ONCE = 4096  # targets of one piece
COLUMNS = ["x", "y", "z", "qw", "qx", "qy", "qz"]
_FIELD = "--targets"
_FILES = "a .npy file of poses (k, 4, 4), or a .csv or .parquet file with the columns " + ", ".join(COLUMNS)
_ENDINGS = (".npy", ".csv", ".parquet")
_STATUSES = list(Status)
_RETRIES = 3  # of a piece that failed on a worker of a cluster


class Found(NamedTuple):
    """The answers to some targets: ``(m, n)`` joint values, NaN where there is no exact solution, and statuses."""

    q: Array
    status: tuple[Status, ...]


@dataclass(frozen=True)
class Question:
    """What is asked of each target.

    Attributes:
        frame: the frame of the targets ``(4, 4)``, in that of the robot.
        q_seed: ``(n,)``, None for the home configuration.
    """

    robot: Robot
    options: IKOptions
    frame: Array
    q_seed: Array | None

    def answers(self, T: Array, first: int) -> Found:
        """The answers to targets ``(m, 4, 4)``; an error names the target by its place in the file."""
        try:
            found = solve_ik_many(self.robot, self.frame @ T, options=self.options, q_seed=self.q_seed)
            return Found(found.q, found.status)
        except InputError as error:
            place, _, rest = error.field.removeprefix("targets[").partition("]")
            if not place.isdigit():
                raise
            raise error.renamed(f"{_FIELD}[{first + int(place)}]{rest}") from None

    def key(self, source: Path, output: Path) -> str:
        """A digest of the question, the file of targets and the kind of output."""
        robot, stat = self.robot, source.stat()
        seed = None if self.q_seed is None else self.q_seed.tolist()
        asked = (robot.convention, robot.rows, robot.base, robot.tool, robot.home, self.options, seed)
        where = (self.frame.tolist(), str(source.resolve()), stat.st_size, stat.st_mtime_ns, output.suffix.lower())
        return hashlib.sha256(repr((*asked, *where)).encode()).hexdigest()


def solve_file(question: Question, source: Path, output: Path, dask: str | None = None) -> tuple[int, int]:
    """Write the best solution of each target of `source` to `output`: (targets, how many are solved).

    A .npy file gets ``(k, n)`` joint values, NaN where there is no exact solution; a .csv or .parquet file a row
    ``status, q1, …`` for each target. Radians and metres.

    Args:
        dask: address of a Dask scheduler whose workers solve them; by default threads of this process do.

    Raises:
        InputError: the file has another format, or cannot be read or written; a row is no target; an extra is not
            installed; the cluster does not answer.
    """
    if output.suffix.lower() not in _ENDINGS or not output.parent.is_dir():
        expected = "a file in an existing folder, with a name in " + ", ".join(_ENDINGS)
        raise InputError("--output", str(output), expected)
    if output.suffix.lower() == ".parquet":
        arrow_with_parquet("--output", str(output))
    try:
        total = _count(source)
        with _solvers(dask) as (pool, most):
            return _resumed(question, source, output, total, pool, most)
    except OSError as error:
        named = str(error.filename or output)
        raise InputError(_FIELD, named, f"files that can be read and written ({error.strerror})") from None


@contextmanager
def _solvers(dask: str | None) -> Iterator[tuple[Executor, int]]:
    """What solves pieces, and how many it solves at a time: threads, or the workers of a Dask cluster."""
    if dask is None:
        with ThreadPoolExecutor(processors(), thread_name_prefix="targets") as pool:
            yield pool, processors()
        return
    with dask_client(dask, "--dask") as client:
        yield client.get_executor(pure=False, retries=_RETRIES), sum(client.nthreads().values())


def _resumed(
    question: Question, source: Path, output: Path, total: int, pool: Executor, most: int
) -> tuple[int, int]:
    """`solve_file` of this many targets, from where an earlier run has ended."""
    part, state = (output.with_name(output.name + end) for end in (".part", ".state"))
    key = question.key(source, output)
    done, solved, size = _state(state, part, key)
    with (
        part.open("r+b" if done else "wb") as file,
        progress_bar(total, "targets", sys.stderr.isatty()) as advance,
    ):
        file.truncate(size)
        file.seek(size)
        advance(done)
        if not done:
            file.write(_heading(output, total, question.robot.n))
        for found in _answered(question, source, done, pool, most):
            file.write(_written(output, found))
            file.flush()
            done, solved = done + len(found.q), solved + found.status.count(Status.SOLVED)
            state.write_text(json.dumps({"key": key, "done": done, "solved": solved, "size": file.tell()}))
            advance(len(found.q))
    if output.suffix.lower() == ".parquet":
        _write_parquet(part, output, question.robot.n)
        part.unlink()
    else:
        part.replace(output)
    state.unlink(missing_ok=True)
    return done, solved


def _answered(question: Question, source: Path, first: int, pool: Executor, most: int) -> Iterator[Found]:
    """The answers to the targets from the first one on, piece by piece in order; `most` pieces at a time."""
    waiting: deque[Future[Found]] = deque()
    try:
        for T in _pieces(source, first):
            waiting.append(pool.submit(question.answers, T, first))
            first += len(T)
            if len(waiting) > most:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for each in waiting:
            each.cancel()


def _state(state: Path, part: Path, key: str) -> tuple[int, int, int]:
    """What an earlier run of the same question left: (targets done, how many are solved, bytes), or zeros."""
    try:
        found = json.loads(state.read_text())
        done, solved, size = int(found["done"]), int(found["solved"]), int(found["size"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return 0, 0, 0
    same = found["key"] == key and part.is_file() and part.stat().st_size >= size
    return (done, solved, size) if same else (0, 0, 0)


def _heading(output: Path, total: int, n: int) -> bytes:
    """What stands before the rows of a file."""
    if output.suffix.lower() == ".parquet":
        return b""
    if output.suffix.lower() == ".csv":
        return ",".join(["status", *(f"q{i + 1}" for i in range(n))]).encode() + b"\n"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (total, n)})
    return header.getvalue()


def _written(output: Path, found: Found) -> bytes:
    """The rows of some answers."""
    if output.suffix.lower() == ".npy":
        return found.q.astype("<f8").tobytes()
    if output.suffix.lower() == ".parquet":
        records = np.empty(len(found.q), _record(found.q.shape[1]))
        records["status"], records["q"] = [_STATUSES.index(status) for status in found.status], found.q
        return records.tobytes()
    rows = [
        ",".join([status.value, *("" if x != x else repr(x) for x in q)])
        for status, q in zip(found.status, found.q.tolist(), strict=True)
    ]
    return ("\n".join(rows) + "\n").encode()


def _count(source: Path) -> int:
    """How many targets a file has."""
    if source.suffix.lower() == ".csv":
        with source.open(newline="") as file:
            lines = csv.reader(file)
            head = next(lines, [])
            if [name.strip() for name in head] != COLUMNS:
                raise InputError(_FIELD, head, _FILES)
            count = sum(1 for _ in lines)
    elif source.suffix.lower() == ".parquet":
        with _opened(source) as table:
            count = table.metadata.num_rows
    else:
        count = len(_poses(source))
    if not count:
        raise InputError(_FIELD, str(source), "at least one target")
    return count


def _poses(source: Path) -> NDArray[Any]:
    """The poses ``(k, 4, 4)`` of a .npy file, read when they are used."""
    try:
        found: NDArray[Any] = np.load(source, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError):
        raise InputError(_FIELD, str(source), _FILES) from None
    if (
        not isinstance(found, np.ndarray)
        or found.ndim != 3
        or found.shape[1:] != (4, 4)
        or found.dtype.kind != "f"
    ):
        raise InputError(_FIELD, str(source), _FILES)
    return found


def _pieces(source: Path, first: int) -> Iterator[Array]:
    """The targets ``(m, 4, 4)`` from the first one on, some at a time."""
    if source.suffix.lower() == ".parquet":
        yield from _parquet_pieces(source, first)
        return
    if source.suffix.lower() != ".csv":
        poses = _poses(source)
        for start in range(first, len(poses), AT_ONCE):
            yield np.ascontiguousarray(poses[start : start + AT_ONCE], dtype=np.float64)
        return
    with source.open(newline="") as file:
        rows = enumerate(itertools.islice(csv.reader(file), first + 1, None), first)
        while some := list(itertools.islice(rows, AT_ONCE)):
            yield np.stack([_pose(place, row) for place, row in some])


def _pose(place: int, row: list[str]) -> Array:
    """One row of a .csv file as a pose ``(4, 4)``."""
    try:
        x, y, z, *wxyz = map(float, row)
        return pose_from_position_wxyz([x, y, z], wxyz)
    except (ValueError, InputError):
        raise InputError(f"{_FIELD}[{place}]", ",".join(row), "seven numbers: " + ", ".join(COLUMNS)) from None


# -- Parquet ---------------------------------------------------------------------------------------------------


def _opened(source: Path) -> AbstractContextManager[Any]:
    """A Parquet file of targets, open."""
    return opened_columns(source, COLUMNS, _FIELD, _FILES)


def _parquet_pieces(source: Path, first: int) -> Iterator[Array]:
    """The targets ``(m, 4, 4)`` of a Parquet file from the first one on."""
    with _opened(source) as table:
        for place, rows in rows_of(table, COLUMNS, AT_ONCE, _FIELD, _FILES, first):
            yield _poses_of(rows, place)


def _poses_of(rows: Array, place: int) -> Array:
    """Rows ``(m, 7)`` as poses ``(m, 4, 4)``; `place` is that of the first in its file."""
    rotations = rotations_from_wxyz(rows[:, 3:]) if np.isfinite(rows).all() else None
    if rotations is None:
        return np.stack([_pose(place + i, list(map(str, row))) for i, row in enumerate(rows.tolist())])
    T = np.zeros((len(rows), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = rotations, rows[:, :3], 1.0
    return T


def _record(n: int) -> np.dtype[Any]:
    """A row of ``FILE.part``: the place of its status among all, and joint values."""
    return np.dtype([("status", "u1"), ("q", "<f8", (n,))])


def _write_parquet(part: Path, output: Path, n: int) -> None:
    """The rows of ``FILE.part`` as a Parquet file; joint values are null where there is no exact solution."""
    arrow = arrow_with_parquet("--output", str(output))
    names = ["status", *(f"q{i + 1}" for i in range(n))]
    schema = arrow.schema([(name, arrow.float64() if name != "status" else arrow.string()) for name in names])
    new = output.with_name(output.name + ".new")
    words = np.array([status.value for status in _STATUSES])
    with part.open("rb") as file, arrow.parquet.ParquetWriter(new, schema) as writer:
        while len(some := np.fromfile(file, _record(n), 16 * AT_ONCE)):
            joints = [arrow.array(some["q"][:, i], from_pandas=True) for i in range(n)]
            writer.write_table(arrow.table([arrow.array(words[some["status"]]), *joints], schema=schema))
    new.replace(output)
