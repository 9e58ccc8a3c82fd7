"""The process that parses meshes: little memory, little time, no settings of the service.

It reads one request from standard input, writes one answer to standard output, and ends. The request is a line of
JSON, then the solids that `app.viewer.meshes.surface.pack` has packed, then the zip: ``pieces`` are what is to be
drawn (`app.viewer.meshes.placing.Piece`), ``bodies`` what becomes capsules (`Body`), ``links`` and ``reach`` those
of the arm, ``urdf`` the name in the zip of the file that names the meshes, ``folder`` that of an installed package
instead of a zip, ``most`` the triangles to draw in all, and ``solids`` the number of bytes of the solids.

Answers begin with lines ``P``, the number of meshes that are read, and of all meshes. Then comes ``E`` and an
error in JSON (``L``: one about what is too large), or ``N`` and the finished links, packed.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from app.shared.threads.confined import limit_this_process
from app.viewer.meshes.archive import MB, MOST_OF_FILE, Archive, MeshError, TooLargeError

if TYPE_CHECKING:
    from app.viewer.meshes.placing import Body, Fit
    from app.viewer.meshes.surface import Surface

MEMORY = 640 * 1024 * 1024  # bytes
SECONDS = 20  # of processor time
SLACK = 1.4  # of the triangles to draw
ROUNDS = 3  # of simplification, at most
ALL = 1_500_000  # triangles of all files, before they are simplified


def main() -> None:
    """Answer one request."""
    limit_this_process(MEMORY, SECONDS)
    # trimesh reads files without SciPy, whose import would take as long as reading a mesh.
    sys.modules["scipy"] = None  # type: ignore[assignment]
    line = sys.stdin.buffer.readline()
    data = sys.stdin.buffer.read()
    answer = sys.stdout.buffer

    def report(done: int, count: int) -> None:
        answer.write(f"P{done} {count}\n".encode())
        answer.flush()

    try:
        answer.write(b"N" + answer_to(json.loads(line), data, report))
    except MeshError as error:
        kind = b"L" if isinstance(error, TooLargeError) else b"E"
        answer.write(kind + json.dumps([error.field, str(error.value), error.expected]).encode())
    except MemoryError:
        words = ["meshes", "more memory than they may take", "fewer or simpler meshes"]
        answer.write(b"L" + json.dumps(words).encode())


def answer_to(request: dict[str, Any], data: bytes, report: Callable[[int, int], None] = lambda *_: None) -> bytes:
    """The finished links of a request; raises `MeshError`.

    Args:
        report: called with the number of meshes that are read, and of all meshes.
    """
    from app.viewer.meshes.loading import finished, read_surfaces
    from app.viewer.meshes.placing import Body, Piece, Shapes, placed
    from app.viewer.meshes.surface import pack, unpack

    solids = unpack(data[: request["solids"]], ALL)[0][0].surfaces
    pieces = [Piece(*piece) for piece in request["pieces"]]
    bodies = [Body(*body) for body in request.get("bodies", ())]
    shapes = Shapes(pieces, solids, request["links"], request["reach"])
    find, read = _source(request, data[request["solids"] :])
    fits = _fits(bodies, shapes.reach, find, read) if bodies else []
    names = {path: find(path) for path in shapes.files}
    uses: Counter[str] = Counter()
    for path, count in shapes.files.items():
        uses[names[path]] += count
    found: dict[str, list[Surface]] = {}
    total = drawn = 0
    for name in uses:
        report(len(found), len(uses))
        surfaces = read_surfaces(name, read(name), partial(_read_beside, read, name))
        count = sum(len(surface.faces) for surface in surfaces)
        total, drawn = total + count, drawn + uses[name] * count
        if total > ALL:
            raise TooLargeError("meshes: triangles", f"more than {ALL}", f"at most {ALL} in all files")
        found[name] = surfaces
    share = min(1.0, request["most"] / max(drawn, 1))
    for _ in range(ROUNDS):
        simple = {name: [finished(surface, share) for surface in found[name]] for name in uses}
        simple = {
            name: [surface for surface in surfaces if len(surface.faces)] for name, surfaces in simple.items()
        }
        empty = next((name for name, surfaces in simple.items() if not surfaces), None)
        if empty is not None:
            raise MeshError(f"mesh {empty}", "no triangle with an area", "a mesh with triangles")
        left = sum(count * len(surface.faces) for name, count in uses.items() for surface in simple[name])
        if left <= SLACK * request["most"]:
            return pack(placed(shapes, {path: simple[name] for path, name in names.items()}), drawn, fits)
        share *= request["most"] / left  # what is no closed surface stays large, so the others get smaller
    expected = f"meshes that can be simplified to {request['most']}"
    raise TooLargeError("meshes: triangles to draw", f"{left}", expected)


def _fits(
    bodies: Sequence[Body], reach: float, find: Callable[[str], str], read: Callable[[str], bytes]
) -> list[Fit]:
    """Capsules around bodies; their meshes are read once more, one at a time, if they are drawn as well."""
    from app.viewer.meshes.fitting import fit_all
    from app.viewer.meshes.loading import read_surfaces

    total = 0

    def surfaces_of(path: str) -> list[Surface]:
        nonlocal total
        name = find(path)
        found = read_surfaces(name, read(name), partial(_read_beside, read, name))
        total += sum(len(surface.faces) for surface in found)
        if total > ALL:
            raise TooLargeError("collision meshes: triangles", f"more than {ALL}", f"at most {ALL} in all files")
        return found

    return fit_all(bodies, reach, surfaces_of)


def _source(request: dict[str, Any], data: bytes) -> tuple[Callable[[str], str], Callable[[str], bytes]]:
    """What finds a mesh that is named, and what reads it."""
    if "folder" not in request:
        archive = Archive(data)
        return partial(archive.find, urdf=request["urdf"]), archive.read
    return str, partial(_read_file, Path(request["folder"]))


def _read_file(folder: Path, name: str) -> bytes:
    """A file of a folder that is trusted; raises `MeshError`."""
    try:
        size = (folder / name).stat().st_size
        if size > MOST_OF_FILE:
            raise TooLargeError(f"{name}: size", f"{size / MB:.1f} MB", f"at most {MOST_OF_FILE // MB} MB")
        return (folder / name).read_bytes()
    except OSError as error:
        raise MeshError(
            f"mesh {name}",
            "no such file" if isinstance(error, FileNotFoundError) else str(error.strerror),
            "a file that can be read",
        ) from None


def _read_beside(read: Callable[[str], bytes], mesh: str, name: str) -> bytes:
    """A file in the folder of a mesh; raises `KeyError` for any other place."""
    if "/" in name or "\\" in name or name in ("", ".", ".."):
        raise KeyError(name)
    return read(str(PurePosixPath(mesh).with_name(name)))
