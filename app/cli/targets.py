"""``kinboard ik --targets``: joint values for a file of targets, to a file.

Targets are read, solved and written in pieces, so memory does not grow with their number. ``FILE.part`` is written
until all is done. A run that was interrupted leaves it there, with ``FILE.state`` beside it: how many targets are
done, and of which question. The same command goes on from there; any other question begins anew.
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
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.exports.progress import progress_bar
from app.shared.threads import processors
from kin import IKOptions, IKResults, InputError, Robot, solve_ik_many
from kin.transforms import from_position_wxyz

Array = NDArray[np.float64]
AT_ONCE = 4096  # targets of one piece
COLUMNS = ["x", "y", "z", "qw", "qx", "qy", "qz"]
_FIELD = "--targets"
_FILES = "a .npy file of poses (k, 4, 4), or a .csv file with the columns " + ", ".join(COLUMNS)


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

    def answers(self, T: Array, first: int) -> IKResults:
        """The answers to targets ``(m, 4, 4)``; an error names the target by its place in the file."""
        try:
            return solve_ik_many(self.robot, self.frame @ T, options=self.options, q_seed=self.q_seed)
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


def solve_file(question: Question, source: Path, output: Path) -> tuple[int, int]:
    """Write the best solution of each target of `source` to `output`: (targets, how many are solved).

    A .npy file gets ``(k, n)`` joint values, NaN where there is no exact solution; a .csv file a row ``status, q1,
    …`` for each target. Radians and metres.

    Raises:
        InputError: a file of another kind, one that cannot be read or written, or a target that is none.
    """
    if output.suffix.lower() not in (".npy", ".csv") or not output.parent.is_dir():
        raise InputError("--output", str(output), "a file in an existing folder, with a name in .npy or .csv")
    try:
        total = _count(source)
        return _resumed(question, source, output, total)
    except OSError as error:
        named = str(error.filename or output)
        raise InputError(_FIELD, named, f"files that can be read and written ({error.strerror})") from None


def _resumed(question: Question, source: Path, output: Path, total: int) -> tuple[int, int]:
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
        for found in _answered(question, source, done):
            file.write(_written(output, found))
            file.flush()
            done, solved = done + len(found), solved + int(found.solved.sum())
            state.write_text(json.dumps({"key": key, "done": done, "solved": solved, "size": file.tell()}))
            advance(len(found))
    part.replace(output)
    state.unlink(missing_ok=True)
    return done, solved


def _answered(question: Question, source: Path, first: int) -> Iterator[IKResults]:
    """The answers to the targets from the first one on, piece by piece in order, computed by threads."""
    waiting: deque[Future[IKResults]] = deque()
    pool = ThreadPoolExecutor(processors(), thread_name_prefix="targets")
    try:
        for T in _pieces(source, first):
            waiting.append(pool.submit(question.answers, T, first))
            first += len(T)
            if len(waiting) > processors():
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)


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
    if output.suffix.lower() == ".csv":
        return ",".join(["status", *(f"q{i + 1}" for i in range(n))]).encode() + b"\n"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (total, n)})
    return header.getvalue()


def _written(output: Path, found: IKResults) -> bytes:
    """The rows of some answers."""
    if output.suffix.lower() == ".npy":
        return found.q.astype("<f8").tobytes()
    rows = [
        ",".join([status.value, *(repr(x) if solved else "" for x in q)])
        for status, solved, q in zip(found.status, found.solved.tolist(), found.q.tolist(), strict=True)
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
        return from_position_wxyz([x, y, z], wxyz)
    except (ValueError, InputError):
        raise InputError(f"{_FIELD}[{place}]", ",".join(row), "seven numbers: " + ", ".join(COLUMNS)) from None
