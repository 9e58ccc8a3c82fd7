"""Mesh files → surfaces that a browser can draw: few triangles, one colour each, sharp edges where they belong.

Imported by the process that parses meshes.
"""

from __future__ import annotations

import io
import json
import re
import struct
from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Any

import fast_simplification
import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.exchange.load import mesh_loaders
from trimesh.resolvers import Resolver

from app.viewer.meshes.archive import FORMATS, MeshError, TooLargeError
from app.viewer.meshes.surface import Faces, Points, Rgb, Surface, by_color

PARSED = 600_000  # triangles of one file, before it is simplified
COLORS = 6  # of one file; further ones are drawn in the closest of them
LEAST = 60  # triangles that are left of a surface, however many there are in all
CREASE = 35.0  # degrees between two triangles, from which on their edge is sharp
GRID = 1e-6  # of a surface's size: points closer than this are one
ROUNDS = 60  # of spreading a label around a point, at most


def read_surfaces(name: str, data: bytes, read: Callable[[str], bytes]) -> list[Surface]:
    """The surfaces of a mesh file, one per colour, in metres.

    Args:
        read: gives files that it refers to, by their name beside it; raises `KeyError`.

    Raises:
        MeshError: it has no triangles, too many, or cannot be read.
    """
    kind = PurePosixPath(name).suffix.lower()
    if kind not in FORMATS:
        raise MeshError(f"mesh {name}", kind or "no ending", "one of " + ", ".join(FORMATS))
    _check_count(name, kind, data)
    try:
        pieces = _pieces(name, _load(kind[1:], data, _Beside(read)))
    except (MeshError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - the loaders of many formats raise anything
        words = f"{type(error).__name__}: {error}"[:120]
        raise MeshError(f"mesh {name}", words, f"a mesh in the format {kind}") from None
    if not pieces:
        raise MeshError(f"mesh {name}", "no triangles", "a mesh with triangles")
    return by_color(pieces, COLORS)


def _load(kind: str, data: bytes, beside: Resolver) -> Any:
    """The scene of a file. trimesh would merge the points of each mesh, which `finished` does as well."""
    load: Any = mesh_loaders[kind]
    loaded = load(file_obj=io.BytesIO(data), file_type=kind, resolver=beside, maintain_order=True)
    for mesh in loaded.get("geometry", {"": loaded}).values():
        mesh["process"] = False
    scene: Any = trimesh.load_scene(loaded)
    return scene


class _Beside(Resolver):
    """Gives the materials and buffers beside a mesh file; no textures, and nothing else."""

    def __init__(self, read: Callable[[str], bytes]) -> None:
        self._read = read

    def get(self, key: str) -> bytes:
        if not key.lower().endswith(".mtl"):
            raise KeyError(key)
        return self._read(key)

    def write(self, name: str, data: object) -> None:
        raise KeyError(name)

    def namespaced(self, namespace: str) -> _Beside:
        return self

    def keys(self) -> list[str]:
        return []


def _check_count(name: str, kind: str, data: bytes) -> None:
    """Refuse a mesh with too many triangles before it is parsed, as far as its head tells."""
    count = 0
    if kind == ".stl" and len(data) >= 84:
        (count,) = struct.unpack_from("<I", data, 80)
        if len(data) != 84 + 50 * count and data[:80].lstrip().startswith(b"solid"):
            count = data.count(b"facet") // 2  # a text
    elif kind == ".obj":
        count = data.count(b"\nf ")
    elif kind == ".glb" and len(data) >= 20:
        count = _count_of_glb(data)
    elif kind == ".dae":
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise TooLargeError(f"mesh {name}", "DOCTYPE", "a file without DOCTYPE and entities")
        count = sum(
            int(number) for number in re.findall(rb'<(?:triangles|polylist)[^>]{0,200}?count="(\d{1,9})"', data)
        )
    if count > PARSED:
        raise TooLargeError(f"mesh {name}: triangles", f"{count}", f"at most {PARSED} in a file")


def _count_of_glb(data: bytes) -> int:
    """Triangles that the accessors of a GLB announce; 0 if it is not valid, which its loader will say."""
    (length,) = struct.unpack_from("<I", data, 12)
    try:
        document = json.loads(data[20 : 20 + length])
        accessors = [item["count"] for item in document["accessors"]]
        parts = [part for mesh in document["meshes"] for part in mesh["primitives"]]
        counts = [accessors[part.get("indices", part["attributes"]["POSITION"])] for part in parts]
    except (ValueError, KeyError, IndexError, TypeError, RecursionError):
        return 0
    return sum(count for count in counts if isinstance(count, int)) // 3


def _pieces(name: str, scene: Any) -> list[Surface]:
    """Every mesh of a scene where it is placed."""
    found: list[Surface] = []
    total = 0
    for node in scene.graph.nodes_geometry:
        T, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        total += len(mesh.faces)
        if total > PARSED:
            raise TooLargeError(f"mesh {name}: triangles", f"more than {PARSED}", f"at most {PARSED} in a file")
        T = np.asarray(T, dtype=float)
        points = np.asarray(mesh.vertices, dtype=float) @ T[:3, :3].T + T[:3, 3]
        points *= _metres(mesh)
        if not np.isfinite(points).all():
            raise MeshError(f"mesh {name}: vertices", "nan or infinity", "finite numbers")
        faces = np.asarray(mesh.faces, dtype=np.uint32)
        if int(faces.max()) >= len(points):
            raise MeshError(f"mesh {name}: faces", f"vertex {int(faces.max())}", f"one of {len(points)} vertices")
        if np.linalg.det(T[:3, :3]) < 0.0:
            faces = faces[:, ::-1]
        found.append(Surface(_color(mesh), points.astype(np.float32), faces))
    return found


def _metres(mesh: Any) -> float:
    """The unit of a COLLADA file, which trimesh notes and leaves as it is."""
    match = re.fullmatch(r"([0-9.eE+-]+) \* meters", str(mesh.metadata.get("units", "")))
    value = float(match[1]) if match is not None else 1.0
    return value if 1e-6 < value < 1e6 else 1.0


def _color(mesh: Any) -> Rgb | None:
    visual = mesh.visual
    if not visual.defined:
        return None
    material = getattr(visual, "material", None)
    if material is None:
        given = visual.main_color
    else:
        given = getattr(material, "diffuse", None)
        given = getattr(material, "baseColorFactor", None) if given is None else given
        if given is None:
            return None
    red, green, blue = np.asarray(given).tolist()[:3]
    return int(red), int(green), int(blue)


def finished(surface: Surface, share: float) -> Surface:
    """The surface with at most about a share of its triangles, and its sharp edges sharp."""
    points, faces = _welded(surface.points, surface.faces)
    if not len(faces):
        return Surface(surface.color, points[:0], faces)
    if share < 1.0 and len(faces) > LEAST:
        points, faces = fast_simplification.simplify(
            points, faces.astype(np.int32), target_count=max(LEAST, int(share * len(faces)))
        )
    points, faces = _creased(points, faces.astype(np.uint32))
    return Surface(surface.color, points, faces)


def _welded(points: Points, faces: Faces) -> tuple[Points, Faces]:
    """Points in one place made one; triangles without area left out."""
    low = points.min(axis=0)
    size = float((points.max(axis=0) - low).max()) or 1.0
    x, y, z = np.round((points - low) / np.float32(size) / GRID).astype(np.int64).T
    _, first, place = np.unique((x << 42) | (y << 21) | z, return_index=True, return_inverse=True)
    welded = place.astype(np.uint32)[faces]
    a, b, c = welded.T
    return points[first], welded[(a != b) & (b != c) & (c != a)]


def _creased(points: Points, faces: Faces) -> tuple[Points, Faces]:
    """Each point repeated for each of the smooth pieces that meet there: browsers smooth over shared points."""
    corners = faces.reshape(-1).astype(np.int64)
    sides = points[faces]
    normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    count = len(faces)
    start = np.arange(3 * count)
    end = np.roll(start.reshape(count, 3), -1, axis=1).reshape(-1)
    a, b = corners[start], corners[end]
    key = np.minimum(a, b) * len(points) + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    same = key[order[1:]] == key[order[:-1]]
    one, two = order[:-1][same], order[1:][same]
    smooth = np.einsum("ij,ij->i", normals[one // 3], normals[two // 3]) > np.cos(np.radians(CREASE))
    one, two = one[smooth], two[smooth]
    flipped = a[one] == b[two]
    left = np.concatenate([start[one], end[one]])
    right = np.concatenate([np.where(flipped, end[two], start[two]), np.where(flipped, start[two], end[two])])
    label = _spread(3 * count, left, right)
    kept, place = np.unique(label, return_inverse=True)
    return points[corners[kept]], place.reshape(-1, 3).astype(np.uint32)


def _spread(count: int, left: NDArray[np.int64], right: NDArray[np.int64]) -> NDArray[np.int64]:
    """The lowest number of each group of numbers that pairs connect."""
    label = np.arange(count)
    for _ in range(ROUNDS):
        before = label.copy()
        lowest = np.minimum(label[left], label[right])
        np.minimum.at(label, left, lowest)
        np.minimum.at(label, right, lowest)
        label = label[label]
        if np.array_equal(label, before):
            break
    return label
