"""Ends of feasible intervals on a table as entered, from those of the nominal arm.

The nominal arm says what happens at an end: a joint meets a limit, the given joint turns back, or its own range
ends. Newton's method finds where that happens on the table as entered (:mod:`kin.solvers.selfmotion.points`).

It is the same structure only if no interval appears, vanishes, divides or joins between the two tables. So it
counts as certain only where the nominal arm has the same intervals with limits and reach a little narrower,
and a little wider, and where between the two ends of these nothing else can happen: there one joint goes straight
through its limit, and the others stay away from theirs (`_is_alone`). Else a joint could leave its limits and come
back between these ends unseen, and the interval would be two.
"""

from __future__ import annotations

import math

from kin.angles import TURN, wrap
from kin.kernels.compile import jit
from kin.solvers.selfmotion.points import (
    FOLD,
    OFF,
    SPAN,
    Point,
    Task,
    is_inside,
    new_point,
    newton_to_event,
    redundancy_value,
    slack_of,
    task_of,
)
from kin.transforms import Array

_ACTIVE = 1e-7  # rad: a joint of the nominal arm is at its limit
_BOUND = 1e-10  # rad: an end of the joint's own range
_WHOLE = TURN - 1e-9
# Rad; times the rounding; at a fold times its root: a posture that moves farther may be another one.
_MOVED, _MOVED_BY, _MOVED_ROOT = 0.5, 2000.0, 50.0
_NARROW = 50.0  # times the rounding: intervals narrower than that are in doubt
_TOUCH = 1e-9  # rad between intervals that touch
_STRAIGHT = 0.5  # of the length of a piece of a curve: it bends less than that
_FIXED, _LOST = -4, -5  # the end of the joint's own range; nothing that is known


@jit
def limit_near(lower: Array, upper: Array, y: Array, c: int) -> float:
    """The value of joint c, at the whole turn of y ``(7,)``, at which it meets the nearer one of its limits."""
    off = wrap(y[c] - 0.5 * (lower[c] + upper[c]))
    return float(y[c]) + (math.copysign(0.5 * (upper[c] - lower[c]), off) - off)


@jit
def _what_ends(task: Task, limits: Array, span: tuple[float, float], end: float, y: Array) -> int:
    """What happens at an end where the nominal arm, with wider limits, has the posture y.

    FOLD, _FIXED or the joint that meets a limit.
    """
    joint, least = -1, _ACTIVE
    for c in range(7):
        slack = slack_of(limits[2], limits[3], y, c)
        if c != task.joint and abs(slack) < least:
            joint, least = c, abs(slack)
    if joint >= 0:
        return joint
    if task.joint >= 0 and min(abs(end - span[0]), abs(end - span[1])) < _BOUND:
        return _FIXED
    return FOLD


@jit
def joined(arcs: Array, out: Array) -> int:
    """out ``(m, 3)`` ← intervals (branch, low, high) of an angle, joined where they touch; their number.

    They begin in (−π, π]; one that is whole turns is (−π, π).
    """
    n = 0
    for i in range(arcs.shape[0]):
        branch, low = arcs[i, 0], wrap(arcs[i, 1])
        high = low + (arcs[i, 2] - arcs[i, 1])
        k = 0
        while k < n:
            # One that begins in the other, or the other way round.
            ahead, behind = (low - out[k, 1]) % TURN, (out[k, 1] - low) % TURN
            if out[k, 0] == branch and (
                ahead <= out[k, 2] - out[k, 1] + _TOUCH or behind <= high - low + _TOUCH or ahead > TURN - _TOUCH
            ):
                first, width = (out[k, 1], out[k, 2] - out[k, 1]), high - low
                if ahead <= first[1] + _TOUCH:
                    low, high = first[0], first[0] + max(first[1], ahead + width)
                else:
                    high = low + max(width, behind + first[1])
                n -= 1
                for c in range(3):
                    out[k, c] = out[n, c]
                k = 0
            else:
                k += 1
        if high - low >= _WHOLE:
            low, high = -math.pi, math.pi
        out[n, 0], out[n, 1], out[n, 2] = branch, low, high
        n += 1
    return n


@jit
def _overlaps(a: Array, b: Array, circular: bool) -> bool:
    """Whether two intervals (branch, low, high) are of one branch and overlap."""
    if a[0] != b[0]:
        return False
    if circular:
        return bool((a[1] - b[1]) % TURN <= b[2] - b[1] or (b[1] - a[1]) % TURN <= a[2] - a[1])
    return bool(a[1] <= b[2] and b[1] <= a[2])


@jit
def _paired(branch: int, arcs: Array, others: Array, circular: bool) -> bool:
    """Whether each interval of a branch overlaps exactly one of the others, and each of those one of these."""
    for one, other in ((arcs, others), (others, arcs)):
        for i in range(one.shape[0]):
            if one[i, 0] == branch:
                count = 0
                for k in range(other.shape[0]):
                    count += 1 if _overlaps(one[i], other[k], circular) else 0
                if count != 1:
                    return False
    return True


@jit
def move_ends(
    model: Array, T: Array, setting: Array, limits: Array, known: Array, ends: Array, places: Array, out: Array,
    sure: Array,
) -> None:  # fmt: skip
    """out ``(m, 3)`` ← the intervals of the table as entered, from those of the nominal arm.

    sure ``(8,)`` ← 1.0 for each branch whose intervals certainly have the same structure; the others are in doubt.

    Args:
        model, T, setting: as for `task_of`.
        limits: ``(6, 7)`` lower, upper, both a little wider, both a little narrower.
        known: ``(m + k, 3)`` the m intervals with wider limits and reach, and then those with narrower ones.
        ends: ``(m + k, 2, 7)`` postures at the ends of these.
        places: ``(m, 3, 7)`` ← postures at the ends of `out`; the third is one inside, NaN if it is not known.
    """
    task, p, m = task_of(model, T, setting), new_point(), out.shape[0]
    outer, inner = known[:m], known[m:]
    circular, off, span = task.joint < 0, setting[OFF], (setting[SPAN], setting[SPAN + 1])
    for k in range(sure.shape[0]):
        sure[k] = 1.0 if _paired(k, outer, inner, circular) else 0.0
    for i in range(outer.shape[0]):
        k = int(outer[i, 0])
        out[i, 0], out[i, 1], out[i, 2] = outer[i, 0], outer[i, 1], outer[i, 2]
        for side in range(2):
            for c in range(7):
                places[i, side, c] = ends[i, side, c]
        places[i, 2, 0] = math.nan
        if sure[k] == 0.0:
            continue
        if circular and outer[i, 2] - outer[i, 1] > _WHOLE:
            sure[k] = 1.0 if _is_whole(k, inner) else 0.0
            continue
        other = 0
        while other < inner.shape[0] and not _overlaps(outer[i], inner[other], circular):
            other += 1
        if other == inner.shape[0]:  # its branch is no whole number
            sure[k] = 0.0
            continue
        for side in range(2):
            what = _moved_end(task, limits, span, off, places[i, side], out[i], side, p)
            apart = abs(wrap(outer[i, 1 + side] - inner[other, 1 + side]))
            postures = ends[m + other, side], places[i, side], ends[i, side]
            if what == _LOST or not _is_alone(limits, what, apart, postures, p.n):
                sure[k] = 0.0
            if what >= 0 or what == _FIXED:
                for c in range(7):
                    places[i, 2, c] = places[i, side, c]
        if not out[i, 2] - out[i, 1] > _NARROW * off:
            sure[k] = 0.0
        for j in range(i):
            if _overlaps(out[i], out[j], circular):
                sure[k] = 0.0


@jit
def _is_alone(limits: Array, what: int, apart: float, postures: tuple[Array, Array, Array], n: Array) -> bool:
    """Whether nothing else happens between an end with narrower limits and the same one with wider ones.

    apart: of these two in the parameter; postures: those at the two, and between them that of the
    table as entered, where the curve has the direction n ``(7,)``.
    """
    if what == _FIXED:
        return apart < _BOUND
    inner, y, outer = postures
    for c in range(7):
        away = max(abs(wrap(inner[c] - y[c])), abs(wrap(outer[c] - y[c])))
        if c != what and not slack_of(limits[0], limits[1], y, c) >= 2.0 * away:
            return False
    if what == FOLD:
        return True
    if not abs(slack_of(limits[4], limits[5], inner, what)) < _ACTIVE:
        return False
    length, bent = wrap(outer[what] - inner[what]) / n[what], 0.0
    for c in range(7):
        bent = max(bent, abs(wrap(outer[c] - inner[c]) - length * n[c]))
    return bool(bent <= _STRAIGHT * abs(length))


@jit
def _is_whole(branch: int, arcs: Array) -> bool:
    """Whether a branch has all values of an angle."""
    whole = False
    for i in range(arcs.shape[0]):
        whole = whole or (arcs[i, 0] == branch and arcs[i, 2] - arcs[i, 1] > _WHOLE)
    return whole


@jit
def _moved_end(
    task: Task, limits: Array, span: tuple[float, float], off: float, y: Array, arc: Array, side: int, p: Point
) -> int:
    """arc[1 + side] ← an end on the table as entered, y ``(7,)`` ← the posture there; what happens, or _LOST."""
    lower, upper = limits[0], limits[1]
    if math.isnan(y[0]):
        return _LOST
    end = arc[1 + side]
    what = _what_ends(task, limits, span, end, y)
    start = y.copy()
    if what == _FIXED:
        met = newton_to_event(task, task.joint, end, y, p)
    elif what == FOLD:
        met = task.joint >= 0 and newton_to_event(task, FOLD, 0.0, y, p)
    else:
        met = newton_to_event(task, what, limit_near(lower, upper, y, what), y, p)
    if not met or not is_inside(lower, upper, y, what):
        return _LOST
    most = min(_MOVED, _MOVED_ROOT * math.sqrt(off) if what == FOLD else _MOVED_BY * off)
    for c in range(7):
        if not abs(y[c] - start[c]) < most:
            return _LOST
    if what != _FIXED:
        value = redundancy_value(task, y)
        arc[1 + side] = end + wrap(value - end) if task.joint < 0 else value
    return what
