"""Directions spread evenly over the sphere: spherical designs.

A spherical t-design is a set of points of the unit sphere over which every polynomial of degree up to t has the
same mean as over the whole sphere (Delsarte, Goethals and Seidel, Spherical codes and designs, Geometriae Dedicata
6, 1977). A share counted over such directions favours none.

12 directions are the corners of an icosahedron. The other sets are made of orbits of the cube's 24 rotations, as
McLaren's snub cube is (Hardin and Sloane, McLaren's improved snub cube and other new spherical designs in three
dimensions, Discrete & Computational Geometry 15, 1996). Of an orbit few means are not zero already, those of the
harmonics that the rotations leave unchanged: one each of degree 4, 6, 8, 9 and 10, two of degree 12. The points
below are roots of them, found by Gauss–Newton.

The sets are turned so that the first direction is straight down: arms whose axes are all vertical have no other.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from kin.errors import InputError
from kin.transforms import Array, frame_from_approach

# Number of directions, and the degree t up to which they are a design.
DESIGNS = {12: 5, 24: 7, 48: 9, 96: 12}
_GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))
_ORBITS = {
    24: ((0.26663540151670473, -0.8662468181078203, -0.422518653761112),),
    48: (
        (-0.9333646931993099, -0.3535421889214719, -0.06195377423186),
        (0.7068416977125505, 0.6397400986197919, 0.30184005796576874),
    ),
    96: (
        (0.6767438514559824, 0.6376037114129716, -0.36807508297754593),
        (-0.017907401826714988, -0.8172597406144805, -0.5759911816430601),
        (0.3363368992603384, 0.39236117170222745, -0.856113427728123),
        (-0.2556179428380575, 0.024197799462606223, 0.9664750042294974),
    ),
}


def spherical_design(count: int) -> Array:
    """Unit vectors ``(count, 3)``, a spherical design of degree ``DESIGNS[count]``; the first is (0, 0, −1).

    Raises:
        InputError: there is no set of this size here.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count not in DESIGNS:
        raise InputError("directions", count, "one of " + ", ".join(map(str, DESIGNS)))
    return _design(count)


@lru_cache
def _design(count: int) -> Array:
    points = _icosahedron() if count == 12 else np.concatenate([_orbit(point) for point in _ORBITS[count]])
    points = -(points @ frame_from_approach(points[0]))
    points[np.abs(points) < 1e-15] = 0.0
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points.flags.writeable = False
    return points


def _icosahedron() -> Array:
    """Its vertices ``(12, 3)``: cyclic permutations of (0, ±1, ±φ)."""
    corners = [(0.0, one, golden) for one in (1.0, -1.0) for golden in (_GOLDEN, -_GOLDEN)]
    return np.array([np.roll(corner, k) for corner in corners for k in range(3)]) / math.hypot(1.0, _GOLDEN)


def _orbit(point: tuple[float, ...]) -> Array:
    """Where the rotations of the cube take a point ``(24, 3)``: permutations with signs, of determinant 1."""
    found = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        parity = float(np.linalg.det(np.eye(3)[list(order)]))
        found += [
            (a * point[order[0]], b * point[order[1]], c * point[order[2]])
            for a in (1.0, -1.0)
            for b in (1.0, -1.0)
            for c in (1.0, -1.0)
            if a * b * c * parity > 0.0
        ]
    return np.array(found)
