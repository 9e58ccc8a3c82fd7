"""Curves of the tool: lines, arcs, splines of poses, and the corners that join two of them.

A curve is a function of s in [0, length]; s is about the distance of the tool point in metres, or `TURN` metres
per radian where it turns more than it moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kin.motion.geometry import tables
from kin.motion.geometry.splines import spline
from kin.motion.geometry.tables import Table
from kin.transforms import Array, rotation_vector, wxyz_from_rotation

TURN = 0.25  # metres that count as much as a radian


class Curve(Protocol):
    """Poses of the tool as a function of s."""

    @property
    def length(self) -> float:
        """Where s ends."""
        ...

    @property
    def metres(self) -> float:
        """How far the tool point travels, about."""
        ...

    def describe(self, table: Table, row: Array) -> None:
        """row ← the numbers of this curve."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Turning:
    """A rotation from R0 by rotation vectors in the base frame, then in the tool's: exp(f·base) R0 exp(f·tool)."""

    R0: Array
    base: Array
    tool: Array

    @property
    def angle(self) -> float:
        """How far it turns, at most."""
        return math.hypot(*self.base) + math.hypot(*self.tool)

    def rotations(self, f: Array) -> Array:
        """Rotations ``(k, 3, 3)`` at parts ``(k,)`` of the way."""
        return np.asarray(rotations(self.base, f) @ self.R0 @ rotations(self.tool, f))


def turning(start: Array, end: Array, two_axis: bool) -> Turning:
    """The rotation from one orientation ``(3, 3)`` to another: about one axis, or about two."""
    if not two_axis:
        return Turning(start, rotation_vector(end @ start.T), np.zeros(3))
    a, b = start[:, 2], end[:, 2]
    axis, angle = np.cross(a, b), math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
    size = float(np.linalg.norm(axis))
    if size < 1e-9:
        axis, size = start[:, 0], 1.0  # the same direction, or the opposite one: any axis across it
        angle = 0.0 if angle < 1.0 else math.pi
    swing = axis / size * angle
    swung = rotations(swing, np.ones(1))[0] @ start
    roll = rotation_vector(swung.T @ end)
    return Turning(start, swing, np.array([0.0, 0.0, roll[2]]) if np.abs(roll[:2]).max() < 1e-7 else roll)


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A straight line of the tool point ``(3,)`` along `way` while the tool turns."""

    start: Array
    way: Array
    turn: Turning

    @property
    def length(self) -> float:
        """Where s ends."""
        return max(self.metres, TURN * self.turn.angle)

    @property
    def metres(self) -> float:
        """How far the tool point travels."""
        return math.hypot(*self.way)

    def describe(self, table: Table, row: Array) -> None:
        """As in `Curve`."""
        tables.line(row, self.length, self.start, self.way)
        tables.turn(row, self.turn.R0, self.turn.base, self.turn.tool)


@dataclass(frozen=True, slots=True, eq=False)
class Arc:
    """A circular arc: centre, two perpendicular radii ``(3,)``, and the angle it covers."""

    centre: Array
    along: Array
    across: Array
    angle: float
    turn: Turning

    @property
    def length(self) -> float:
        """Where s ends."""
        return max(self.metres, TURN * self.turn.angle)

    @property
    def metres(self) -> float:
        """How far the tool point travels."""
        return math.hypot(*self.along) * self.angle

    def describe(self, table: Table, row: Array) -> None:
        """As in `Curve`."""
        tables.arc(row, self.length, self.centre, self.along, self.across, self.angle)
        tables.turn(row, self.turn.R0, self.turn.base, self.turn.tool)


@dataclass(frozen=True, slots=True, eq=False)
class Through:
    """A smooth curve through poses: cubic splines of the points and of the quaternions."""

    knots: Array
    pieces: Array

    @classmethod
    def of(cls, poses: Array) -> Through:
        """Through poses ``(k, 4, 4)``, neighbours different."""
        quaternions = wxyz_from_rotation(poses[:, :3, :3])
        for i in range(1, len(poses)):
            if quaternions[i] @ quaternions[i - 1] < 0.0:
                quaternions[i] *= -1.0
        moves = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
        turns = 2.0 * TURN * np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
        knots = np.concatenate([[0.0], np.cumsum(np.maximum(moves, turns))])
        rows = np.concatenate([poses[:, :3, 3], quaternions], axis=1)
        return cls(knots, natural(knots, rows))

    @property
    def length(self) -> float:
        """Where s ends."""
        return float(self.knots[-1])

    @property
    def metres(self) -> float:
        """How far the tool point travels, about."""
        return self.length

    def describe(self, table: Table, row: Array) -> None:
        """As in `Curve`."""
        table.spline(row, self.knots, self.pieces)


def natural(knots: Array, rows: Array) -> Array:
    """Coefficients of the spline through rows ``(k + 1, m)``: a line, a parabola or a cubic spline."""
    if len(knots) > 3:
        return spline(knots, rows)
    full = np.zeros((len(knots) - 1, rows.shape[1], 4))
    slopes = (rows[1:] - rows[:-1]) / (knots[1:] - knots[:-1])[:, None]
    full[:, :, 0], full[:, :, 1] = rows[:-1], slopes
    if len(knots) == 3:
        bend = (slopes[1] - slopes[0]) / (knots[2] - knots[0])
        h0 = knots[1] - knots[0]
        full[:, :, 2] = bend
        full[0, :, 1] = slopes[0] - bend * h0
        full[1, :, 1] = slopes[0] + bend * h0
    return full


@dataclass(frozen=True, slots=True, eq=False)
class Corner:
    """The way from one curve to the next within a radius (in s) of the point where they meet."""

    before: Curve
    after: Curve
    radius: float

    @property
    def length(self) -> float:
        """Where s ends."""
        return 2.0 * self.radius

    @property
    def metres(self) -> float:
        """How far the tool point travels, at most."""
        return self.length

    def describe(self, table: Table, row: Array) -> None:
        """As in `Curve`."""
        tables.corner(row, self.radius, table.index(self.before), table.index(self.after))


def rotations(vector: Array, f: Array) -> Array:
    """Rotations ``(k, 3, 3)`` by parts ``(k,)`` of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.broadcast_to(np.eye(3), (len(f), 3, 3))
    x, y, z = vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    a = (angle * f)[:, None, None]
    return np.asarray(np.eye(3) + np.sin(a) * K + (1.0 - np.cos(a)) * (K @ K))


def poses(curve: Curve, s: Array) -> Array:
    """Poses of the tool, T_base_tool ``(k, 4, 4)``, on a curve at s ``(k,)``."""
    table, out = Table(), np.empty((len(s), 4, 4))
    which = np.array([table.index(curve)])
    tables.poses_into(table.numbers, which, np.zeros(1), np.zeros(1), np.ascontiguousarray(s), out)
    return out


def arc_through(start: Array, via: Array, end: Array, turn: Turning) -> Arc | Line | tuple[str, str] | None:
    """The arc from `start` by `via` to `end` ``(3,)``; a line if they are in line.

    Two names if these points are the same; None if via is in line with the others but not between them.
    """
    size = max(float(np.linalg.norm(via - start)), float(np.linalg.norm(end - start)), 1e-9)
    names = (("start", start), ("via point", via), ("target", end))
    for i, k in ((0, 1), (1, 2), (0, 2)):
        if np.linalg.norm(names[i][1] - names[k][1]) < 1e-6 * size or size <= 1e-9:
            return names[i][0], names[k][0]
    a, b = via - start, end - start
    normal = np.cross(a, b)
    if np.linalg.norm(normal) < 1e-7 * np.linalg.norm(a) * np.linalg.norm(b):
        return Line(start, b, turn) if 0.0 < a @ b < b @ b else None
    square = float(normal @ normal)
    offset = np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * square)
    centre = start + offset
    along = start - centre
    axis = normal / math.sqrt(square)
    across = np.cross(axis, along)
    angle = math.atan2(float((end - centre) @ across), float((end - centre) @ along)) % (2.0 * math.pi)
    return Arc(centre, along, across, angle, turn)
