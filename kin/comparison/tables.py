"""Many DH tables of one shape at once: poses, axes and their invariants as arrays.

The search for mistakes tries some hundred changes of a table, and thousands of pairs of them. Most are ruled out
by one pose, or by what no choice of frames and zeros can alter: the angle and the distance of neighbouring axes,
and the offset along an axis between the feet of its two common normals. Of a run of parallel axes only one offset
exists, from the first foot to the last.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.comparison.matching import Tolerance
from kin.robot import KIND_CODES, Joint, Kind, Robot
from kin.transforms import Array

THETA, D, A, ALPHA = range(4)
COLUMNS = ("theta", "d", "a", "alpha")
_KINDS: dict[float, Kind] = {code: kind for kind, code in KIND_CODES.items()}
_PARALLEL = 1e-7  # sine
_ZERO = 1e-15  # of cosines: that of π/2 is 6e-17 in floats


@dataclass(frozen=True, eq=False)
class Tables:
    """N tables with m rows each.

    Attributes:
        cells: ``(N, m, 4)`` theta, d, a, alpha.
        kinds: ``(N, m)`` codes of `KIND_CODES`; which rows are fixed is the same in all tables.
        modified: ``(N,)`` whether the convention is Craig's.
        base, tool: ``(N, 4, 4)``.
    """

    cells: Array
    kinds: Array
    modified: NDArray[np.bool_]
    base: Array
    tool: Array

    @classmethod
    def of(cls, robot: Robot) -> Tables:
        """One table."""
        cells = np.array([[row.theta, row.d, row.a, row.alpha] for row in robot.rows])
        kinds = np.array([KIND_CODES[row.kind] for row in robot.rows])
        modified = np.array([robot.convention == "modified"])
        return cls(cells[None], kinds[None], modified, robot.T_world_base[None], robot.T_last_tool[None])

    @classmethod
    def joined(cls, several: Sequence[Tables]) -> Tables:
        """Tables of the same number of rows, one after the other."""
        names = ("cells", "kinds", "modified", "base", "tool")
        return cls(*(np.concatenate([getattr(each, name) for each in several]) for name in names))

    def __len__(self) -> int:
        return len(self.cells)

    @property
    def rows(self) -> int:
        """m."""
        return int(self.cells.shape[1])

    @property
    def joint_rows(self) -> NDArray[np.intp]:
        """The rows of the moving joints."""
        return np.flatnonzero(self.kinds[0] != KIND_CODES["fixed"])

    @cached_property
    def zero(self) -> Chain:
        """The lines of all rows and the tool with all joints at zero; not to be written to."""
        return chain(self, np.zeros((1, len(self.joint_rows))))

    def take(self, index: NDArray[np.intp]) -> Tables:
        """Some of them."""
        taken = Tables(
            self.cells[index], self.kinds[index], self.modified[index], self.base[index], self.tool[index]
        )
        if "zero" in self.__dict__:
            taken.__dict__["zero"] = Chain(*(part[index] for part in self.zero))
        return taken

    def with_cells(self, cells: Array) -> Tables:
        """The same with other cells ``(N, m, 4)``."""
        return Tables(cells, self.kinds, self.modified, self.base, self.tool)

    def repeated(self, times: int) -> Tables:
        """Each of them `times` times in a row."""
        return self.take(np.repeat(np.arange(len(self)), times))

    def robot(self, index: int, like: Robot) -> Robot:
        """One of them as an arm; names, limits and everything else are those of another one's rows."""
        moving = iter(like.joints)
        fixed = iter([row for row in like.rows if row.kind == "fixed"])
        rows = []
        for i in range(self.rows):
            kind = _KINDS[float(self.kinds[index, i])]
            source = next(fixed if kind == "fixed" else moving, None) or Joint(f"row {i + 1}", kind=kind)
            theta, d, a, alpha = self.cells[index, i].tolist()
            if source.kind != kind:
                source = Joint(source.name, kind=kind)
            rows.append(replace(source, theta=theta, d=d, a=a, alpha=alpha))
        n = sum(row.kind != "fixed" for row in rows)
        home = like.home if n == like.n else (0.0,) * n
        return replace(
            like,
            convention="modified" if self.modified[index] else "standard",
            rows=tuple(rows),
            home=home,
            base=self.base[index],
            tool=self.tool[index],
            capsules=(),
            capsules_source="",
        )


class Chain(NamedTuple):
    """Where the rows are: for N tables and Q configurations.

    Attributes:
        z, z_point: ``(N, Q, m, 3)`` direction and a point of the line that theta and d move along.
        x, x_point: the same for alpha and a.
        T: ``(N, Q, 4, 4)`` pose of the tool.
    """

    z: Array
    z_point: Array
    x: Array
    x_point: Array
    T: Array


def chain(tables: Tables, q: Array) -> Chain:
    """The lines of all rows and the tool, for configurations ``(Q, n)``."""
    N, m, Q = len(tables), tables.rows, len(q)
    lines = np.empty((4, N, Q, m, 3))
    T = np.empty((N, Q, 4, 4))
    for modified in (False, True):
        index = np.flatnonzero(tables.modified == modified)
        if index.size:
            part = _chain(tables.take(index), q, modified)
            for whole, piece in zip(lines, part[:4], strict=True):
                whole[index] = piece
            T[index] = part.T
    return Chain(lines[0], lines[1], lines[2], lines[3], T)


def _chain(tables: Tables, q: Array, modified: bool) -> Chain:
    N, m, Q = len(tables), tables.rows, len(q)
    values = np.zeros((m, Q))
    values[tables.joint_rows] = q.T
    turning, sliding = tables.kinds == KIND_CODES["revolute"], tables.kinds == KIND_CODES["prismatic"]
    theta = tables.cells[:, :, THETA, None] + turning[:, :, None] * values  # (N, m, Q)
    d = tables.cells[:, :, D, None] + sliding[:, :, None] * values
    c, s = (part[..., None] for part in _cos_sin(theta))
    a, alpha = tables.cells[:, :, A], tables.cells[:, :, ALPHA]
    ca, sa = (part[:, :, None, None] for part in _cos_sin(alpha))
    x, y, z, p = (np.broadcast_to(tables.base[:, None, :3, k], (N, Q, 3)) for k in range(4))
    lines = np.empty((4, N, Q, m, 3))
    for i in range(m):
        for screw in ("x", "z") if modified else ("z", "x"):
            if screw == "z":
                lines[0, :, :, i], lines[1, :, :, i] = z, p
                x, y = c[:, i] * x + s[:, i] * y, c[:, i] * y - s[:, i] * x
                p = p + d[:, i, :, None] * z
            else:
                lines[2, :, :, i], lines[3, :, :, i] = x, p
                y, z = ca[:, i] * y + sa[:, i] * z, ca[:, i] * z - sa[:, i] * y
                p = p + a[:, i, None, None] * x
    T = np.zeros((N, Q, 4, 4))
    T[..., :3, 0], T[..., :3, 1], T[..., :3, 2], T[..., :3, 3], T[..., 3, 3] = x, y, z, p, 1.0
    return Chain(lines[0], lines[1], lines[2], lines[3], T @ tables.tool[:, None])


def _cos_sin(angles: Array) -> tuple[Array, Array]:
    """Cosines and sines, exactly zero at multiples of 90° as in `exact_cos_sin`."""
    c, s = np.cos(angles), np.sin(angles)
    return np.where(np.abs(c) < _ZERO, 0.0, c), np.where(np.abs(s) < _ZERO, 0.0, s)


class Invariants(NamedTuple):
    """What no frames, signs or zeros can alter; NaN where a quantity does not exist.

    Attributes:
        twist: ``(N, n − 1)`` angle of neighbouring axes as lines, 0 to π/2.
        distance: ``(N, n − 1)`` signed along the common normal; only its size is invariant.
        offset: ``(N, n)`` along each axis between the feet of its two common normals; only its size is invariant.
            Of a run of parallel axes, stated at its last one.
    """

    twist: Array
    distance: Array
    offset: Array

    def agree(self, reference: Invariants, length: float, angle: float) -> Array:
        """How many differ from those of a single table ``(N,)``."""
        wrong = np.abs(self.twist - reference.twist) > angle
        lengths = np.concatenate([np.abs(self.distance), np.abs(self.offset)], axis=1)
        wanted = np.concatenate([np.abs(reference.distance), np.abs(reference.offset)], axis=1)
        exists = ~np.isnan(lengths)
        differ = (np.abs(lengths - wanted) > length) | (exists != ~np.isnan(wanted))
        return np.asarray(wrong.sum(axis=1) + differ.sum(axis=1))


def invariants(tables: Tables, parallel: float = _PARALLEL) -> Invariants:
    """The invariants of the axes of each table."""
    rows = tables.joint_rows
    n = len(rows)
    lines = tables.zero
    z, p = lines.z[:, 0, rows], lines.z_point[:, 0, rows]
    slides = tables.kinds[:, rows] == KIND_CODES["prismatic"]
    w = cross_rows(z[:, :-1], z[:, 1:])
    sine = np.linalg.norm(w, axis=-1)
    cosine = np.abs((z[:, :-1] * z[:, 1:]).sum(axis=-1))
    twist = np.arctan2(sine, cosine)
    e = p[:, 1:] - p[:, :-1]
    lies = sine <= parallel
    safe = np.where(lies, 1.0, sine)
    across = np.linalg.norm(e - (e * z[:, :-1]).sum(axis=-1, keepdims=True) * z[:, :-1], axis=-1)
    distance = np.where(lies, across, (e * w).sum(axis=-1) / safe)
    distance = np.where(slides[:, :-1] | slides[:, 1:], math.nan, distance)
    # Feet of the common normal of each link on its two axes, as lengths from the points p.
    near = (cross_rows(e, z[:, 1:]) * w).sum(axis=-1) / safe**2
    far = (cross_rows(e, z[:, :-1]) * w).sum(axis=-1) / safe**2
    feet = ~lies & ~slides[:, :-1] & ~slides[:, 1:]
    offset = np.full((len(tables), n), math.nan)
    start = np.full((len(tables), 3), math.nan)  # the last foot, carried along a run of parallel axes
    for i in range(1, n):
        arrives = p[:, i] + far[:, i - 1, None] * z[:, i]
        carried = np.where((lies[:, i - 1] & ~slides[:, i])[:, None], start, math.nan)
        start = np.where(feet[:, i - 1, None], arrives, carried)
        if i < n - 1:
            leaves = p[:, i] + near[:, i, None] * z[:, i]
            length = ((leaves - start) * z[:, i]).sum(axis=-1)
            offset[:, i] = np.where(feet[:, i], length, math.nan)
    return Invariants(twist, distance, offset)


@lru_cache(maxsize=32)
def invariants_of(robot: Robot) -> Invariants:
    """The invariants of an arm; not to be written to."""
    return invariants(Tables.of(robot))


class Ends(NamedTuple):
    """The first axis in the world, and the last one seen from the tool: what no zeros or signs can alter.

    Attributes:
        z, p: ``(N, 2, 3)`` direction and a point of both.
        slides: ``(N, 2)`` whether only the direction counts.
    """

    z: Array
    p: Array
    slides: NDArray[np.bool_]

    @classmethod
    def of(cls, tables: Tables) -> Ends:
        """Those of each table."""
        rows = tables.joint_rows[[0, -1]]
        lines = tables.zero
        z, p = lines.z[:, 0, rows].copy(), lines.z_point[:, 0, rows].copy()
        R, t = lines.T[:, 0, :3, :3], lines.T[:, 0, :3, 3]
        z[:, 1] = np.einsum("nji,nj->ni", R, z[:, 1])
        p[:, 1] = np.einsum("nji,nj->ni", R, p[:, 1] - t)
        return cls(z, p, tables.kinds[:, rows] == KIND_CODES["prismatic"])

    def agree(self, others: Ends, tolerance: Tolerance) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether first and last axis of each of the others may lie where those of this single table do."""
        turned = np.linalg.norm(cross_rows(self.z, others.z), axis=-1) <= 10.0 * tolerance.angle
        apart = np.linalg.norm(cross_rows(others.p - self.p, self.z), axis=-1) <= 10.0 * tolerance.length
        same = turned & (apart | others.slides)
        return same[:, 0], same[:, 1]


def cross_rows(a: Array, b: Array) -> Array:
    """a × b of vectors ``(..., 3)``, without the checks of `numpy.cross`."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
