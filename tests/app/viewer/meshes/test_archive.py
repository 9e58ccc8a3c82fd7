"""Zips that anybody may have made: nothing outside of them, nothing large, each refusal names what is valid."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from zips import link, packed, robot_files, with_byte

from app.viewer.meshes.archive import MB, MOST_FILES, Archive, MeshError

GOOD = packed(robot_files())
CENTRAL = b"PK\x01\x02"  # an entry of the list of files


def read_all(data: bytes) -> list[bytes]:
    archive = Archive(data)
    return [archive.read(file) for file in archive._files]


def bomb(size: int) -> bytes:
    return packed({"two.urdf": "<robot/>", "zeros.stl": bytes(size)})


HOSTILE = {
    "no zip": (b"PK\x03\x04 but nothing else", "a whole zip"),
    "empty": (b"", "a whole zip"),
    "cut": (GOOD[:-30], "a whole zip"),
    "large": (bytes(20 * MB + 1), "at most 20 MB"),
    "bomb": (bomb(60 * MB), "at most 200 times"),
    "many": (packed({f"{i}.txt": "" for i in range(MOST_FILES + 1)}), f"at most {MOST_FILES} files"),
    "up": (packed({"../../etc/passwd": "x"}), "without .."),
    "absolute": (packed({"/etc/passwd": "x"}), "without .."),
    "windows": (packed({"c:/x.urdf": "x"}), "without .."),
    "link": (link("/etc/passwd"), "files and folders"),
    "encrypted": (with_byte(GOOD, CENTRAL, 8, b"\x01"), "without a password"),
    "method": (with_byte(GOOD, CENTRAL, 10, b"\x63"), "stored or deflated"),
    "zip64": (GOOD[:-22] + b"PK\x06\x07" + bytes(16) + GOOD[-22:], "a plain zip"),
    "list": (with_byte(GOOD, b"PK\x05\x06", 12, b"\xff\xff\xff\x7f"), f"at most {MOST_FILES} files"),
    "count": (
        with_byte(packed({f"{i}": "" for i in range(MOST_FILES + 1)}), b"PK\x05\x06", 10, b"\x01"),
        f"at most {MOST_FILES} files",
    ),
    "shifted": (with_byte(GOOD, CENTRAL, 42, b"\xff\xff\xff\x0f"), "a file that can be unpacked"),
    "longer": (with_byte(GOOD, CENTRAL, 24, b"\xff\xff\x0f\x00"), "at most 200 times"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_zip_is_refused_with_what_is_valid(name: str) -> None:
    data, expected = HOSTILE[name]
    with pytest.raises(MeshError) as caught:
        read_all(data)
    assert expected in caught.value.expected
    assert caught.value.field
    assert str(caught.value.value)


def test_a_file_is_read_whole_or_not_at_all() -> None:
    archive = Archive(GOOD)
    assert archive.read("two/README.md") == b"a robot"
    with pytest.raises(MeshError) as caught:
        archive.read("two/meshes/upper.stl", most=100)
    assert "upper.stl" in caught.value.field
    damaged = with_byte(GOOD, b"upper.stl", 20, b"\x00\xff\x00\xff")
    with pytest.raises(MeshError):
        Archive(damaged).read("two/meshes/upper.stl")


@pytest.mark.full
def test_a_sum_of_files_is_bounded_too() -> None:
    noise = bytes(range(256)) * 1000
    with pytest.raises(MeshError) as caught:
        Archive(packed({f"{i}.stl": noise * 3 for i in range(250)}))
    assert caught.value.field == "zip: unpacked size"


URDF = "two/urdf/two.urdf"


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("package://two_description/meshes/upper.stl", "two/meshes/upper.stl"),
        ("package://two/meshes/upper.stl", "two/meshes/upper.stl"),
        ("../meshes/upper.stl", "two/meshes/upper.stl"),
        ("file:///home/me/ws/two/meshes/upper.stl", "two/meshes/upper.stl"),
        ("/home/me/ws/two/meshes/upper.stl", "two/meshes/upper.stl"),
        ("upper.stl", "two/meshes/upper.stl"),
        ("..\\meshes\\upper.stl", "two/meshes/upper.stl"),
        ("../../../../../two/meshes/upper.stl", "two/meshes/upper.stl"),
        ("../meshes/my%20arm.stl", "two/meshes/my arm.stl"),
        ("http://example.org/upper.stl", "nothing is fetched"),
        ("../../../etc/passwd", "a path of a file in the zip"),
        ("file:///etc/passwd", "a path of a file in the zip"),
        ("twice.stl", "one file of the zip"),
    ],
)
def test_paths_of_a_urdf_mean_files_of_the_zip(path: str, found: str) -> None:
    more = {"two/meshes/my arm.stl": b"", "a/twice.stl": b"", "b/twice.stl": b""}
    archive = Archive(packed({**robot_files(), **more}))
    if not found.startswith("two/"):
        with pytest.raises(MeshError) as caught:
            archive.find(path, URDF)
        assert found in caught.value.expected
    else:
        assert archive.find(path, URDF) == found


@given(path=st.text(max_size=40))
def test_whatever_a_urdf_names_is_in_the_zip_or_refused(path: str) -> None:
    archive = Archive(GOOD)
    with contextlib.suppress(MeshError):
        assert archive.find(path, URDF) in robot_files()


@given(data=st.data())
def test_a_damaged_zip_is_read_or_refused(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(GOOD) - 1))
    damaged = GOOD[:at] + data.draw(st.binary(min_size=1, max_size=8)) + GOOD[at + 1 :]
    with contextlib.suppress(MeshError):
        assert len(read_all(damaged)) <= len(robot_files())


def test_the_urdf_is_found_or_what_is_there_instead_is_said() -> None:
    files = {"b/robot.urdf": "x", "robot.urdf": "x", ".git/robot.urdf": "x", "package.xml": "x"}
    assert Archive(packed(files)).urdfs == ["robot.urdf", "b/robot.urdf"]
    assert Archive(packed({"robot.xml": "x"})).urdfs == ["robot.xml"]
    for name, words in (("arm.urdf.xacro", "xacro"), ("inner.zip", "a zip inside"), ("x.stl", "among 1 files")):
        archive = Archive(packed({name: "x"}))
        assert archive.urdfs == []
        assert words in archive.about
