"""Joints: rows of a Denavit–Hartenberg table, rows that follow them, and what a pendant shows of them.

A row is a joint, follows one, or is constant. Two linear maps belong to the joint values q of an arm.

**Rows that follow.** A parallelogram, a belt over the elbow, two fingers on one motor: some axes have no motor
of their own and turn (or slide) by a fixed *ratio* of a joint. URDF calls it mimic, MJCF an equality of two
joints. With q the values of the joints and t those of all moving rows, ``t = A q``: one row of A per moving row,
1 in the column of its joint or the ratio in that of the joint it follows. What is constant in such a relation is
in θ or d of the row.

A row follows one joint. An axis that follows two of them is written as two rows one behind the other, each with
its own ratio, as mechanisms are built: the parallelogram of a palletiser turns the elbow back by joint 2, and
joint 3 turns it forth.

**Where the map acts.** The kernels of kinematics read a row's ratio from `Robot.model`, so searches, clouds and
motions see the joints alone, with the limits that their followers leave them. In the *free arm* (`Robot.free`)
every row moves by itself. Its poses are those of the arm at ``A q``, which is how bodies are drawn and how closed
forms solve an arm of this kind (:mod:`kin.solvers.coupled`).

**Pendants.** A controller may count joints otherwise than the table of the arm does: backwards, from another
zero, or from the horizontal instead of from the link before, as FANUC counts J3. What it shows is a linear map
of joint values, ``shown = B q + c``, which a robot file states joint by joint; joints that it does not name are
shown as they are. All of Kinboard computes with q; the map is for numbers that people read off a pendant or type
into one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from kin.errors import InputError, finite_number, one_of
from kin.transforms import Array

Matrix = tuple[tuple[float, ...], ...]
IDENTITY: Matrix = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))
Kind = Literal["revolute", "prismatic", "fixed"]
KIND_CODES: dict[Kind, float] = {"fixed": 0.0, "revolute": 1.0, "prismatic": 2.0}
FOLLOWS = 2.0  # added to the code of a row that follows a joint
# Fields of a joint that hold the largest value of a quantity.
PEAK_FIELDS = ("velocity", "acceleration", "jerk", "effort")
# Where none are stated: one turn about zero, or one metre of stroke.
DEFAULT_LIMITS: dict[str, tuple[float, float] | None] = {
    "fixed": None,
    "revolute": (-math.pi, math.pi),
    "prismatic": (0.0, 1.0),
}
_PEAKS = ("velocity", "acceleration", "jerk")
_SINGULAR = 1e-9  # of the determinant: below this, joint values do not follow from what is shown


@dataclass(frozen=True, slots=True)
class Joint:
    """One DH row.

    Attributes:
        limits: (lower, upper) in radians or metres; None for a fixed row or an unlimited joint.
        velocity, acceleration, jerk: largest values (rad or m, per second, s² and s³), None if they are not known.
        effort: largest torque or force (N·m or N), None if it is not known.
        follows: name of the row whose joint moves this one; "" for a joint, which moves by itself.
        ratio: by how many times that joint's value it moves (rad or m for each rad or m).

    Raises:
        InputError: a kind that does not exist, a number that is not finite, limits that are not lower and upper, a
            fixed row that follows, or a ratio of a row that follows none.
    """

    name: str
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    kind: Kind = "revolute"
    limits: tuple[float, float] | None = None
    velocity: float | None = None
    effort: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    follows: str = ""
    ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the row; numbers of any type become floats."""
        if not isinstance(self.kind, str) or self.kind not in KIND_CODES:
            raise InputError(f"kind of {self.name}", self.kind, one_of(*KIND_CODES))
        for key in ("theta", "d", "a", "alpha"):
            object.__setattr__(self, key, finite_number(f"{key} of {self.name}", getattr(self, key)))
        for key in PEAK_FIELDS:
            if (value := getattr(self, key)) is not None:
                where = f"{key} of {self.name}"
                if self.kind == "fixed" or not (limit := finite_number(where, value)) > 0.0:
                    raise InputError(where, value, "a positive number, or None for a fixed row")
                object.__setattr__(self, key, limit)
        self._check_following()
        if self.limits is None:
            return
        where = f"limits of {self.name}"
        if self.kind == "fixed":
            raise InputError(where, self.limits, "None, because the row is fixed")
        try:
            lower, upper = self.limits
        except (TypeError, ValueError):
            raise InputError(where, self.limits, "two numbers (lower, upper)") from None
        lower, upper = finite_number(where, lower), finite_number(where, upper)
        if lower > upper:
            raise InputError(where, self.limits, "the lower limit first")
        object.__setattr__(self, "limits", (lower + 0.0, upper + 0.0))  # [0.0, −0.0] runs backwards for NumPy

    def _check_following(self) -> None:
        if not isinstance(self.follows, str) or (self.follows and self.kind == "fixed"):
            expected = "the name of a row" if self.kind != "fixed" else "none, because the row is fixed"
            raise InputError(f"follows of {self.name}", self.follows, expected)
        where = f"ratio of {self.name}"
        ratio = finite_number(where, self.ratio)
        if ratio == 0.0 or (ratio != 1.0 and not self.follows):
            expected = "a number that is not 0" if self.follows else "1, because the row follows no joint"
            raise InputError(where, self.ratio, expected)
        object.__setattr__(self, "ratio", ratio)

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.kind != "fixed"

    @property
    def driven(self) -> bool:
        """Whether it is a joint: it moves, and by itself."""
        return self.kind != "fixed" and not self.follows


@dataclass(frozen=True)
class NominalTable:
    """The table of an arm before it was calibrated: all rows, and the transform after the last one."""

    rows: tuple[Joint, ...]
    tool: Matrix = IDENTITY


def check_followers(rows: Sequence[Joint]) -> None:
    """Whether each row that follows a joint names one that moves by itself.

    Raises:
        InputError: naming the row, and what it could follow.
    """
    drivers = [row.name for row in rows if row.kind != "fixed" and not row.follows]
    for row in rows:
        if not row.follows or drivers.count(row.follows) == 1:
            continue
        expected = "the name of a row that moves by itself: " + (
            ", ".join(dict.fromkeys(drivers)) or "there is none"
        )
        if row.follows in drivers:
            expected = "the name of one row, and several have this one"
        raise InputError(f"follows of {row.name}", row.follows, expected)


def effective(joint: Joint, followers: Iterable[Joint]) -> Joint:
    """A joint with the limits that it and the rows that follow it allow, in its own values.

    Raises:
        InputError: they leave it no value.
    """
    lower, upper = joint.limits or (-math.inf, math.inf)
    peaks = {key: getattr(joint, key) for key in _PEAKS}
    tightest = joint
    for row in followers:
        if row.limits is not None:
            low, high = sorted(limit / row.ratio for limit in row.limits)
            if low > lower or high < upper:
                tightest = row
            lower, upper = max(lower, low), min(upper, high)
        for key in _PEAKS:
            if (peak := getattr(row, key)) is not None:
                most = peak / abs(row.ratio)
                peaks[key] = most if peaks[key] is None else min(peaks[key], most)
    if lower > upper:
        expected = f"limits that leave {joint.name} a value, which it turns {tightest.ratio:g} times as far"
        raise InputError(f"limits of {tightest.name}", tightest.limits, expected)
    return replace(joint, limits=None if math.isinf(lower) else (lower, upper), **peaks)


def expansion(rows: Sequence[Joint]) -> Array:
    """A ``(m, n)`` of ``t = A q``: the values of all m moving rows from those of the n joints."""
    drivers = [row.name for row in rows if row.kind != "fixed" and not row.follows]
    moving = [row for row in rows if row.kind != "fixed"]
    A = np.zeros((len(moving), len(drivers)))
    joint = 0
    for i, row in enumerate(moving):
        if row.follows:
            A[i, drivers.index(row.follows)] = row.ratio
        else:
            A[i, joint] = 1.0
            joint += 1
    return A


def joints_of(rows: Sequence[Joint]) -> tuple[Joint, ...]:
    """The rows that move by themselves, with the limits that they and what follows them keep."""
    followed = {row.follows for row in rows}
    return tuple(
        effective(row, [each for each in rows if each.follows == row.name]) if row.name in followed else row
        for row in rows
        if row.driven
    )


def stroke_of(row: Joint, joints: Sequence[Joint]) -> float:
    """How far a slide, a row of an arm with these joints, goes from zero at most (m); infinite without limits."""
    own = max(map(abs, row.limits)) if row.limits else math.inf
    if not row.follows:
        return own
    leader = next(joint for joint in joints if joint.name == row.follows)
    return min(own, abs(row.ratio) * max(map(abs, leader.limits))) if leader.limits else own


@dataclass(frozen=True, slots=True)
class Shown:
    """What a pendant shows for a joint: the sum of `parts` of joint values, and `offset`.

    Attributes:
        joint: name of the row whose value is shown so.
        parts: (name of a row, how many times its value counts), rad (m) for each rad or m.
        offset: what is shown where all those values are zero, rad or m.

    Raises:
        InputError: a part that is no name and number, or an offset that is no finite number.
    """

    joint: str
    parts: tuple[tuple[str, float], ...]
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check the parts; lists become tuples."""
        try:
            parts = tuple((str(name), finite_number(f"pendant of {self.joint}", x)) for name, x in self.parts)
        except (TypeError, ValueError):
            raise InputError(f"pendant of {self.joint}", self.parts, "pairs of a name and a number") from None
        object.__setattr__(self, "parts", parts)
        object.__setattr__(self, "offset", finite_number(f"pendant offset of {self.joint}", self.offset))


class PendantMap(NamedTuple):
    """``shown = B q + c``.

    Attributes:
        B: ``(n, n)``.
        c: ``(n,)`` rad or m.
        back: the inverse of B.
    """

    B: Array
    c: Array
    back: Array

    def shown(self, q: Array) -> Array:
        """What is shown of joint values ``(..., n)``."""
        return np.asarray(q @ self.B.T + self.c)

    def joint_values(self, shown: Array) -> Array:
        """The joint values ``(..., n)`` of which this is shown."""
        return np.asarray((shown - self.c) @ self.back.T)


def checked_pendant(pendant: Iterable[Shown]) -> tuple[Shown, ...]:
    """What is shown for joints, each joint once."""
    given: tuple[object, ...] = tuple(pendant) if isinstance(pendant, Iterable) else (None,)
    found: dict[str, Shown] = {}
    for i, each in enumerate(given):
        if not isinstance(each, Shown):
            raise InputError(f"pendant[{i}]", each, "a Shown")
        if each.joint in found:
            raise InputError(f"pendant of {each.joint}", "twice", "each joint once")
        found[each.joint] = each
    return tuple(found.values())


def map_of(joints: Sequence[Joint], pendant: Sequence[Shown]) -> PendantMap | None:
    """The map of an arm with these joints; None if everything is shown as it is.

    Entries that name what is no joint are left out: an arm that is made from another may keep its pendant.

    Raises:
        InputError: a part of another kind than its joint, or a map from which the joint values do not follow.
    """
    index = {joint.name: i for i, joint in enumerate(joints)}
    B, c = np.eye(len(joints)), np.zeros(len(joints))
    for each in pendant:
        names = [each.joint, *(name for name, _ in each.parts)]
        if any(name not in index for name in names):
            continue
        row = index[each.joint]
        B[row], c[row] = 0.0, each.offset
        for name, share in each.parts:
            if share and joints[index[name]].kind != joints[row].kind:
                expected = f"joints that are {joints[row].kind} too"
                raise InputError(f"pendant of {each.joint}", name, expected)
            B[row, index[name]] += share
    if np.array_equal(B, np.eye(len(joints))) and not c.any():
        return None
    if abs(np.linalg.det(B)) < _SINGULAR:
        rank = np.linalg.matrix_rank(B)
        stated = [each.joint for each in pendant if each.joint in index]
        one = next(name for name in stated if np.linalg.matrix_rank(np.delete(B, index[name], axis=0)) == rank)
        raise InputError(f"pendant of {one}", B.tolist(), "a map from which all joint values follow")
    back = np.asarray(np.linalg.inv(B), dtype=np.float64)
    if np.array_equal(np.round(back) @ B, np.eye(len(joints))):
        back = np.round(back)  # whole numbers, without rounding errors
    return PendantMap(B, c, back + 0.0)
