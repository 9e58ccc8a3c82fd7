"""Capsules around a body made of triangles and balls: one, or a few where one would be much larger than the body.

The body is cut by planes, always where this makes the capsules smallest, and of one to `MOST` pieces the number is
taken that is worth it. Each triangle belongs to one piece, and the capsule of a piece holds all its triangles
wholly; long triangles are halved first, so that a cut does not leave them across both pieces.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.fitting.capsule import COARSE, Segment, extremes, quick, rounded, smallest
from kin.transforms import Array

MOST = 5  # capsules of a body
WORTH = 0.95  # of the volume: what one more capsule has to leave
CUTS = (0.12, 0.24, 0.36, 0.5, 0.64, 0.76, 0.88)  # where a piece is cut, as a share of its length
LONG = 1.0 / 12.0  # of the body's size: longer triangles are halved
HALVED = 60_000  # triangles that halving may leave
LARGE, CELLS = 80_000, 256  # more triangles than this are joined on a grid with so many cells
LOOKED_AT = 2000  # triangles by which cuts are chosen

Mask = NDArray[np.bool_]


class _Piece(NamedTuple):
    """A part of a body: which of the elements that are looked at, which of all, and the volume of its capsule."""

    seen: Mask
    every: Mask
    volume: float


class _Cut(NamedTuple):
    """A plane through a piece, and the volumes of the capsules below and above it."""

    normal: Array
    height: float
    volumes: tuple[float, float]


def capsules_around(triangles: Array, balls: Array | None = None, most: int = MOST) -> list[Segment]:
    """Capsules that hold all of a body; none if there is nothing to hold.

    Args:
        triangles: ``(k, 3, 3)``, corners in metres.
        balls: ``(b, 2, 4)``: pairs of balls (x, y, z, r); what lies between the two of a pair belongs to the body.
        most: the largest number of capsules.
    """
    parts = _elements(triangles, np.empty((0, 2, 4)) if balls is None else balls)
    if not len(parts):
        return []
    halved = _halved(parts)
    groups = _groups(halved, most)
    # A plane chosen by some of the elements may have none of them on one side.
    return [smallest(halved[group].reshape(-1, 4)) for group in groups if group.any()]


def capsule_around(triangles: Array, balls: Array) -> Segment:
    """One capsule that holds all of a body, found quickly and not the smallest; arguments as `capsules_around`."""
    points = _elements(triangles, balls).reshape(-1, 4)
    size = float(np.ptp(points[:, :3], axis=0).max()) + float(points[:, 3].max())
    return rounded(points, quick(extremes(points, COARSE))[1], size)


def _elements(triangles: Array, balls: Array) -> Array:
    """Triangles and pairs of balls as ``(k, 3, 4)``: the hull of three balls each."""
    flat = np.zeros((len(triangles), 3, 4))
    flat[..., :3] = triangles
    if len(flat) > LARGE:
        flat = _joined(flat)
    return np.concatenate([flat, balls[:, [0, 1, 1]]])


def _joined(flat: Array) -> Array:
    """The triangles with the corners in each cell of a grid replaced by a ball around them."""
    points = flat[..., :3].reshape(-1, 3)
    low = points.min(axis=0)
    cell = float((points.max(axis=0) - low).max()) / CELLS or 1.0
    x, y, z = ((points - low) / cell).astype(np.int64).T
    key, place = np.unique((x << 40) | (y << 20) | z, return_inverse=True)
    centre = low + (np.column_stack([key >> 40, key >> 20 & 0xFFFFF, key & 0xFFFFF]) + 0.5) * cell
    out = np.zeros(len(key))
    np.maximum.at(out, place, np.linalg.norm(points - centre[place], axis=1))
    corners = np.unique(np.sort(place.reshape(-1, 3), axis=1), axis=0)
    return np.concatenate([centre, out[:, None]], axis=1)[corners]


def _halved(parts: Array) -> Array:
    """The elements with the longest edges halved, until they are short."""
    size = float(np.ptp(parts[..., :3].reshape(-1, 3), axis=0).max())
    limit = (LONG * size) ** 2
    while True:
        edges = parts - np.roll(parts, -1, axis=1)
        square = np.einsum("kei,kei->ke", edges[..., :3], edges[..., :3])
        longest = square.argmax(axis=1)
        long = square.max(axis=1) > limit
        long &= (parts[..., 3] == parts[:, :1, 3]).all(axis=1)  # the middle of balls of two sizes is between them
        count = int(long.sum())
        if not count or len(parts) + count > HALVED:
            return parts
        chosen, at = parts[long], longest[long]
        rows = np.arange(count)
        following = (at + 1) % 3
        middle = 0.5 * (chosen[rows, at] + chosen[rows, following])
        first, second = chosen.copy(), chosen.copy()
        first[rows, following] = middle
        second[rows, at] = middle
        parts = np.concatenate([parts[~long], first, second])


def _groups(parts: Array, most: int) -> list[Mask]:
    """Which elements each piece has, for the number of pieces that is worth it."""
    centres = parts[..., :3].mean(axis=1)
    step = max(1, len(parts) // LOOKED_AT)
    order = np.random.default_rng(0).permutation(len(parts))[::step]
    seen, places = parts[order], centres[order]
    leaves = [_Piece(np.ones(len(seen), bool), np.ones(len(parts), bool), _size(seen))]
    best, least = [leaves[0].every], leaves[0].volume
    cuts: dict[int, _Cut | None] = {}
    for count in range(2, most + 1):
        for piece in leaves:
            if id(piece) not in cuts:
                cuts[id(piece)] = _cut(seen, places, piece)
        found = [(piece, cut) for piece in leaves if (cut := cuts[id(piece)]) is not None]
        if not found:
            break
        piece, cut = min(found, key=lambda each: sum(each[1].volumes) - each[0].volume)
        low, low_all = places @ cut.normal < cut.height, centres @ cut.normal < cut.height
        leaves = [
            *(each for each in leaves if each is not piece),
            _Piece(piece.seen & low, piece.every & low_all, cut.volumes[0]),
            _Piece(piece.seen & ~low, piece.every & ~low_all, cut.volumes[1]),
        ]
        total = sum(each.volume for each in leaves) / WORTH ** (count - 1)
        if total < least:
            least, best = total, [each.every for each in leaves]
    return best


def _size(parts: Array) -> float:
    return quick(extremes(parts.reshape(-1, 4), COARSE))[0]


def _cut(parts: Array, places: Array, piece: _Piece) -> _Cut | None:
    """The best plane for a piece; None for a single element."""
    mine, at = parts[piece.seen], places[piece.seen]
    if len(mine) < 2:
        return None
    axis = quick(extremes(mine.reshape(-1, 4), COARSE))[1]
    ways = list(np.linalg.eigh(np.cov(at.T))[1].T)
    length = float(np.linalg.norm(axis[3:] - axis[:3]))
    if length > 0.0:
        ways.append((axis[3:] - axis[:3]) / length)
    best: _Cut | None = None
    for way in ways:
        along = at @ way
        start, end = float(along.min()), float(along.max())
        for share in CUTS:
            height = start + share * (end - start)
            low = along < height
            if low.all() or not low.any():
                continue
            volumes = _size(mine[low]), _size(mine[~low])
            if best is None or sum(volumes) < sum(best.volumes):
                best = _Cut(way, height, volumes)
    return best
