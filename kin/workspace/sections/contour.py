"""Closed curves between the inside and outside nodes of a grid: marching squares.

Lorensen and Cline's idea (SIGGRAPH 1987) in two dimensions. Each edge of the grid with one end inside carries a
vertex; each square joins its vertices in pairs. A square with four vertices counts as two separate inside corners.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]
Edge = tuple[int, int, int]  # i, j, and 0 for the edge to (i + 1, j), 1 for the one to (i, j + 1)


def ends(edge: Edge, inside: Flags) -> tuple[tuple[int, int], tuple[int, int]]:
    """The end of an edge that is inside, and the one that is not."""
    i, j, way = edge
    a, b = (i, j), (i + 1 - way, j + way)
    return (a, b) if inside[a] else (b, a)


def loops(inside: Flags) -> list[list[Edge]]:
    """The edges that each closed curve crosses, in order, the inside on its left; no rim node may be inside."""
    follows: dict[Edge, Edge] = {}
    for i, j in np.argwhere(_mixed(inside)).tolist():
        corners = [bool(inside[c]) for c in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        sides: list[Edge] = [(i, j, 0), (i + 1, j, 1), (i, j + 1, 0), (i, j, 1)]
        # Counterclockwise around the square, a curve enters where inside ends and leaves where it begins again.
        enter = [k for k in range(4) if corners[k] and not corners[(k + 1) % 4]]
        leave = [k for k in range(4) if not corners[k] and corners[(k + 1) % 4]]
        for k in enter:
            # The corner k is cut off together with those before it that are inside too.
            begin = next(m for m in ((k - d) % 4 for d in range(1, 4)) if m in leave)
            follows[sides[k]] = sides[begin]
    found = []
    while follows:
        edge = next(iter(follows))
        loop = []
        while edge in follows:
            loop.append(edge)
            edge = follows.pop(edge)
        found.append(loop)
    return found


def enclosed(inside: Flags) -> Flags:
    """The outside nodes ``(a, b)`` that cannot be reached from the rim without crossing the inside."""
    outer = np.zeros_like(inside)
    outer[0], outer[-1], outer[:, 0], outer[:, -1] = True, True, True, True
    outer &= ~inside
    while True:
        grown = outer.copy()
        grown[1:] |= outer[:-1]
        grown[:-1] |= outer[1:]
        grown[:, 1:] |= outer[:, :-1]
        grown[:, :-1] |= outer[:, 1:]
        grown &= ~inside
        if (grown == outer).all():
            return ~inside & ~outer
        outer = grown


def _mixed(inside: Flags) -> Flags:
    a, b, c, d = inside[:-1, :-1], inside[1:, :-1], inside[1:, 1:], inside[:-1, 1:]
    return np.asarray((a | b | c | d) & ~(a & b & c & d))
