"""A cloud as a file, written while it is computed: memory is bounded by a slice, however many points there are.

Each format is a generator of bytes over the slices of a cloud. The bytes depend on the cloud alone, not on the
slices. Numbers in text have the digits it takes to read the same float back: 9 for the points and measures, which
are float32, up to 17 for configurations, which are float64.

``bin`` is the simplest format for programs, all little-endian:

=========  ======  =======================================================================================
bytes      type    meaning
=========  ======  =======================================================================================
0–7        text    ``KINCLOUD``
8–9        uint16  version of the format, 1
10–11      uint16  columns
12–15      uint32  where rows begin, a multiple of 64
16–23      uint64  rows, one per point
24–        text    names of the columns, separated by commas, filled up with spaces
rows       float32 ``columns`` values each: x, y, z in metres, measures, joint values in radians (metres)
=========  ======  =======================================================================================
"""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable, Generator, Iterable
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.shared.clouds import Cloud, Clouds
from kin.transforms import Array
from kin.workspace import Measure, WorkspaceChunk

MAGIC, VERSION = b"KINCLOUD", 1
_HEADER = struct.Struct("<8sHHIQ")
_ALIGNED = 64
# Rows formatted at once: the interpreter lock is held for some milliseconds only, so a server stays responsive.
BLOCK = 4096
# Points of a slice if each is found by descent: a disconnect or Ctrl-C takes effect after a slice at most.
DESCENDED = 1 << 10
KEPT = 64 << 20  # bytes of columns that npz keeps in memory instead of computing the cloud again

Bytes = Generator[bytes]
Source = Callable[[tuple[Measure, ...], bool], Generator[WorkspaceChunk]]


@dataclass(frozen=True)
class Table:
    """The table to write: a row per point, x, y, z first.

    Attributes:
        n: how many points.
        measures: their names.
        joints: how many values a configuration has, 0 if configurations are not written.
    """

    n: int
    measures: tuple[Measure, ...] = ()
    joints: int = 0

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return ("x", "y", "z", *self.measures, *(f"q{i + 1}" for i in range(self.joints)))

    def parts(self, chunk: WorkspaceChunk) -> list[Array | NDArray[np.float32]]:
        """The columns of a slice: points ``(k, 3)``, measures ``(k,)``, configurations ``(k, n)``."""
        return [chunk.points, *(chunk.measures[name] for name in self.measures)] + (
            [] if chunk.q is None else [chunk.q]
        )

    def single(self, chunk: WorkspaceChunk) -> NDArray[np.float32]:
        """The rows of a slice ``(k, columns)`` in single precision, little-endian."""
        return np.column_stack(self.parts(chunk)).astype("<f4", copy=False)


def table_of(cloud: Cloud, with_q: bool) -> Table:
    """The table of a cloud."""
    return Table(cloud.n, cloud.measures, cloud.robot.n if with_q else 0)


def slices(clouds: Clouds, cloud: Cloud, with_q: bool) -> Generator[WorkspaceChunk]:
    """The whole cloud in order, in slices of a size that fits its strategy; close it to stop the computation."""
    return clouds.stream(cloud, DESCENDED if cloud.by_descent else cloud.part_size, with_q)


def encode(
    name: str,
    clouds: Clouds,
    cloud: Cloud,
    with_q: bool = False,
    watch: Callable[[WorkspaceChunk], object] | None = None,
) -> Bytes:
    """A cloud as the bytes of a file in the format `name`, a row of `FORMATS`; close it to stop the computation.

    `watch` is shown each slice before it is written. A format may go through the cloud several times.
    """

    def source(measures: tuple[Measure, ...], wanted: bool) -> Generator[WorkspaceChunk]:
        with closing(slices(clouds, replace(cloud, measures=measures), wanted)) as chunks:
            for chunk in chunks:
                if watch is not None:
                    watch(chunk)
                yield chunk

    return FORMATS[name].encode(table_of(cloud, with_q), source)


def _binary(table: Table, source: Source) -> Bytes:
    names = ",".join(table.columns).encode("ascii")
    begin = _rows_begin(table)
    header = _HEADER.pack(MAGIC, VERSION, len(table.columns), begin, table.n) + names
    yield header.ljust(begin)
    with closing(source(table.measures, table.joints > 0)) as chunks:
        for chunk in chunks:
            yield table.single(chunk).tobytes()


def _rows_begin(table: Table) -> int:
    length = _HEADER.size + len(",".join(table.columns))
    return -(-length // _ALIGNED) * _ALIGNED


def _binary_size(table: Table) -> int:
    return _rows_begin(table) + 4 * len(table.columns) * table.n


def _ply(table: Table, source: Source) -> Bytes:
    kinds = _ply_types(table)
    yield _ply_header(table)
    with closing(source(table.measures, table.joints > 0)) as chunks:
        for chunk in chunks:
            if not table.joints:
                yield table.single(chunk).tobytes()
                continue
            rows = np.empty(len(chunk.points), dtype=kinds)
            for name, column in zip(table.columns, np.column_stack(table.parts(chunk)).T, strict=True):
                rows[name] = column
            yield rows.tobytes()


def _ply_types(table: Table) -> np.dtype[np.void]:
    exact = len(table.columns) - table.joints
    return np.dtype([(name, "<f4" if k < exact else "<f8") for k, name in enumerate(table.columns)])


def _ply_header(table: Table) -> bytes:
    kinds = _ply_types(table)
    names = {4: "float", 8: "double"}
    properties = [f"property {names[kinds[name].itemsize]} {name}" for name in table.columns]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {table.n}", *properties, "end_header"]
    return ("\n".join(lines) + "\n").encode("ascii")


def _ply_size(table: Table) -> int:
    return len(_ply_header(table)) + _ply_types(table).itemsize * table.n


def _csv(table: Table, source: Source) -> Bytes:
    yield (",".join(table.columns) + "\n").encode("ascii")
    yield from _text(table, ",".join(_digits(table)) + "\n", source)


def _ndjson(table: Table, source: Source) -> Bytes:
    digits = _digits(table)
    exact = len(digits) - table.joints
    fields = [f'"{name}":{pattern}' for name, pattern in zip(table.columns[:exact], digits, strict=False)]
    if table.joints:
        fields.append('"q":[' + ",".join(digits[exact:]) + "]")
    yield from _text(table, "{" + ",".join(fields) + "}\n", source)


def _digits(table: Table) -> list[str]:
    return ["%.9g"] * (3 + len(table.measures)) + ["%r"] * table.joints


def _text(table: Table, row: str, source: Source) -> Bytes:
    """One format string for a whole block of rows, which takes half the time of one per row."""
    block = row * BLOCK
    with closing(source(table.measures, table.joints > 0)) as chunks:
        for chunk in chunks:
            values = np.column_stack(table.parts(chunk))
            for start in range(0, len(values), BLOCK):
                some = values[start : start + BLOCK]
                pattern = block if len(some) == BLOCK else row * len(some)
                yield (pattern % tuple(some.ravel().tolist())).encode("ascii")


def _npz(table: Table, source: Source) -> Bytes:
    """One array after the other, although a cloud computes them together.

    Later arrays are buffered if they are small. Otherwise the cloud, which is the same every time, is computed
    again for each array.
    """
    arrays: list[tuple[str, str, tuple[int, ...]]] = [("points", "<f4", (table.n, 3))]
    arrays += [(name, "<f4", (table.n,)) for name in table.measures]
    arrays += [("q", "<f8", (table.n, table.joints))] if table.joints else []
    held: dict[str, list[bytes]] = {}
    if _npz_passes(table) == 1:
        held = {name: [] for name, *_ in arrays[1:]}
    sink = _Sink()
    with zipfile.ZipFile(sink, "w") as archive:  # type: ignore[call-overload]  # asks for no more than write, flush
        for name, kind, shape in arrays:
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.external_attr = 0o600 << 16
            with archive.open(entry, "w", force_zip64=True) as member:
                header = {"descr": kind, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(member, header)
                with closing(_array(table, source, name, kind, held)) as pieces:
                    for piece in pieces:
                        member.write(piece)
                        yield sink.take()
    yield sink.take()


def _npz_passes(table: Table) -> int:
    """How often the cloud is computed: once if the later arrays fit in memory, else once per array."""
    later = table.n * (4 * len(table.measures) + 8 * table.joints)
    return 1 if later <= KEPT else 1 + len(table.measures) + (table.joints > 0)


def _array(table: Table, source: Source, name: str, kind: str, held: dict[str, list[bytes]]) -> Bytes:
    """The bytes of one array of an npz file; the arrays of `held` are filled together with the points."""
    if name in held:
        yield from held.pop(name)
        return
    if held:
        wanted, with_q = table.measures, table.joints > 0
    else:
        wanted, with_q = tuple(m for m in table.measures if m == name), name == "q"
    with closing(source(wanted, with_q)) as chunks:
        for chunk in chunks:
            if held:
                for measure in table.measures:
                    held[measure].append(chunk.measures[measure].astype("<f4", copy=False).tobytes())
                if chunk.q is not None:
                    held["q"].append(chunk.q.astype("<f8", copy=False).tobytes())
            values = chunk.points if name == "points" else chunk.q if name == "q" else chunk.measures[name]
            assert values is not None  # requested above
            yield values.astype(kind, copy=False).tobytes()


class _Sink:
    """The sink of a zip file, read piece by piece. It cannot seek, like a connection."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def write(self, data: bytes) -> int:
        self._pieces.append(bytes(data))
        return len(data)

    def flush(self) -> None:
        """Does nothing: there is no buffer."""

    def take(self) -> bytes:
        """The bytes written since the last call."""
        data = b"".join(self._pieces)
        self._pieces.clear()
        return data


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes:
        name: its identifier in requests, and the extension of its files.
        media_type: the HTTP media type.
        meaning: a description for users.
            encode: yields the bytes of the file.
            size: the number of bytes, None if it is only known at the end.
            passes: how often it iterates over the cloud.
    """

    name: str
    media_type: str
    meaning: str
    encode: Callable[[Table, Source], Bytes]
    size: Callable[[Table], int] | None = None
    passes: Callable[[Table], int] = lambda table: 1


_ALL: Iterable[Format] = (
    Format("ndjson", "application/x-ndjson", "a JSON object per line", _ndjson),
    Format("csv", "text/csv", "a header, then a line per point", _csv),
    Format("bin", "application/octet-stream", "a short header, then float32 rows", _binary, _binary_size),
    Format("ply", "application/x-ply", "for viewers of point clouds, binary", _ply, _ply_size),
    Format("npz", "application/zip", "for numpy.load: points, an array per measure, q", _npz, None, _npz_passes),
)
FORMATS: dict[str, Format] = {each.name: each for each in _ALL}
