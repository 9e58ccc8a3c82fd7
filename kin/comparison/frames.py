"""The frames, signs and zeros between two tables of one arm.

Where the axes match (:mod:`kin.comparison.matching`), B, E, signs and offsets are not unique. A turn of the base
and an offset of joint 1 cannot be separated, nor can the tool and the last joint; an arm with a spherical wrist
can be mapped with several vectors of signs. The plainest mapping is chosen: each base or tool that is not the
identity, each joint that counts the other way and each offset costs something, and a quarter turn costs less than
another angle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from kin.angles import wrapped
from kin.axes import inverse
from kin.comparison.matching import (
    FLIP,
    NOBODY,
    QUARTER,
    Axis,
    Match,
    Matching,
    Tolerance,
    cross,
    offset_cost,
)
from kin.comparison.tables import Tables
from kin.dh.exponentials import screws
from kin.fk import fk
from kin.robot import KIND_CODES, Robot
from kin.transforms import Array

FRAME = 4.6  # what makes a mapping less plain, beside senses and zeros; only the order of sums matters
LEAST = QUARTER  # cost of any mapping that is not trivial
_NO_TURN = np.eye(3)
_LAST = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Mapping:
    """``T_a(q) = base · T_b(signs∘q + offsets) · tool``.

    Attributes:
        base, tool: ``(4, 4)``.
        signs: ``(n,)`` ±1.
        offsets: ``(n,)`` radians or metres.
    """

    base: Array
    tool: Array
    signs: Array
    offsets: Array

    def to_b(self, q: Array) -> Array:
        """The configurations of b ``(..., n)`` for those of a."""
        return self.signs * q + self.offsets

    def poses(self, b: Robot, q: Array) -> Array:
        """``base · T_b(…) · tool`` ``(..., 4, 4)`` for configurations of a."""
        return self.base @ fk(b, self.to_b(q)) @ self.tool

    def cost(self, tolerance: Tolerance) -> float:
        """How far this is from no mapping at all."""
        total = 0.0
        for T in (self.base, self.tool):
            total += 0.0 if is_identity(T, tolerance) else FRAME
        total += FLIP * float(np.count_nonzero(self.signs < 0.0))
        return total + sum(offset_cost(offset, tolerance) for offset in self.offsets.tolist())

    @property
    def is_trivial(self) -> bool:
        """Whether it maps nothing."""
        frames = np.array_equal(self.base, np.eye(4)) and np.array_equal(self.tool, np.eye(4))
        return frames and bool((self.signs > 0.0).all() and not self.offsets.any())


def no_mapping(n: int) -> Mapping:
    """The trivial mapping of n joints."""
    return Mapping(np.eye(4), np.eye(4), np.ones(n), np.zeros(n))


def is_identity(T: Array, tolerance: Tolerance) -> bool:
    """Whether a transform ``(4, 4)`` is the identity within a tolerance."""
    if math.hypot(*T[:3, 3].tolist()) > tolerance.length:
        return False
    # ‖R − I‖ = √8 sin(θ/2)
    chord = math.hypot(*(T[:3, :3] - _NO_TURN).ravel().tolist())
    return chord <= math.sqrt(8.0) * math.sin(0.5 * min(math.pi, tolerance.angle))


class Side(NamedTuple):
    """What is compared of an arm.

    Attributes:
        axes: at q = 0.
        zero: ``(4, 4)`` pose of the tool at q = 0.
        S: ``(6, n)`` screws of the axes, in the world.
    """

    axes: Sequence[Axis]
    zero: Array
    S: Array

    @classmethod
    def several(cls, tables: Tables) -> list[Side]:
        """Those of many tables of one shape."""
        rows = tables.joint_rows
        lines = tables.zero
        z, p = lines.z[:, 0, rows], lines.z_point[:, 0, rows]
        slides = tables.kinds[:, rows] == KIND_CODES["prismatic"]
        omega = np.where(slides[..., None], 0.0, z)
        v = np.where(slides[..., None], z, np.cross(p, z))
        S = np.concatenate([omega, v], axis=-1).swapaxes(-1, -2)
        return [
            cls(_Axes(*each[:3]), *each[3:]) for each in zip(z, p, slides.tolist(), lines.T[:, 0], S, strict=True)
        ]


class _Axes(Sequence[Axis]):
    """Axes from arrays ``(n, 3)``, each made when it is asked for: most arms fail at one of the first."""

    def __init__(self, z: Array, p: Array, slides: Sequence[bool]) -> None:
        self._z, self._p, self._slides = z, p, slides

    def __len__(self) -> int:
        return len(self._slides)

    def __getitem__(self, i: Any) -> Any:
        return Axis(tuple(self._z[i].tolist()), tuple(self._p[i].tolist()), self._slides[i])


@lru_cache(maxsize=32)
def _side(robot: Robot) -> Side:
    (side,) = Side.several(Tables.of(robot))
    return side._replace(axes=tuple(side.axes))


class Reference:
    """An arm a, onto which others are mapped.

    Attributes:
        robot: the arm.
        tolerance: up to which axes count as one.
    """

    def __init__(self, a: Robot, tolerance: Tolerance) -> None:
        self.robot, self.tolerance = a, tolerance
        self._a = _side(a)
        self._matching = Matching(self._a.axes, tolerance)

    def plainest_of(self, b: Robot) -> tuple[Mapping, int] | int:
        """The plainest mapping of an arm b onto a.

        Returns:
            the mapping and the number of vectors of signs with which there is one; without any, the first joint
            (from 0) whose axis cannot be matched.
        """
        found = self.plainest(_side(b))
        assert found is not None
        return found

    def plainest(
        self, b: Side, most: float = math.inf, frames: float | None = None
    ) -> tuple[Mapping, int] | int | None:
        """The plainest mapping of b onto a.

        Args:
            most: a mapping must cost less.
            frames: what base and tool cost at least, where that is known.

        Returns:
            the mapping and the number of vectors of signs with which there is one that may cost less; without any,
            the first joint (from 0) whose axis cannot be matched, or None if there may be one that costs more.
        """
        a, tolerance = self._a, self.tolerance
        if frames is None:
            frames = _frames_needed(a, b, tolerance)
        found, furthest = self._matching.matches(b.axes, most - frames)
        if not found:
            return furthest if most == math.inf else None
        best, least = None, most
        for match in sorted(found, key=lambda match: match.signs.count(-1)):
            senses = frames + FLIP * match.signs.count(-1)
            if senses >= least:
                break
            for M, offsets in _ends(match, a, b, tolerance):
                zeros = _clean_offsets(offsets, b.S, tolerance).tolist()[1:]
                if senses + sum((offset_cost(offset, tolerance) for offset in zeros), 0.0) >= least:
                    continue
                for mapping in _candidates(match.signs, M, offsets, a, b, tolerance):
                    if (cost := mapping.cost(tolerance)) < least:
                        best, least = mapping, cost
        return None if best is None else (best, len(found))


def _frames_needed(a: Side, b: Side, tolerance: Tolerance) -> float:
    """What base and tool cost at least: without them, first and last axis have to be where they are."""
    first = _same_line(a.axes[0], b.axes[0], tolerance)
    last = _same_line(_seen_from(a.zero, a.axes[-1]), _seen_from(b.zero, b.axes[-1]), tolerance)
    return FRAME * (not first) + FRAME * (not last)


def _seen_from(T: Array, axis: Axis) -> Axis:
    """An axis in the coordinates of a frame."""
    R = T[:3, :3].T
    return Axis(tuple((R @ axis.z).tolist()), tuple((R @ (axis.p - T[:3, 3])).tolist()), axis.slides)


def _same_line(one: Axis, other: Axis, tolerance: Tolerance) -> bool:
    """Whether two axes may be one line; of slides, only the direction counts. Without it a frame is needed."""
    turned = math.hypot(*cross(one.z, other.z)) > 10.0 * tolerance.angle
    apart = cross((other.p[0] - one.p[0], other.p[1] - one.p[1], other.p[2] - one.p[2]), one.z)
    return not turned and (one.slides or math.hypot(*apart) <= 10.0 * tolerance.length)


def _ends(match: Match, a: Side, b: Side, tolerance: Tolerance) -> Iterator[tuple[Array, Array]]:
    """M and the offsets of one vector of signs: with a tool, and with offsets of the last joints instead."""
    M = match.M.matrix()
    yield M, np.array(match.offsets)
    if (closed := _closing(match, M, a.zero, b.zero, tolerance)) is not None:
        yield closed


def _candidates(
    senses: Sequence[int], M: Array, offsets: Array, a: Side, b: Side, tolerance: Tolerance
) -> Iterator[Mapping]:
    """Mappings with or without an offset of the first joint."""
    signs, columns = np.array(senses, dtype=float), b.S.T.tolist()
    product = np.eye(4)  # exp(S_1 o_1) … exp(S_n o_n)
    for column, offset in zip(columns, offsets.tolist(), strict=True):
        if offset:
            product = product @ _exp(column, offset)
    B = M @ inverse(product)
    E = _clean(inverse(M @ b.zero) @ a.zero, tolerance)
    for first in {float(offsets[0]), 0.0, _first_offset(a.axes[0], signs[0], B, offsets[0], tolerance)}:
        chosen = offsets.copy()
        chosen[0] = first
        # B exp(S_1 o_1) stays what it is.
        moved = B @ _exp(columns[0], float(offsets[0]) - first)
        yield Mapping(_clean(moved, tolerance), E, signs, _clean_offsets(chosen, b.S, tolerance))


def _first_offset(axis: Axis, sign: float, B: Array, offset: float, tolerance: Tolerance) -> float:
    """The offset of joint 1 that takes over the part of B along its axis."""
    z = np.array(axis.z)
    if axis.slides:
        return offset + sign * float(B[:3, 3] @ z)
    angle = _turn_about(B[:3, :3], z, tolerance)
    return offset if angle is None else offset + sign * angle


def _closing(
    match: Match, M: Array, zero_a: Array, zero_b: Array, tolerance: Tolerance
) -> tuple[Array, Array] | None:
    """M and the offsets with which no tool is needed; None if the last joints cannot do that.

    With E = I, ``T_a(0) = D · M · T_b(0)`` for a motion D that is still free.
    """
    D = zero_a @ inverse(M @ zero_b)
    turn, slides = match.free
    offsets = np.array(match.offsets)
    angle = 0.0
    if np.abs(D[:3, :3] - _NO_TURN).max() > tolerance.angle:
        found = None if turn is None else _turn_about(D[:3, :3], np.array(turn.z), tolerance)
        if turn is None or found is None:
            return None
        angle = found
        if turn.joint != NOBODY:
            offsets[turn.joint] += match.signs[turn.joint] * angle
    turned = np.eye(4)
    if turn is not None:
        turned = _exp([*turn.z, *cross(turn.p, turn.z)], angle)
    left = (D @ inverse(turned))[:3, 3]
    if np.linalg.norm(left) > tolerance.length:
        if not slides:
            return None
        V = np.array([s.v for s in slides]).T
        shares = np.linalg.lstsq(V, left, rcond=1e-9)[0]
        if np.linalg.norm(V @ shares - left) > tolerance.length:
            return None
        offsets += np.array(match.signs) * (shares @ np.array([s.weights for s in slides]))
    return D @ M, offsets


def _exp(S: Sequence[float], value: float) -> Array:
    """The motion ``(4, 4)`` along a unit screw (ω, v) without pitch: `exp_screw` of one value, in few steps."""
    (x, y, z), (u, v, w) = S[:3], S[3:]
    if x == y == z == 0.0:
        return np.array(
            [[1.0, 0.0, 0.0, value * u], [0.0, 1.0, 0.0, value * v], [0.0, 0.0, 1.0, value * w], _LAST]
        )
    s, k = math.sin(value), 1.0 - math.cos(value)
    c = 1.0 - k
    # With v = p × ω, p − R p = sin θ v + (1 − cos θ) ω × v.
    return np.array(
        [
            [c + k * x * x, k * x * y - s * z, k * x * z + s * y, s * u + k * (y * w - z * v)],
            [k * x * y + s * z, c + k * y * y, k * y * z - s * x, s * v + k * (z * u - x * w)],
            [k * x * z - s * y, k * y * z + s * x, c + k * z * z, s * w + k * (x * v - y * u)],
            _LAST,
        ]
    )


def _turn_about(R: Array, z: Array, tolerance: Tolerance) -> float | None:
    """The angle of a rotation about the unit vector z, None if it is about another one."""
    if np.linalg.norm(R @ z - z) > tolerance.angle:
        return None
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    return math.atan2(float(np.cross(x, R @ x) @ z), float(x @ (R @ x)))


def _clean(T: Array, tolerance: Tolerance) -> Array:
    return np.eye(4) if is_identity(T, tolerance) else T


def _clean_offsets(offsets: Array, S: Array, tolerance: Tolerance) -> Array:
    """Angles within ±π, and zero where they are rounding."""
    turns = np.linalg.norm(S[:3], axis=0) > 0.5
    near = np.where(turns, wrapped(offsets), offsets)
    near = np.where(turns & (near + math.pi <= tolerance.angle), math.pi, near)
    small = np.abs(near) <= np.where(turns, tolerance.angle, tolerance.length)
    return np.asarray(np.where(small, 0.0, near))


@lru_cache(maxsize=32)
def free_offsets(a: Robot) -> tuple[tuple[int, ...], ...]:
    """Groups of joints whose offsets cannot be observed from poses, where base and tool are free too.

    A small change δ of the offsets and β of the base leaves all axes where they are if, for every i,
    ``β × S_i + Σ_{j<i} δ_j [S_j, S_i] = 0``. Joints whose δ depend on each other are one group: only a combination
    of their offsets counts.
    """
    S = screws(a).S
    n = a.n
    ad = [_ad(S[:, j]) for j in range(n)]
    A = np.zeros((6 * n, 6 + n))
    for i in range(n):
        A[6 * i : 6 * i + 6, :6] = -_ad(S[:, i])
        for j in range(i):
            A[6 * i : 6 * i + 6, 6 + j] = ad[j] @ S[:, i]
    scale = max(1e-3, float(np.abs(S[3:]).max()))
    A[3::6], A[4::6], A[5::6] = A[3::6] / scale, A[4::6] / scale, A[5::6] / scale
    _, values, Vt = np.linalg.svd(A)
    rank = int(np.count_nonzero(values > 1e-9 * values[0])) if values.size and values[0] > 0.0 else 0
    null = Vt[rank:, 6:]
    free = [j for j in range(n) if np.abs(null[:, j]).max(initial=0.0) > 1e-7]
    return _groups(null, free)


def _groups(null: Array, free: list[int]) -> tuple[tuple[int, ...], ...]:
    """The free joints, together where one's offset fixes another's."""
    groups: list[list[int]] = []
    for j in free:
        for group in groups:
            block = null[:, [*group, j]]
            if np.linalg.matrix_rank(block, tol=1e-7) <= len(group):
                group.append(j)
                break
        else:
            groups.append([j])
    return tuple(tuple(group) for group in groups)


def _ad(S: Array) -> Array:
    """The matrix of the Lie bracket ``[S, ·]`` ``(6, 6)`` for screws (ω, v)."""
    a, b, c, u, v, w = S.tolist()
    return np.array(
        [
            [0.0, -c, b, 0.0, 0.0, 0.0],
            [c, 0.0, -a, 0.0, 0.0, 0.0],
            [-b, a, 0.0, 0.0, 0.0, 0.0],
            [0.0, -w, v, 0.0, -c, b],
            [w, 0.0, -u, c, 0.0, -a],
            [-v, u, 0.0, -b, a, 0.0],
        ]
    )
