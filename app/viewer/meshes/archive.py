"""A zip with a URDF and its meshes, which anybody may have made. Imported by the process that parses meshes.

The list of files is bounded before it is read, sizes before anything is unpacked. Files are only read into memory:
a name in the archive never becomes a path of this machine.
"""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import PurePosixPath
from urllib.parse import unquote

MB = 1_000_000
MOST_BYTES = 20 * MB  # of the zip
MOST_FILES = 500
MOST_UNPACKED = 150 * MB  # of all files
MOST_OF_FILE = 24 * MB  # of one file that is read
MOST_OF_URDF = MB
MOST_RATIO = 200  # of unpacked to packed bytes, for files of a megabyte or more
LONGEST_NAME = 300  # bytes
DEEPEST = 20  # folders of a path that a URDF names
FORMATS = (".stl", ".obj", ".dae", ".glb")
_URDF = (".urdf", ".xml")
_END, _LOCATOR, _END_SIZE = b"PK\x05\x06", b"PK\x06\x07", 22
_LISTED = 46  # bytes of an entry of the list, without its name
_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
_ENCRYPTED, _SYMLINK, _KIND = 0x1, 0o120000, 0o170000


class MeshError(Exception):
    """Something is wrong with an archive or a mesh.

    Attributes:
        field, value, expected: what it is about, what was given, and what is valid.
    """

    def __init__(self, field: str, value: object, expected: str) -> None:
        super().__init__(field, value, expected)
        self.field, self.value, self.expected = field, value, expected


class TooLargeError(MeshError):
    """A mesh is larger than any that is read, or made to do harm: nothing of its zip is used."""


class Archive:
    """The files of a zip.

    Raises:
        MeshError: it is no zip, too large, encrypted, or has names that are no relative paths.
    """

    def __init__(self, data: bytes) -> None:
        _check_list(data)
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
        except Exception as error:  # noqa: BLE001 - a damaged list of files raises anything
            raise MeshError("zip", str(error) or type(error).__name__, "a zip that can be read") from None
        self._files: dict[str, zipfile.ZipInfo] = {}
        listed = self._zip.infolist()
        if len(listed) > MOST_FILES:  # whatever number the zip states
            raise MeshError("zip: files", f"{len(listed)} files", f"at most {MOST_FILES} files")
        for info in listed:
            _check_entry(info)
            if not info.is_dir():
                self._files[info.filename] = info
        unpacked = sum(info.file_size for info in self._files.values())
        if unpacked > MOST_UNPACKED:
            raise MeshError("zip: unpacked size", f"{unpacked // MB} MB", f"at most {MOST_UNPACKED // MB} MB")

    @property
    def urdfs(self) -> list[str]:
        """The names of the URDF files, those highest up first."""
        found = [name for name in self._files if name.lower().endswith(_URDF) and not _hidden(name)]
        plain = [name for name in found if name.lower().endswith(".urdf")]
        return sorted(plain or found, key=lambda name: (name.count("/"), name))

    @property
    def about(self) -> str:
        """What is in an archive without a URDF, for a message."""
        for ending, words in (
            (".xacro", "xacro, which `xacro FILE.xacro > FILE.urdf` expands"),
            (".zip", "a zip inside the zip"),
        ):
            if any(name.lower().endswith(ending) for name in self._files):
                return f"no URDF, but {words}"
        return f"no URDF among {len(self._files)} files"

    def read(self, name: str, most: int = MOST_OF_FILE) -> bytes:
        """The content of a file; raises `MeshError`."""
        info = self._files[name]
        if info.file_size > most:
            raise TooLargeError(f"{name}: size", f"{info.file_size / MB:.1f} MB", f"at most {most // MB} MB")
        try:
            with self._zip.open(info) as file:
                return file.read(most)
        except Exception as error:  # noqa: BLE001 - so does a damaged file
            raise MeshError(name, str(error) or type(error).__name__, "a file that can be unpacked") from None

    def find(self, path: str, urdf: str) -> str:
        """The file that a URDF of this archive names, as ``package://NAME/…`` or relative to the URDF.

        The folder of a package may have any name and place in the archive: the file whose path ends with most of
        what is named is taken.

        Raises:
            MeshError: there is none, two are as likely, or it would be outside of the archive.
        """
        wanted = _wanted(path)
        parts = wanted.parts
        if not path.startswith(("package://", "model://", "file://", "/")):
            beside = _joined(PurePosixPath(urdf).parent, wanted)
            if beside is not None and beside in self._files:
                return beside
        parts = tuple(part for part in parts if part not in ("..", "."))[-DEEPEST:]
        alike = [name for name in self._files if parts and name.rpartition("/")[2] == parts[-1]]
        for start in range(len(parts)):
            ending = "/".join(parts[start:])
            found = [name for name in alike if name == ending or name.endswith("/" + ending)]
            if len(found) == 1:
                return found[0]
            if found:
                raise MeshError(
                    f"mesh {path}", " and ".join(sorted(found)[:3]), "a path that means one file of the zip"
                )
        raise MeshError(f"mesh {path}", "no such file in the zip", "a path of a file in the zip")


def _wanted(path: str) -> PurePosixPath:
    """The path that a URDF names, without its scheme."""
    scheme, _, rest = path.partition("://")
    if rest and scheme not in ("package", "model", "file"):
        raise MeshError(f"mesh {path}", scheme + "://", "package:// or a path in the zip; nothing is fetched")
    return PurePosixPath(unquote(rest or path).replace("\\", "/").lstrip("/"))


def _joined(folder: PurePosixPath, path: PurePosixPath) -> str | None:
    """A path from a folder of the archive; None if it would leave the archive."""
    found: list[str] = [part for part in folder.parts if part != "."]
    for part in path.parts:
        if part == "..":
            if not found:
                return None
            found.pop()
        elif part != ".":
            found.append(part)
    return "/".join(found)


def _hidden(name: str) -> bool:
    """Whether macOS or a version control system has added this file."""
    return any(part.startswith((".", "__MACOSX")) for part in name.split("/"))


def _check_list(data: bytes) -> None:
    """Refuse an archive whose list of files is long, before it is read."""
    if len(data) > MOST_BYTES:
        raise MeshError("zip: size", f"{len(data) / MB:.1f} MB", f"at most {MOST_BYTES // MB} MB")
    end = data.rfind(_END, max(0, len(data) - 65_535 - _END_SIZE))
    if end < 0 or end + _END_SIZE > len(data):
        raise MeshError("zip", "no list of files at its end", "a whole zip")
    count, size = struct.unpack_from("<HL", data, end + 10)
    if data[max(0, end - 20) :].startswith(_LOCATOR) or count == 0xFFFF:
        raise MeshError("zip", "the format ZIP64", "a plain zip")
    if count > MOST_FILES or size > MOST_FILES * (_LISTED + LONGEST_NAME):
        raise MeshError("zip: files", f"{count} files, a list of {size} bytes", f"at most {MOST_FILES} files")


def _check_entry(info: zipfile.ZipInfo) -> None:
    name = info.filename
    parts = name.split("/")
    if name.startswith("/") or ".." in parts or "\\" in name or ":" in parts[0] or len(name) > LONGEST_NAME:
        raise MeshError(
            "zip: name of a file", name[:LONGEST_NAME], "a relative path inside of the zip, without .."
        )
    if info.external_attr >> 16 & _KIND == _SYMLINK:
        raise MeshError(name, "a symbolic link", "files and folders")
    if info.flag_bits & _ENCRYPTED:
        raise MeshError(name, "encrypted", "a zip without a password")
    if info.compress_type not in _METHODS:
        raise MeshError(name, f"compression method {info.compress_type}", "stored or deflated files")
    if info.file_size >= MB and info.file_size > MOST_RATIO * max(info.compress_size, 1):
        ratio = f"{info.file_size // max(info.compress_size, 1)} times its packed size"
        raise MeshError(f"{name}: unpacked size", ratio, f"at most {MOST_RATIO} times")
