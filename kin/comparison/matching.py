"""Whether two sets of joint axes belong to one arm: an exact pass over the joints.

Two arms a and b with the same kinds of joints are the same arm if constants B and E (rigid transforms), signs
``s_i = ±1`` and offsets ``o_i`` exist with

    ``T_a(q) = B · T_b(s∘q + o) · E``  for all q.

Differentiate ``T`` at q = 0: this holds exactly if B maps every axis of b, taken at the configuration o, onto ±
the axis of a. E follows then from one pose. So only the axes count; neither the convention nor the way in which
rows share out a link matters.

The pass goes from the base to the tool. It keeps one motion M that maps the axes found so far, and the group G of
all motions that M may still be multiplied with: what leaves those axes in place, and what their joints do. G
contains at most one turn, about one line, and some slides:

- after a revolute joint G holds the turn about its axis, and a slide along it if that is still free;
- after a prismatic joint it holds the slide along it, beside what was free before;
- the next axis uses up what is needed to reach it, and leaves what does not move it.

A turn or a slide in G is the motion of an earlier joint, so the amount that is used up is a part of that joint's
offset; at the beginning it is a motion of the base and nobody's offset.

Each joint may count either way, so both signs are tried at each; a wrong sign fails at the next axis, or is
another valid answer: an arm with a spherical wrist has several. The product of exponentials that this rests on is
in Lynch and Park, Modern Robotics, chapter 4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kin.axes import size
from kin.robot import Robot
from kin.transforms import Array

Vector = tuple[float, float, float]
Rotation = tuple[Vector, Vector, Vector]

NOBODY = -1  # the base: whose motion is no joint's offset
# What makes a mapping less plain: a joint that counts the other way, or from another zero.
FLIP, QUARTER, OFFSET = 2.2, 2.0, 2.9
_MOST_KEPT = 20_000  # states
_ROUNDING = 1e-9  # of sums of costs


class Axis(NamedTuple):
    """A joint's axis at q = 0, in the positive direction of the joint."""

    z: Vector
    p: Vector
    slides: bool


class Motion(NamedTuple):
    """A rigid motion ``x → R x + t`` in plain floats: on three numbers they are ten times faster than arrays."""

    R: Rotation
    t: Vector

    def matrix(self) -> Array:
        """The motion as a transform ``(4, 4)``."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.R, self.t
        return T


IDENTITY = Motion(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0))


class Tolerance(NamedTuple):
    """How far two axes, or two poses, may be apart and still count as one: metres, radians."""

    length: float
    angle: float

    def of(self, robot: Robot) -> Tolerance:
        """The tolerance of an arm of up to a metre for this one."""
        return Tolerance(self.length * max(1.0, size(robot)), self.angle)

    def holds(self, position: float, rotation: float) -> bool:
        """Whether poses that are so far apart count as one."""
        return position <= self.length and rotation <= self.angle


# Poses that count as equal, for an arm of up to a metre: printed tables have seven digits or so.
PRINTED = Tolerance(1e-5, 2e-5)


class Slide(NamedTuple):
    """A free slide: its direction, and how much of each prismatic joint's offset one metre of it is."""

    v: Vector
    weights: tuple[float, ...]


class Turn(NamedTuple):
    """A free turn about a line, as the motion of `joint`; `everywhere`: about all lines of that direction."""

    z: Vector
    p: Vector
    joint: int
    everywhere: bool = False


class Free(NamedTuple):
    """The group G: the motions that leave all axes matched so far where they are."""

    turn: Turn | None
    slides: tuple[Slide, ...]


class Match(NamedTuple):
    """One way to map the first joints of b, or all, onto those of a.

    Attributes:
        signs: ``s_i`` of these joints.
        offsets: ``o_i`` of all joints; that of the last one mapped is 0, it is always free.
        M: ``B · exp(S_1 o_1) … exp(S_{k−1} o_{k−1})`` of b: maps the last of these axes of b onto that of a.
        free: what M may still be multiplied with from the left.
    """

    signs: tuple[int, ...]
    offsets: tuple[float, ...]
    M: Motion
    free: Free


class Matching:
    """The pass over the joints of one arm a, for many arms b.

    Tables that differ in one row have the axes before it in common: what was found for these is kept, as a tree.
    """

    def __init__(self, a: Sequence[Axis], tolerance: Tolerance) -> None:
        self._a, self._tolerance = a, tolerance
        self._first: dict[Axis, list[_Node]] = {}
        self._kept = 0

    def matches(self, b: Sequence[Axis], most: float = math.inf) -> tuple[list[Match], int]:
        """All ways, one per vector of signs, to map the axes of b onto those of a.

        Args:
            b: axes at q = 0, of the same number and kinds as those of a.
            most: ways whose senses and settled offsets cost as much are left out.

        Returns:
            the matches, and the first joint (from 0) whose axis no choice could bring onto its counterpart, if
            there is none.
        """
        if self._kept > _MOST_KEPT:
            self._first, self._kept = {}, 0
        n = len(self._a)
        most += _ROUNDING
        axes: dict[int, Axis] = {}
        found, reached = [], 0
        stack = self._started(b[0])[::-1]
        while stack:
            node = stack.pop()
            i = len(node.state.signs)
            if node.cost >= most:
                continue
            reached = max(reached, i)
            if i == n:
                found.append(node.state)
                continue
            if i not in axes:
                axes[i] = b[i]
            stack += self._continued(node, axes[i], i, most)
        return found, min(reached, n - 1)

    def _started(self, b: Axis) -> list[_Node]:
        if b not in self._first:
            zero = (0.0,) * len(self._a)
            states = [
                Match((sign,), zero, *_first(self._a[0], b, sign, len(self._a), self._tolerance))
                for sign in (1, -1)
            ]
            self._first[b] = [_Node(state, FLIP if state.signs[0] < 0 else 0.0, {}) for state in states]
        return self._first[b]

    def _continued(self, node: _Node, b: Axis, i: int, most: float) -> list[_Node]:
        """What a state becomes with one more axis for less, the usual sense last."""
        state = node.state
        if b not in node.after:
            node.after[b] = _attempt(state, self._a[i], b, self._tolerance)
        attempt = node.after[b]
        found = []
        for sign in attempt.senses:
            if sign not in attempt.found and (sign > 0 or node.cost + FLIP < most):
                after = _next(state, self._a[i], b, attempt, sign, i, self._tolerance)
                self._kept += 1
                attempt.found[sign] = (
                    None if after is None else _Node(after, node.cost + self._added(state, after), {})
                )
            if (known := attempt.found.get(sign)) is not None:
                found.append(known)
        return found

    def _added(self, before: Match, after: Match) -> float:
        """What one more joint costs: its sense, and the offset of the last that turned, if it is settled."""
        cost = FLIP if after.signs[-1] < 0 else 0.0
        settled, turn = before.free.turn, after.free.turn
        if settled is not None and settled.joint > 0 and (turn is None or turn.joint != settled.joint):
            offset = math.remainder(after.offsets[settled.joint], 2.0 * math.pi)
            cost += offset_cost(offset, self._tolerance)
        return cost


class _Node(NamedTuple):
    """A state, and what became of it with each next axis.

    Attributes:
        cost: of the senses, and of the offsets that no later axis and no choice of base and tool can alter. Those
            of the first joint and of the last one that turns can be shared with a frame, those of slides with each
            other.
    """

    state: Match
    cost: float
    after: dict[Axis, _Attempt]


class _Attempt(NamedTuple):
    """A next axis, and what becomes of the state in each sense that has been tried.

    Attributes:
        z, p: the axis of b where the state maps it.
        along: whether the axis of a is parallel to the line of the free turn.
        senses: those that may bring it onto that of a.
    """

    z: Vector
    p: Vector
    along: bool
    senses: list[int]
    found: dict[int, _Node | None]


def offset_cost(offset: float, tolerance: Tolerance) -> float:
    """What an angle within ±π as an offset costs."""
    if abs(offset) <= tolerance.angle:
        return 0.0
    quarters = offset / (0.5 * math.pi)
    return QUARTER if abs(quarters - round(quarters)) < 1e-6 else OFFSET


def _first(a: Axis, b: Axis, sign: int, n: int, tolerance: Tolerance) -> tuple[Motion, Free]:
    """A motion that maps the first axis, none if it is there already, and what is free then."""
    none = (0.0,) * n
    z = _scaled(b.z, sign)
    M = IDENTITY
    if _distance(z, a.z) > tolerance.angle:
        M = Motion(_between(z, a.z), (0.0, 0.0, 0.0))
    if a.slides:
        return M, Free(Turn(a.z, a.p, NOBODY, True), tuple(Slide(v, none) for v in IDENTITY.R))
    p = _apply(M, b.p)
    apart = _across(_minus(a.p, p), a.z)
    if _norm(apart) > tolerance.length:
        M = Motion(M.R, _plus(M.t, apart))
    return M, Free(Turn(a.z, a.p, 0), (Slide(a.z, none),))


def _attempt(state: Match, a: Axis, b: Axis, tolerance: Tolerance) -> _Attempt:
    """One more axis of b, and the senses in which it may be brought onto that of a."""
    M, turn = state.M, state.free.turn
    z, p = _rotate(M.R, b.z), _apply(M, b.p)
    along = turn is not None and _parallel(a.z, turn.z, tolerance.angle)
    if turn is None or along:
        senses = [sign for sign in (-1, 1) if _distance(_scaled(z, sign), a.z) <= tolerance.angle]
        return _Attempt(z, p, along, senses, {})
    # No turn alters the angle to its own line, nor the moment about it.
    angles, moments, rounding = (_dot(z, turn.z), _dot(a.z, turn.z)), (0.0, 0.0), 0.0
    if not (a.slides or turn.everywhere):
        here, there = _minus(p, turn.p), _minus(a.p, turn.p)
        moments = _dot(here, cross(turn.z, z)), _dot(there, cross(turn.z, a.z))
        rounding = 2.0 * (tolerance.length + tolerance.angle * (_norm(here) + _norm(there)))
    senses = [
        sign
        for sign in (-1, 1)
        if abs(sign * angles[0] - angles[1]) <= tolerance.angle and abs(sign * moments[0] - moments[1]) <= rounding
    ]
    return _Attempt(z, p, along, senses, {})


def _next(
    state: Match, a: Axis, b: Axis, attempt: _Attempt, sign: int, i: int, tolerance: Tolerance
) -> Match | None:
    """The state with one more axis; None if this sign cannot bring it onto that of a."""
    p, along = attempt.p, attempt.along
    signs, offsets, M, (turn, slides) = state
    angle = 0.0  # of the free turn, as far as it is used up
    if turn is not None and not along:
        z = _scaled(attempt.z, sign)
        left = _distance(z, a.z)
        if left > 0.0 and _norm(flat := _across(z, turn.z)) > tolerance.angle:
            angle = _angle(flat, _across(a.z, turn.z), turn.z)
            M = _then_turn(M, turn, angle)
            left, p = _distance(_scaled(_rotate(M.R, b.z), sign), a.z), _apply(M, b.p)
        if left > tolerance.angle:
            return None
    changed = list(offsets)
    if not a.slides:
        apart = _across(_minus(a.p, p), a.z)
        if turn is not None and along and not turn.everywhere:
            here, there = _across(_minus(p, turn.p), turn.z), _across(_minus(a.p, turn.p), turn.z)
            if min(_norm(here), _norm(there)) > tolerance.length and _norm(apart) > 0.0:
                angle = _angle(here, there, turn.z)
                M = _then_turn(M, turn, angle)
                apart = _across(_minus(a.p, _apply(M, b.p)), a.z)
        elif slides and _norm(apart) > 0.0:
            M, apart = _slid(M, slides, apart, a.z, signs, changed)
        if _norm(apart) > tolerance.length:
            return None
    if turn is not None and turn.joint != NOBODY:
        changed[turn.joint] += signs[turn.joint] * angle
    return Match(
        (*signs, sign), tuple(changed), M, _free_after(turn, slides, along, a, i, len(offsets), tolerance)
    )


def _free_after(
    turn: Turn | None, slides: tuple[Slide, ...], along: bool, a: Axis, i: int, n: int, tolerance: Tolerance
) -> Free:
    """What leaves axis i in place too, and the motion of joint i."""
    weights = _combination(slides, a.z, tolerance.angle)
    if a.slides:
        if weights is None:
            slides = (*slides, Slide(a.z, tuple(float(k == i) for k in range(n))))
        return Free(turn if along else None, slides)
    left = () if weights is None else (Slide(a.z, weights),)
    about = turn is not None and along and not turn.everywhere
    if turn is not None and about and _norm(_across(_minus(a.p, turn.p), turn.z)) <= tolerance.length:
        return Free(turn, left)  # both joints turn about one line
    return Free(Turn(a.z, a.p, i), left)


def _combination(slides: tuple[Slide, ...], z: Vector, tolerance: float) -> tuple[float, ...] | None:
    """The weights of the slide along z, None if the free slides do not contain it."""
    if not slides:
        return None
    if len(slides) == 1:
        share = _dot(slides[0].v, z)
        if _distance(_scaled(slides[0].v, share), z) > tolerance:
            return None
        return tuple([share * weight for weight in slides[0].weights])
    V = np.array([s.v for s in slides]).T
    shares = np.linalg.lstsq(V, np.array(z), rcond=1e-9)[0]
    if float(np.linalg.norm(V @ shares - z)) > tolerance:
        return None
    return tuple((shares @ np.array([s.weights for s in slides])).tolist())


def _slid(
    M: Motion, slides: tuple[Slide, ...], apart: Vector, z: Vector, signs: tuple[int, ...], offsets: list[float]
) -> tuple[Motion, Vector]:
    """M after the free slides that bring an axis of direction z nearest; what remains between the lines."""
    across = [_across(slide.v, z) for slide in slides]
    if len(slides) > 1:
        shares = np.linalg.lstsq(np.array(across).T, np.array(apart), rcond=1e-9)[0].tolist()
    else:
        length = _dot(across[0], across[0])
        shares = [_dot(across[0], apart) / length if length > 0.0 else 0.0]
    t, left = M.t, apart
    for share, slide, part in zip(shares, slides, across, strict=True):
        t = _plus(t, _scaled(slide.v, share))
        left = _minus(left, _scaled(part, share))
        for j, weight in enumerate(slide.weights):
            if weight:
                offsets[j] += signs[j] * weight * share
    return Motion(M.R, t), left


# -- three numbers ---------------------------------------------------------------------------------------------


def _dot(a: Vector, b: Vector) -> float:
    x, y, z = a
    u, v, w = b
    return x * u + y * v + z * w


def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    x, y, z = a
    u, v, w = b
    return y * w - z * v, z * u - x * w, x * v - y * u


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _scaled(a: Vector, share: float) -> Vector:
    return share * a[0], share * a[1], share * a[2]


def _norm(a: Vector) -> float:
    x, y, z = a
    return math.sqrt(x * x + y * y + z * z)


def _distance(a: Vector, b: Vector) -> float:
    """|a − b|."""
    x, y, z = a
    u, v, w = b
    x, y, z = x - u, y - v, z - w
    return math.sqrt(x * x + y * y + z * z)


def _across(a: Vector, z: Vector) -> Vector:
    """The part of a that is perpendicular to the unit vector z."""
    x, y, w = a
    u, v, t = z
    along = x * u + y * v + w * t
    return x - along * u, y - along * v, w - along * t


def _parallel(a: Vector, b: Vector, tolerance: float) -> bool:
    return _norm(cross(a, b)) <= tolerance


def _angle(a: Vector, b: Vector, z: Vector) -> float:
    """The turn about z that takes the direction of a to that of b, both perpendicular to z."""
    return math.atan2(_dot(cross(a, b), z), _dot(a, b))


def _rotate(R: Rotation, a: Vector) -> Vector:
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = R
    x, y, z = a
    return a1 * x + a2 * y + a3 * z, b1 * x + b2 * y + b3 * z, c1 * x + c2 * y + c3 * z


def _apply(M: Motion, a: Vector) -> Vector:
    ((a1, a2, a3), (b1, b2, b3), (c1, c2, c3)), (u, v, w) = M
    x, y, z = a
    return a1 * x + a2 * y + a3 * z + u, b1 * x + b2 * y + b3 * z + v, c1 * x + c2 * y + c3 * z + w


def _about(z: Vector, angle: float) -> Rotation:
    """The rotation about a unit vector (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, w = z
    k = 1.0 - c
    return (
        (c + k * x * x, k * x * y - s * w, k * x * w + s * y),
        (k * x * y + s * w, c + k * y * y, k * y * w - s * x),
        (k * x * w - s * y, k * y * w + s * x, c + k * w * w),
    )


def _between(a: Vector, b: Vector) -> Rotation:
    """A rotation that takes one unit vector to another: by the smaller angle, half a turn about any normal."""
    normal = cross(a, b)
    sine = _norm(normal)
    if sine > 1e-9:
        return _about(_scaled(normal, 1.0 / sine), math.atan2(sine, _dot(a, b)))
    if _dot(a, b) > 0.0:
        return IDENTITY.R
    smallest = min(range(3), key=lambda k: abs(a[k]))
    normal = _across((float(smallest == 0), float(smallest == 1), float(smallest == 2)), a)
    return _about(_scaled(normal, 1.0 / _norm(normal)), math.pi)


def _then_turn(M: Motion, turn: Turn, angle: float) -> Motion:
    """M, then a turn about the line."""
    R = _about(turn.z, angle)
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = R
    (x1, x2, x3), (y1, y2, y3), (z1, z2, z3) = M.R
    product = (
        (a1 * x1 + a2 * y1 + a3 * z1, a1 * x2 + a2 * y2 + a3 * z2, a1 * x3 + a2 * y3 + a3 * z3),
        (b1 * x1 + b2 * y1 + b3 * z1, b1 * x2 + b2 * y2 + b3 * z2, b1 * x3 + b2 * y3 + b3 * z3),
        (c1 * x1 + c2 * y1 + c3 * z1, c1 * x2 + c2 * y2 + c3 * z2, c1 * x3 + c2 * y3 + c3 * z3),
    )
    return Motion(product, _plus(_rotate(R, _minus(M.t, turn.p)), turn.p))
