"""Parquet files: columns of numbers, some rows at a time. They need the extra ``kinboard[parquet]``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from kin import InputError

Array = NDArray[np.float64]
MAGIC = b"PAR1"


def arrow_with_parquet(field: str, file: str) -> Any:
    """pyarrow with its Parquet module; an `InputError` names the field that needs it."""
    try:
        import pyarrow.parquet
    except ImportError:
        expected = "the extra parquet installed: pip install 'kinboard[parquet]'; or a .csv or .npy file"
        raise InputError(field, file, expected) from None
    return pyarrow


@contextmanager
def opened_columns(source: Path | BinaryIO, names: Sequence[str], field: str, expected: str) -> Iterator[Any]:
    """A Parquet file that has these columns among others, open; raises `InputError` with what is `expected`."""
    named = str(source) if isinstance(source, Path) else "a Parquet file"
    arrow = arrow_with_parquet(field, named)
    try:
        table = arrow.parquet.ParquetFile(source)
    except arrow.ArrowInvalid:
        raise InputError(field, named, expected) from None
    with table:
        if not set(names) <= set(table.schema_arrow.names):
            raise InputError(field, table.schema_arrow.names, expected)
        yield table


def rows_of(
    table: Any, names: Sequence[str], at_once: int, field: str, expected: str, first: int = 0
) -> Iterator[tuple[int, Array]]:
    """Rows ``(m, len(names))`` from the first one on, and the place of each piece.

    Earlier row groups are not read, and what is null becomes NaN. A column that has no numbers is refused.
    """
    sizes = [table.metadata.row_group(i).num_rows for i in range(table.num_row_groups)]
    ends = np.cumsum(sizes)
    begin = int(np.searchsorted(ends, first, side="right"))
    place = int(ends[begin]) - sizes[begin] if begin < len(sizes) else first
    for batch in table.iter_batches(at_once, row_groups=range(begin, len(sizes)), columns=list(names)):
        some = batch.slice(min(max(0, first - place), batch.num_rows))
        place += batch.num_rows
        if some.num_rows:
            yield place - some.num_rows, _numbers(some, names, f"{field}[{place - some.num_rows}]", expected)


def _numbers(batch: Any, names: Sequence[str], field: str, expected: str) -> Array:
    try:
        columns = [batch.column(name).to_numpy(zero_copy_only=False).astype(np.float64) for name in names]
    except (TypeError, ValueError):
        raise InputError(field, "a column of another type", expected) from None
    return np.stack(columns, axis=1)
