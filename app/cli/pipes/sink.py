"""Where answers go: a file or standard output, as CSV, NumPy or JSON lines."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.source import Form
from app.exports.save import opened
from app.shared.answers.answer import as_json
from kin import InputError

ENDINGS: dict[str, Form] = {".csv": "csv", ".npy": "npy", ".ndjson": "ndjson", ".jsonl": "ndjson"}


class Sink:
    """Writes the answers to some rows at once, but for arrays: their beginning says how long they are.

    Attributes:
        form: what is written; only its method is to be called.
    """

    def __init__(self, file: BinaryIO, form: Form, heading: Sequence[str]) -> None:
        self._file, self._arrays = file, list[NDArray[np.float64]]()
        self.form = form
        if form == "csv":
            file.write(",".join(heading).encode() + b"\n")

    def rows(self, rows: Iterable[Iterable[object]]) -> None:
        """Write cells; not-a-number is an empty one."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(map(_cell, row) for row in rows)
        self._write(text.getvalue().encode())

    def array(self, part: NDArray[np.float64]) -> None:
        """Keep a part of the array, whose first axis counts the rows."""
        self._arrays.append(part)

    def answers(self, answers: Iterable[object]) -> None:
        """Write answers as REST gives them, one on each line."""
        self._write(b"".join(as_json(each) + b"\n" for each in answers))

    def _write(self, text: bytes) -> None:
        self._file.write(text)
        self._file.flush()

    def end(self) -> None:
        """Write what could not be written before."""
        if self.form == "npy":
            np.lib.format.write_array(self._file, np.concatenate(self._arrays), allow_pickle=False)
        self._file.flush()


@contextmanager
def opened_output(path: str, field: str = "--output") -> Iterator[BinaryIO]:
    """A file that appears when it is complete, or standard output for "-"; raises `InputError` for the option.

    A reader of standard output that leaves is no error: `BrokenPipeError` passes.
    """
    try:
        with opened(path) as file:
            yield file
    except BrokenPipeError:
        raise
    except OSError as error:
        raise InputError(field, path, f"a file that can be written ({error.strerror or error})") from None


def write_output(path: str, content: str | bytes, field: str = "--output") -> None:
    """Write such a file at once."""
    with opened_output(path, field) as file:
        file.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def opened_sink(path: str, form: Form, heading: Sequence[str]) -> Iterator[Sink]:
    """A file that appears when it is complete, or standard output for "-"; raises `InputError`."""
    if path == "-" and form == "npy" and sys.stdout.isatty():
        raise InputError("--format", "npy", "csv or ndjson for a terminal, or --output FILE")
    with opened_output(path) as file:
        sink = Sink(file, form, heading)
        yield sink
        sink.end()


def form_of(path: str, given: str | None, source: Form) -> Form:
    """The form of the answers: the one named, that of the file's ending, or for "-" that of the rows."""
    if given is not None:
        return cast(Form, given)
    if path == "-":
        return source
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise InputError("--output", path, "a name that ends in " + ", ".join(ENDINGS) + ", or --format")
    return ENDINGS[ending]


def _cell(value: object) -> str:
    """A cell of a table; empty for not-a-number."""
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value != value else repr(value) if isinstance(value, float) else str(value)
