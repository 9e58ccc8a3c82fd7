"""Clouds as files: every format agrees with the core, in bounded memory, whatever the slices."""

import csv
import io
import json
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

import kin
from app.exports import formats
from app.exports.formats import FORMATS, encode, table_of
from app.shared.clouds import Cloud, Clouds

ARM = kin.get_robot("pioneer5")
N = 2 * formats.BLOCK + 77
LIMITED = Cloud(
    ARM,
    N,
    7,
    "quasi",
    ("limits", "manipulability"),
    kin.JointConstraints(((0.0, 1.0), None, None, None, None), (None, None, 0.2, None, None)),
)
PLAIN = Cloud(ARM, N)
each_format = pytest.mark.parametrize("name", FORMATS)
each_cloud = pytest.mark.parametrize(("cloud", "with_q"), [(PLAIN, False), (LIMITED, True), (LIMITED, False)])


@pytest.fixture(scope="module")
def clouds():
    made = Clouds(max_bytes=0, threads=2)
    yield made
    made.close()


def whole(cloud, with_q=False):
    return cloud.slice(0, cloud.n, with_q)


def file_of(name, clouds, cloud, with_q=False):
    return b"".join(encode(name, clouds, cloud, with_q))


def columns_of(chunk):
    """All columns side by side ``(k, c)``, computed by the core."""
    return np.column_stack([chunk.points, *chunk.measures.values(), *([] if chunk.q is None else [chunk.q])])


# Each reads a file using only the documentation of its format and returns the column names and the rows.


def read_ndjson(data):
    rows = [json.loads(line) for line in data.splitlines()]
    names = list(rows[0])
    assert all(list(row) == names for row in rows)
    flat = [[v for value in row.values() for v in (value if isinstance(value, list) else [value])] for row in rows]
    if names[-1] == "q":
        names[-1:] = [f"q{i + 1}" for i in range(len(rows[0]["q"]))]
    return names, np.array(flat)


def read_csv(data):
    head, *rows = csv.reader(io.StringIO(data.decode("ascii"), newline=""))
    return head, np.array(rows, dtype=np.float64)


def read_bin(data):
    magic, version, columns, begin, count = struct.unpack_from("<8sHHIQ", data)
    assert (magic, version, begin % 64) == (b"KINCLOUD", 1, 0)
    names = data[24:begin].decode("ascii").rstrip().split(",")
    assert len(names) == columns
    rows = np.frombuffer(data, "<f4", offset=begin).reshape(count, columns)
    return names, rows


def read_ply(data):
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    kinds = {"float": "<f4", "double": "<f8"}
    fields = [(line.split()[2], kinds[line.split()[1]]) for line in lines[3:]]
    rows = np.frombuffer(body, fields)
    assert lines[2] == f"element vertex {len(rows)}"
    return [name for name, _ in fields], np.column_stack([rows[name] for name, _ in fields])


def read_npz(data):
    assert zipfile.ZipFile(io.BytesIO(data)).testzip() is None
    arrays = np.load(io.BytesIO(data))
    names = ["x", "y", "z", *(name for name in arrays if name not in ("points", "q"))]
    assert all(arrays[name].dtype == np.float32 for name in arrays if name != "q")
    if "q" in arrays:
        names += [f"q{i + 1}" for i in range(arrays["q"].shape[1])]
    return names, np.column_stack(list(arrays.values()))


READERS = {"ndjson": read_ndjson, "csv": read_csv, "bin": read_bin, "ply": read_ply, "npz": read_npz}


@each_format
@each_cloud
def test_a_file_agrees_with_the_core(clouds, name, cloud, with_q):
    names, rows = READERS[name](file_of(name, clouds, cloud, with_q))
    expected = columns_of(whole(cloud, with_q))
    assert names == list(table_of(cloud, with_q).columns)
    if name == "bin":
        expected = expected.astype(np.float32)
    # The points and measures are float32 and read back as the same ones; configurations keep all their digits.
    single = 3 + len(cloud.measures)
    assert np.array_equal(rows[:, :single].astype(np.float32), expected[:, :single].astype(np.float32))
    assert np.array_equal(rows[:, single:], expected[:, single:])


@each_format
@each_cloud
def test_a_size_announced_beforehand_is_exact(clouds, name, cloud, with_q):
    kind = FORMATS[name]
    if kind.size is not None:
        assert kind.size(table_of(cloud, with_q)) == len(file_of(name, clouds, cloud, with_q))
    assert (kind.size is not None) == (name in ("bin", "ply"))


@each_format
def test_bytes_do_not_depend_on_slices_or_threads(clouds, name, monkeypatch):
    expected = file_of(name, clouds, LIMITED, True)
    monkeypatch.setattr("app.shared.clouds.SAMPLED", 1000)
    other = Clouds(max_bytes=0, threads=3)
    try:
        assert file_of(name, other, LIMITED, True) == expected
    finally:
        other.close()


def test_samples_that_need_a_descent_come_in_small_slices(clouds):
    cloud = Cloud(ARM, 3 * formats.DESCENDED // 2, strategy="volume")
    seen = []
    rows = b"".join(encode("bin", clouds, cloud, watch=seen.append))
    assert [len(chunk.points) for chunk in seen] == [formats.DESCENDED, formats.DESCENDED // 2]
    assert np.array_equal(read_bin(rows)[1], whole(cloud).points)


def test_an_npz_file_is_the_same_with_buffered_and_recomputed_columns(clouds, monkeypatch):
    seen = []
    held = b"".join(encode("npz", clouds, LIMITED, True, seen.append))
    assert sum(chunk.done - chunk.start for chunk in seen) == N
    assert FORMATS["npz"].passes(table_of(LIMITED, True)) == 1
    monkeypatch.setattr(formats, "KEPT", 0)
    seen.clear()
    assert b"".join(encode("npz", clouds, LIMITED, True, seen.append)) == held
    assert sum(chunk.done - chunk.start for chunk in seen) == 4 * N
    assert FORMATS["npz"].passes(table_of(LIMITED, True)) == 4
    assert [bool(chunk.measures) or chunk.q is not None for chunk in seen if chunk.start == 0] == [
        False,
        True,
        True,
        True,
    ]


@pytest.mark.parametrize("with_q", [False, True])
def test_viewers_of_point_clouds_read_the_ply_file(clouds, with_q):
    data = file_of("ply", clouds, LIMITED, with_q)
    cloud = trimesh.load(io.BytesIO(data), file_type="ply")
    chunk = whole(LIMITED)
    assert np.array_equal(cloud.vertices.astype(np.float32), chunk.points)
    vertex = cloud.metadata["_ply_raw"]["vertex"]["data"]
    assert np.array_equal(vertex["manipulability"].ravel(), chunk.measures["manipulability"])


@pytest.mark.full
@each_format
def test_memory_does_not_grow_with_the_cloud(clouds, name, monkeypatch):
    monkeypatch.setattr("app.shared.clouds.SAMPLED", 4096)
    n = 2_000_000 if name in ("bin", "ply", "npz") else 100_000
    cloud = Cloud(ARM, n)
    for _ in encode(name, clouds, Cloud(ARM, 10)):
        pass  # loads the kernels
    tracemalloc.start()
    try:
        total = sum(map(len, encode(name, clouds, cloud)))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert total > 4 * 3 * n
    # A few slices of 50 kB in flight, one being written as some 200 kB of text; the file is 4 MB and more.
    assert peak < 2e6


@each_format
@pytest.mark.parametrize("after", [0, 1, 3])
def test_closing_stops_the_work(name, after, monkeypatch):
    started = []
    slice_of = Cloud.slice

    def counting(self, start, *rest):
        started.append(start)
        return slice_of(self, start, *rest)

    monkeypatch.setattr(Cloud, "slice", counting)
    mine = Clouds(max_bytes=0, threads=1)
    pieces = encode(name, mine, Cloud(ARM, 10**9))
    for _ in range(after):
        next(pieces)
    pieces.close()
    mine.close()
    mine._executor.shutdown(wait=True)
    assert len(started) <= after + 2


def test_the_layout_of_bin_is_documented():
    page = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    assert "KINCLOUD" in page
    assert "KINCLOUD" in formats.__doc__
