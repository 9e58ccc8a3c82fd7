"""Meshes of collision bodies beside a URDF, for ``kinboard import``.

They are read by the process that parses visitors' meshes, with the same limits.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from urllib.parse import unquote

from app.viewer.meshes.archive import MB, MeshError
from app.viewer.meshes.fitting import bodies_of
from app.viewer.meshes.placing import Shapes
from app.viewer.meshes.reader import MeshReader
from kin import RobotFileError
from kin.doctor.meshes import extent_of
from kin.files.urdf.collisions import Fitted, LinkPieces, Piece, without_meshes
from kin.files.urdf.visuals import MeshFile
from kin.transforms import Array

ABOVE = 6  # folders above the URDF in which a package is looked for
MOST_SEARCHED = 20_000  # files beside a URDF in which one that was moved is looked for
MOST_OF_MESH = 200 * MB
_SCHEMES = ("package", "model", "file")


@dataclass(frozen=True)
class MeshesBeside:
    """Fits capsules to bodies whose meshes are found from the place of a URDF: `fit` of `kin.files.read_urdf`."""

    urdf: Path

    def __call__(self, links: Sequence[LinkPieces], reach: float) -> Sequence[Fitted]:
        """The capsules of all URDF links; raises `kin.RobotFileError` for a mesh beyond the limits."""
        if not any(link.meshes for link in links):
            return without_meshes(links, reach)
        there = [replace(link, pieces=tuple(map(self._found, link.pieces))) for link in links]
        reader = MeshReader()
        try:
            shapes = Shapes((), (), 0, reach, bodies_of(there))
            return reader.read_package(shapes, self.urdf.resolve().parent).result().fits
        except MeshError as error:
            raise RobotFileError(str(self.urdf), error.field, error.value, error.expected) from None
        finally:
            reader.close()

    def _found(self, piece: Piece) -> Piece:
        """A mesh with the path of its file, as far as there is one."""
        if not isinstance(piece.shape, MeshFile):
            return piece
        path = self.file_of(piece.shape.path)
        return piece if path is None else Piece(piece.shape._replace(path=str(path)), piece.pose)

    def file_of(self, named: str) -> Path | None:
        """The file that a URDF names as ``package://NAME/…`` or relative to itself; None if there is none."""
        scheme, _, rest = named.partition("://")
        folder = self.urdf.resolve().parent
        if not rest:
            path = folder / unquote(named)
            return path if path.is_file() else None
        if scheme not in _SCHEMES:
            return None
        wanted = unquote(rest)
        if scheme == "file":
            return Path(wanted) if Path(wanted).is_file() else None
        inside = wanted.partition("/")[2]
        if wanted.startswith("/") or ".." in wanted.split("/"):
            return None
        for above in (folder, *folder.parents[:ABOVE]):
            # The folder of a package may have another name than the package.
            for path in (above / wanted, above / inside):
                if inside and path.is_file():
                    return path
        return None


@dataclass(frozen=True)
class MeshFilesBeside:
    """The meshes beside a URDF, as `kin.doctor.examine_urdf` takes them."""

    urdf: Path

    def extent(self, path: str) -> Array | None:
        """The sides of a mesh; raises `LookupError` with the reason why there is none."""
        found = MeshesBeside(self.urdf).file_of(path)
        if found is None:
            raise LookupError("there is no such file beside the URDF")
        try:
            if found.stat().st_size > MOST_OF_MESH:
                raise LookupError(f"the file has more than {MOST_OF_MESH // MB} MB")
            return extent_of(found.name, found.read_bytes())
        except OSError as error:
            raise LookupError(f"the file cannot be read ({error.strerror})") from None

    def elsewhere(self, path: str) -> str | None:
        """A file of the same name in the folder of the URDF or of its package, as a path from the URDF."""
        name = unquote(path).rpartition("/")[2]
        for places in (self._beside, self._above):
            if len(found := places.get(name, [])) == 1:
                file = Path(found[0]) / name
                return os.path.relpath(file, self.urdf.resolve().parent).replace(os.sep, "/")
        return None

    @cached_property
    def _beside(self) -> dict[str, list[str]]:
        return _places(self.urdf.resolve().parent)

    @cached_property
    def _above(self) -> dict[str, list[str]]:
        return _places(self.urdf.resolve().parent.parent)


def _places(root: Path) -> dict[str, list[str]]:
    """The folders in which files of each name are, of the first `MOST_SEARCHED` files and folders."""
    entries = ((folder, name) for folder, _, names in os.walk(root) for name in ("", *names))
    found: dict[str, list[str]] = {}
    for folder, name in islice(entries, MOST_SEARCHED):
        found.setdefault(name, []).append(folder)
    return found
