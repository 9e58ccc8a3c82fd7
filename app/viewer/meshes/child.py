"""The process that parses meshes: little memory, little time, no settings of the service.

It reads one request from standard input, writes one answer to standard output, and ends. The request is a line of
JSON and, after it, the zip: ``files`` are the names of the meshes with the number of times each is drawn,
``folder`` the folder of an installed package instead of a zip, ``most`` the triangles to draw in all. The answer
is ``E`` and an error in JSON, or ``N`` and what `app.viewer.meshes.surface.pack` writes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from app.viewer.meshes.archive import Archive, MeshError

MEMORY = 640 * 1024 * 1024  # bytes
SECONDS = 20  # of processor time
SLACK = 1.4  # of the triangles to draw
ALL = 1_500_000  # triangles of all files, before they are simplified


def main() -> None:
    """Answer one request."""
    _limit()
    line = sys.stdin.buffer.readline()
    data = sys.stdin.buffer.read()
    answer = sys.stdout.buffer
    try:
        answer.write(b"N" + answer_to(json.loads(line), data))
    except MeshError as error:
        answer.write(b"E" + json.dumps([error.field, str(error.value), error.expected]).encode())
    except MemoryError:
        words = ["meshes", "more memory than they may take", "fewer or simpler meshes"]
        answer.write(b"E" + json.dumps(words).encode())


def _limit() -> None:
    """Bound memory, processor time and files of this process, where the system can."""
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))


def answer_to(request: dict[str, Any], data: bytes) -> bytes:
    """The surfaces of all files of a request; raises `MeshError`."""
    from app.viewer.meshes.loading import finished, read_surfaces
    from app.viewer.meshes.surface import Surface, pack

    files: dict[str, int] = request["files"]
    read = _reader(request, data)
    found: dict[str, list[Surface]] = {}
    total = drawn = 0
    for name, uses in files.items():
        surfaces = read_surfaces(name, read(name), partial(_read_beside, read, name))
        count = sum(len(surface.faces) for surface in surfaces)
        total, drawn = total + count, drawn + uses * count
        if total > ALL:
            raise MeshError("meshes: triangles", f"more than {ALL}", f"at most {ALL} in all files")
        found[name] = surfaces
    share = min(1.0, request["most"] / max(drawn, 1))
    for name in files:
        found[name] = [done for surface in found[name] if len((done := finished(surface, share)).faces)]
        if not found[name]:
            raise MeshError(f"mesh {name}", "no triangle with an area", "a mesh with triangles")
    left = sum(uses * len(surface.faces) for name, uses in files.items() for surface in found[name])
    if left > SLACK * request["most"]:  # what is no surface cannot be simplified
        expected = f"meshes that can be simplified to {request['most']}"
        raise MeshError("meshes: triangles to draw", f"{left}", expected)
    return pack(found, drawn)


def _reader(request: dict[str, Any], data: bytes) -> Callable[[str], bytes]:
    if "folder" not in request:
        archive = Archive(data)
        return archive.read
    folder = Path(request["folder"])
    return lambda name: (folder / name).read_bytes()


def _read_beside(read: Callable[[str], bytes], mesh: str, name: str) -> bytes:
    """A file in the folder of a mesh; raises `KeyError` for any other place."""
    if "/" in name or "\\" in name or name in ("", ".", ".."):
        raise KeyError(name)
    return read(str(PurePosixPath(mesh).with_name(name)))
