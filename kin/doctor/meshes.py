"""How large a mesh is, from the bytes of its file: enough to tell metres from millimetres."""

from __future__ import annotations

import numpy as np

from kin.transforms import Array

_HEAD, _FACE = 84, 50  # bytes of a binary STL before its faces, and of each face
_UNITLESS = (".stl", ".obj")
_WITH_UNITS = (".dae", ".glb", ".gltf")


def extent_of(name: str, data: bytes) -> Array | None:
    """The sides ``(3,)`` of a mesh along x, y and z, in whatever unit its file is in.

    Returns:
        None for formats that state their unit: DAE and glTF.

    Raises:
        LookupError: with the reason why there is none.
    """
    kind = name[name.rfind(".") :].lower()
    if kind in _WITH_UNITS:
        if not data:
            raise LookupError("the file is empty")
        return None
    if kind not in _UNITLESS:
        raise LookupError("it is no STL, OBJ, DAE or GLB")
    points = _of_obj(data) if kind == ".obj" else _of_stl(data)
    if not len(points) or not np.isfinite(points).all():
        raise LookupError("the file has no triangles")
    return np.asarray(points.max(axis=0) - points.min(axis=0), dtype=np.float64)


def _of_stl(data: bytes) -> Array:
    """The corners of an STL: binary, which has as many bytes as its number of faces says, or text."""
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEAD else 0
    if count and len(data) >= _HEAD + _FACE * count:
        faces = np.frombuffer(data, np.uint8, _FACE * count, _HEAD).reshape(count, _FACE)
        return np.ascontiguousarray(faces[:, 12:48]).view("<f4").reshape(-1, 3).astype(np.float64)
    if not data.lstrip().startswith(b"solid"):
        raise LookupError("the file is no STL, or ends too early")
    return _numbers(data, b"vertex")


def _of_obj(data: bytes) -> Array:
    return _numbers(data, b"v")


def _numbers(data: bytes, word: bytes) -> Array:
    """The three numbers after a word at the beginning of lines."""
    parts = (line.split(None, 4) for line in data.splitlines())
    rows = [row[1:4] for row in parts if row[:1] == [word]]
    try:
        points = np.array([[float(x) for x in row] for row in rows], dtype=np.float64)
    except ValueError:
        raise LookupError("the file has a corner that is no three numbers") from None
    if points.size and (points.ndim != 2 or points.shape[1] != 3):
        raise LookupError("the file has a corner that is no three numbers")
    return points.reshape(-1, 3)
