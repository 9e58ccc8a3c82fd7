"""``kinboard ik --targets``: joint values for a file of targets, to a file.

Targets are read, solved and written in pieces, so memory does not grow with their number. ``FILE.part`` is written
until all is done. A run that was interrupted leaves it there, with ``FILE.state`` beside it: how many targets are
done, and of which question. The same command goes on from there; any other question begins anew. A Parquet file
cannot be continued: its rows stand in ``FILE.part`` as CSV, and become a Parquet file in the end.
"""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import sys
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.parquet import arrow_with_parquet
from app.cli.pipes.poses import INVALID, Answers, Counted, Goal, PoseTable, answered
from app.cli.pipes.source import opened_source
from app.exports.progress import progress_bar
from app.shared.mapreduce import dask_client
from app.shared.threads import processors
from kin import IKOptions, InputError, Robot, Status

Array = NDArray[np.float64]
AT_ONCE = 4096  # targets of one piece
_FIELD = "--targets"
_ENDINGS = (".npy", ".csv", ".parquet")
_RETRIES = 3  # of a piece that failed on a worker of a cluster


@dataclass(frozen=True)
class Question:
    """What is asked of each target.

    Attributes:
        frame: the frame of the targets ``(4, 4)``, in that of the robot.
        q_seed: ``(n,)``, None for the home configuration.
        table: the columns of targets in tables.
        strict: whether the first row that is no target ends the run.
        pendant: whether joint values are written as the arm's pendant shows them.
    """

    robot: Robot
    options: IKOptions
    frame: Array
    q_seed: Array | None
    table: PoseTable
    strict: bool
    pendant: bool

    def answers(self, targets: list[Goal]) -> Answers:
        """The answers to some targets."""
        placed = [each._replace(T=self.frame @ each.T) for each in targets]
        return answered(self.robot, placed, self.options, self.q_seed, self.strict, self.pendant)

    def key(self, source: Path, output: Path) -> str:
        """A digest of the question, the file of targets and the kind of output."""
        robot, stat = self.robot, source.stat()
        seed = None if self.q_seed is None else self.q_seed.tolist()
        asked = (robot.convention, robot.rows, robot.base, robot.tool, robot.home, self.options, seed)
        where = (self.frame.tolist(), str(source.resolve()), stat.st_size, stat.st_mtime_ns, output.suffix.lower())
        read = (self.table.form.key, self.strict, self.pendant and robot.pendant)
        return hashlib.sha256(repr((*asked, *where, *read)).encode()).hexdigest()


def solve_file(question: Question, source: Path, output: Path, dask: str | None = None) -> Counted:
    """Write the best solution of each target of `source` to `output`.

    A .npy file gets ``(k, n)`` joint values, NaN where there is no exact solution; a .csv or .parquet file a row
    ``status, q1, …, reason`` for each target. Radians and metres.

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
        total = sum(1 for _ in _targets(source, 0, question.table))
        with _solvers(dask) as (pool, most):
            return _resumed(question, source, output, total, pool, most)
    except OSError as error:
        named = str(error.filename or output)
        raise InputError(_FIELD, named, f"files that can be read and written ({error.strerror})") from None


@contextmanager
def _solvers(dask: str | None) -> Iterator[tuple[Executor, int]]:
    """What solves pieces, and how many it solves at a time: threads, or the workers of a Dask cluster."""
    if dask is None:
        count = processors()
        with ThreadPoolExecutor(count, thread_name_prefix="targets") as pool:
            yield pool, count
        return
    with dask_client(dask, "--dask") as client:
        yield client.get_executor(pure=False, retries=_RETRIES), sum(client.nthreads().values())


def _resumed(question: Question, source: Path, output: Path, total: int, pool: Executor, most: int) -> Counted:
    """`solve_file` of this many targets, from where an earlier run has ended."""
    part, state = (output.with_name(output.name + end) for end in (".part", ".state"))
    key = question.key(source, output)
    (done, solved, invalid), size = _state(state, part, key)
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
            done += len(found.q)
            solved, invalid = solved + found.status.count(Status.SOLVED), invalid + found.status.count(INVALID)
            counts = {"done": done, "solved": solved, "invalid": invalid, "size": file.tell()}
            state.write_text(json.dumps({"key": key, **counts}))
            advance(len(found.q))
    if output.suffix.lower() == ".parquet":
        _write_parquet(part, output, question.robot.n)
        part.unlink()
    else:
        part.replace(output)
    state.unlink(missing_ok=True)
    return Counted(done, solved, invalid)


def _answered(question: Question, source: Path, first: int, pool: Executor, most: int) -> Iterator[Answers]:
    """The answers to the targets from the first one on, piece by piece in order; `most` pieces at a time."""
    waiting: deque[Future[Answers]] = deque()
    try:
        reads = _targets(source, first, question.table)
        while some := list(itertools.islice(reads, AT_ONCE)):
            targets = [read() for read in some]
            waiting.append(pool.submit(question.answers, targets))
            if len(waiting) > most:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for each in waiting:
            each.cancel()


def _state(state: Path, part: Path, key: str) -> tuple[Counted, int]:
    """What an earlier run of the same question left: how much is done, and bytes; zeros if there is nothing."""
    try:
        found = json.loads(state.read_text())
        counted = Counted(int(found["done"]), int(found["solved"]), int(found["invalid"]))
        size = int(found["size"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return Counted(0, 0, 0), 0
    same = found["key"] == key and part.is_file() and part.stat().st_size >= size
    return (counted, size) if same else (Counted(0, 0, 0), 0)


def _columns(n: int) -> list[str]:
    """The columns of the answers for an arm of n joints."""
    return ["status", *(f"q{i + 1}" for i in range(n)), "reason"]


def _heading(output: Path, total: int, n: int) -> bytes:
    """What stands before the rows of a file."""
    if output.suffix.lower() != ".npy":
        return ",".join(_columns(n)).encode() + b"\n"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (total, n)})
    return header.getvalue()


def _written(output: Path, found: Answers) -> bytes:
    """The rows of some answers; those of a Parquet file are kept as CSV until all are there."""
    if output.suffix.lower() == ".npy":
        return found.q.astype("<f8").tobytes()
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    for status, q, reason in zip(found.status, found.q.tolist(), found.reason, strict=True):
        rows.writerow([status, *("" if x != x else repr(x) for x in q), reason])
    return text.getvalue().encode()


def _targets(source: Path, first: int, table: PoseTable) -> Iterator[Callable[[], Goal]]:
    """What reads each target of a file from the first one on."""
    with opened_source(str(source), _FIELD) as opened:
        if opened.form == "ndjson":
            expected = "a .npy file of poses (k, 4, 4), or a .csv or .parquet file with the columns "
            raise InputError(_FIELD, str(source), expected + ", ".join(table.names))
        for some in opened.goals(table, first=first):
            yield from some


def _write_parquet(part: Path, output: Path, n: int) -> None:
    """The rows of ``FILE.part`` as a Parquet file; joint values are null where there is no exact solution."""
    arrow = arrow_with_parquet("--output", str(output))
    names = _columns(n)
    kinds = [arrow.string(), *[arrow.float64()] * n, arrow.string()]
    schema = arrow.schema(list(zip(names, kinds, strict=True)))
    new = output.with_name(output.name + ".new")
    with part.open(newline="", encoding="utf-8") as file, arrow.parquet.ParquetWriter(new, schema) as writer:
        rows = itertools.islice(csv.reader(file), 1, None)
        while some := list(itertools.islice(rows, 16 * AT_ONCE)):
            status, *joints, reason = zip(*some, strict=True)
            values = [arrow.array([float(x) if x else None for x in joint], arrow.float64()) for joint in joints]
            columns = [arrow.array(status), *values, arrow.array(reason)]
            writer.write_table(arrow.table(columns, schema=schema))
    new.replace(output)
