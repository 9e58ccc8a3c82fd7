"""Self-motions followed step by step: their feasible intervals, whatever their structure, and their first ends.

From a posture the curve is followed both ways, until a joint is outside its limits by more than a margin or the
curve is closed: tangent steps, shortened where the curve bends, each followed by Newton's method. Between two
points of the curve every joint is a cubic in the length. Its roots are where the joint meets a limit, and those of
the derivative of the given joint are folds; Newton's method makes each such *event* exact. Between neighbouring
events nothing changes, so one posture decides whether a piece is feasible.

A step is halved where the cubics decide by their error only. Many starts are on the same few curves, so the points
of a curve are kept: a start that is on one of them has nothing to add.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN, wrap
from kin.kernels.compile import jit
from kin.solvers.selfmotion.points import (
    FOLD,
    PROJECT,
    Point,
    Task,
    is_inside,
    joint_task,
    linearize,
    new_point,
    newton_to_event,
    redundancy_value,
    slack_of,
    task_of,
)
from kin.transforms import Array

PIECES = 128
_EVENTS = 32  # in one step at most
_STEP, _FIRST, _LEAST = 0.15, 0.05, 1e-6  # rad of all joints together
_STRAIGHT, _TURN = 0.995, 0.95  # cosines between tangents: of a step that may grow, and of one that is too long
_POINTS = 6000  # of a curve, from its start to one side
PATHS, CURVES = 16384, 64  # points and curves that are kept
_CORRECTIONS, _NEAR = 12, 1e-6  # steps; rad: the last one, to go on from there
_MISSED = 1e-5  # m and rad: an error that such a step can remove
_ERROR, _SPLITS = 0.02, 6  # of a cubic, times the fourth power of its length; how often a step is halved
_BESIDE, _SAME = 1e-3, 1e-7  # rad from the cubics, and from the curve: a posture on it
_EMPTY = 1e-12  # rad: between two events as close as that is no piece; a joint that moves less stands still
FAILED, OPEN, CLOSED = range(3)
Whole = NDArray[np.int64]
Curve = tuple[Array, Array, Array, Array]  # two points (7,) and the tangents there


class Paths(NamedTuple):
    """The curves of one target that have been followed; arrays are written to.

    Attributes:
        points: ``(PATHS, 14)`` points, and tangents of one sense, curve after curve.
        ends: ``(1 + CURVES,)`` how many curves there are, and where each ends. Without room for another one, all
            are forgotten.
    """

    points: Array
    ends: Whole


@jit
def _copy(source: Array, out: Array) -> None:
    for i in range(7):
        out[i] = source[i]


@jit
def _least_slack(limits: tuple[Array, Array], y: Array) -> float:
    least = math.inf
    for c in range(7):
        least = min(least, slack_of(limits[0], limits[1], y, c))
    return least


@jit
def _project(task: Task, y: Array, p: Point) -> bool:
    """As `newton_to_event` onto the curve, within some 1e-10 rad only; p ← as by `linearize` near y."""
    for _ in range(_CORRECTIONS):
        miss = linearize(task, y, p)
        size = 0.0
        for i in range(7):
            size = max(size, abs(p.x[i]))
        if not (miss < 1.0 and size < 1.0):
            return False
        for i in range(7):
            y[i] += p.x[i]
        if size < _NEAR:
            return miss < _MISSED
    return False


@jit
def _length(curve: Curve) -> float:
    total = 0.0
    for i in range(7):
        total += (curve[2][i] - curve[0][i]) ** 2
    return math.sqrt(total)


@jit
def _cubic(curve: Curve, c: int) -> tuple[float, float, float]:
    """(a, b, d) of joint c as ``y0 + a s + b s² + d s³`` between the points s = 0 and 1."""
    y0, n0, y1, n1 = curve
    length = _length(curve)
    rise, a, z = y1[c] - y0[c], n0[c] * length, n1[c] * length
    return a, 3.0 * rise - 2.0 * a - z, a + z - 2.0 * rise


@jit
def _at(curve: Curve, s: float, y: Array) -> None:
    """y ``(7,)`` ← the point of the cubics at s."""
    for c in range(7):
        a, b, d = _cubic(curve, c)
        y[c] = curve[0][c] + s * (a + s * (b + s * d))


@jit
def _advance(task: Task, before: Curve, curve: Curve, h: float, sense: float, p: Point) -> float:
    """Fill the second point of the curve, a step ahead of the first; returns the length to try next, 0 if none.

    before: the step that led to the first point, whose cubics go on to about the second; nothing is known of it
    where both of its points are one.
    """
    y0, n0, y1, n1 = curve
    length = _length(before)
    while h > _LEAST:
        if length > 0.0:
            _at(before, 1.0 + h / length, y1)
        else:
            for i in range(7):
                y1[i] = y0[i] + h * n0[i]
        if _project(task, y1, p):
            dot, off = 0.0, 0.0
            for i in range(7):
                n1[i] = sense * p.n[i]
                dot += n0[i] * n1[i]
                off = max(off, abs(y1[i] - y0[i] - h * n0[i]))
            if dot > _TURN and off < 0.3 * h:
                return min(1.5 * h, _STEP) if dot > _STRAIGHT else h
        h *= 0.5
    return 0.0


@jit
def _rate(task: Task, curve: Curve, s: float) -> float:
    """The share of the parameter's joint in the motion along the curve at s; 1 where the parameter is an angle."""
    if task.joint < 0:
        return 1.0
    a, b, d = _cubic(curve, task.joint)
    return abs(a + s * (2.0 * b + 3.0 * s * d)) / _length(curve)


@jit
def _clearer(limits: tuple[Array, Array], y: Array, rate: float, score: float, best: Array) -> float:
    """best ``(7,)`` ← y if it is clearer of the ends of its piece than the score; the score of the best.

    It counts how far joints are inside their limits, in rad, and the rate, which is zero at folds.
    """
    clear = min(_least_slack(limits, y), rate)
    if clear > score:
        _copy(y, best)
    return max(clear, score)


@jit
def _turning(a: float, b: float, d: float, stops: Array) -> int:
    """stops ← 0, the zeros in (0, 1) of ``a + 2 b s + 3 d s²`` in their order, and 1; returns how many."""
    stops[0] = 0.0
    n = 1
    if abs(d) < 1e-14 * (abs(a) + abs(b)):
        if b != 0.0 and 0.0 < -0.5 * a / b < 1.0:
            stops[n] = -0.5 * a / b
            n += 1
    else:
        inside = b * b - 3.0 * a * d
        if inside > 0.0:
            far = -(b + math.copysign(math.sqrt(inside), b))
            x, y = far / (3.0 * d), (a / far if far != 0.0 else math.nan)
            for s in (min(x, y), max(x, y)):
                if 0.0 < s < 1.0:
                    stops[n] = s
                    n += 1
    stops[n] = 1.0
    return n + 1


@jit
def _add_event(s: float, what: int, value: float, events: Array, count: int) -> int:
    """Insert an event into those sorted by s, rows (s, what, value)."""
    if count == events.shape[0]:
        return count
    i = count
    while i > 0 and events[i - 1, 0] > s:
        for k in range(3):
            events[i, k] = events[i - 1, k]
        i -= 1
    events[i, 0], events[i, 1], events[i, 2] = s, what, value
    return count + 1


@jit
def _crossings(curve: Curve, c: int, value: float, stops: Array, n: int, events: Array, count: int) -> int:
    """Add where joint c passes a value, between the n stops at which its cubic turns."""
    a, b, d = _cubic(curve, c)
    start = curve[0][c] - value
    for i in range(n - 1):
        low, high = stops[i], stops[i + 1]
        f, g = start + low * (a + low * (b + low * d)), start + high * (a + high * (b + high * d))
        if (f >= 0.0) == (g >= 0.0):
            continue
        for _ in range(40):
            middle = 0.5 * (low + high)
            if (start + middle * (a + middle * (b + middle * d)) >= 0.0) == (f >= 0.0):
                low = middle
            else:
                high = middle
        count = _add_event(0.5 * (low + high), c, value, events, count)
    return count


@jit
def _events_between(task: Task, limits: tuple[Array, Array], curve: Curve, events: Array) -> int:
    """events ``(n, 3)`` ← rows (s, what, value) between the points of the curve, in their order; their number."""
    lower, upper = limits
    stops = np.empty(4)
    count = 0
    for c in range(7):
        a, b, d = _cubic(curve, c)
        n = _turning(a, b, d, stops)
        if c == task.joint and not _is_still(a, b, d):
            for i in range(1, n - 1):
                count = _add_event(stops[i], FOLD, 0.0, events, count)
        half, middle = 0.5 * (upper[c] - lower[c]), 0.5 * (upper[c] + lower[c])
        if half < math.pi:
            centre = curve[0][c] - wrap(curve[0][c] - middle)
            count = _crossings(curve, c, centre - half, stops, n, events, count)
            count = _crossings(curve, c, centre + half, stops, n, events, count)
            if math.pi - half < _STEP:  # a step may pass both limits of a joint that lacks little of a whole turn
                count = _crossings(curve, c, centre - TURN + half, stops, n, events, count)
                count = _crossings(curve, c, centre + TURN - half, stops, n, events, count)
    return count


@jit
def _is_still(a: float, b: float, d: float) -> bool:
    """Whether a joint with this cubic stands still: where it would turn back is decided by rounding errors."""
    return max(abs(a), abs(b), abs(d)) < _EMPTY


@jit
def _is_close_call(task: Task, limits: tuple[Array, Array], curve: Curve) -> bool:
    """Whether the cubics decide by no more than their error that a joint meets a limit or turns back."""
    lower, upper = limits
    stops, length = np.empty(4), _length(curve)
    error = _ERROR * length**4
    for c in range(7):
        a, b, d = _cubic(curve, c)
        turns = 0.0 < -b < 3.0 * d or 0.0 > -b > 3.0 * d
        if c == task.joint and turns and not _is_still(a, b, d) and abs(a - b * b / (3.0 * d)) < 4.0 * error:
            return True
        half, middle = 0.5 * (upper[c] - lower[c]), 0.5 * (upper[c] + lower[c])
        if half < math.pi:
            for i in range(1, _turning(a, b, d, stops) - 1):
                s = stops[i]
                off = abs(wrap(curve[0][c] + s * (a + s * (b + s * d)) - middle))
                if abs(off - half) < error:
                    return True
    return False


@jit
def _closes(curve: Curve, start: Array, tangent: Array) -> bool:
    """Whether the curve passes its start between the two points."""
    length = _length(curve)
    along = squared = dot = 0.0
    for i in range(7):
        d = wrap(start[i] - curve[0][i])
        along += d * curve[1][i]
        squared += d * d
        dot += tangent[i] * curve[1][i]
    beside = math.sqrt(max(squared - along * along, 0.0))
    return dot > 0.8 and 0.0 <= along < length and beside < 0.2 * length


@jit
def _directed(tangent: Array, sense: float) -> Array:
    """A tangent ``(7,)``, the other way round if the sense is −1.0."""
    out = np.empty(7)
    for i in range(7):
        out[i] = sense * tangent[i]
    return out


@jit
def _walk(
    task: Task, limits: tuple[Array, Array], margin: float, start: tuple[Array, Array], sense: float, out: Array
) -> tuple[int, int]:
    """Follow the curve from a point and its tangent, in the sense of the tangent or against it.

    out ``(m, 14)`` ← further points, and tangents of the same sense. Returns why it ended, and how many they are.
    """
    p, tangent = new_point(), _directed(start[1], sense)
    curve = (start[0].copy(), tangent.copy(), np.empty(7), np.empty(7))
    before = (start[0].copy(), tangent.copy(), curve[0], curve[1])
    h = _FIRST
    for count in range(out.shape[0]):
        h = _advance(task, before, curve, h, sense, p)
        if h == 0.0:
            return FAILED, count
        if count > 2 and _closes(curve, start[0], tangent):
            return CLOSED, count
        for i in range(7):
            before[0][i], before[1][i] = curve[0][i], curve[1][i]
            curve[0][i] = out[count, i] = curve[2][i]
            curve[1][i] = curve[3][i]
            out[count, 7 + i] = sense * curve[3][i]
        if _least_slack(limits, curve[0]) < -margin:
            return OPEN, count + 1
    return FAILED, out.shape[0]


@jit
def end_of_motion(model: Array, T: Array, joint: int, sense: float, q: Array, lower: Array, upper: Array) -> float:
    """The value of a joint up to which the self-motion from q ``(7,)`` stays inside the limits, one turn at most.

    There the joint turns back, or a joint meets a limit, or the curve is lost.

    Args:
        sense: 1.0 upwards, −1.0 downwards.
    """
    start = float(q[joint])
    end = _first_end(joint_task(model, T, joint), (lower, upper), sense, q)
    ahead = min(max(sense * (end - start), 0.0), TURN)
    return float(min(max(start + sense * ahead, lower[joint]), upper[joint]))


@jit
def _first_end(task: Task, limits: tuple[Array, Array], sense: float, q: Array) -> float:
    """As `end_of_motion`, but for rounding errors."""
    p, y, events, at = new_point(), q.copy(), np.empty((_EVENTS, 3)), np.empty(7)
    if not newton_to_event(task, PROJECT, 0.0, y, p):
        return float(q[task.joint])
    along = math.copysign(1.0, sense * p.n[task.joint])
    curve = (y, _directed(p.n, along), np.empty(7), np.empty(7))
    before = (y.copy(), _directed(p.n, along), curve[0], curve[1])
    h = _FIRST
    for _ in range(_POINTS):
        h = _advance(task, before, curve, h, along, p)
        for _ in range(_SPLITS):
            if h > 0.0 and _is_close_call(task, limits, curve):
                h = _advance(task, before, curve, 0.5 * _length(curve), along, p)
        if h == 0.0 or abs(curve[0][task.joint] - q[task.joint]) > TURN:
            break
        n, s = _events_between(task, limits, curve, events), 0.0
        for i in range(n + 1):
            following = events[i, 0] if i < n else 1.0
            _at(curve, 0.5 * (s + following), at)
            if (i > 0 and events[i - 1, 1] == FOLD) or not is_inside(limits[0], limits[1], at, -1):
                _at(curve, s, at)
                met = i > 0 and newton_to_event(task, int(events[i - 1, 1]), events[i - 1, 2], at, p)
                return float(at[task.joint] if met else curve[0][task.joint])
            s = following
        for i in range(7):
            before[0][i], before[1][i] = curve[0][i], curve[1][i]
            curve[0][i], curve[1][i] = curve[2][i], curve[3][i]
    return float(curve[0][task.joint])


@jit
def _load(path: Array, k: int, curve: Curve) -> None:
    """The points k and k + 1 of a path as a curve."""
    for i in range(7):
        curve[0][i], curve[1][i] = path[k, i], path[k, 7 + i]
        curve[2][i], curve[3][i] = path[k + 1, i], path[k + 1, 7 + i]


@jit
def _is_on(task: Task, path: Array, y: Array) -> bool:
    """Whether a posture y ``(7,)`` of the target is on the curve with the points `path` ``(m, 14)``."""
    curve, u, p = (np.empty(7), np.empty(7), np.empty(7), np.empty(7)), np.empty(7), new_point()
    for k in range(path.shape[0] - 1):
        if not abs(wrap(y[0] - path[k, 0])) < 2.0 * _STEP:
            continue
        along = squared = 0.0
        for i in range(7):
            d = wrap(y[i] - path[k, i])
            along += d * path[k, 7 + i]
            squared += d * d
        if not (squared < 4.0 * _STEP * _STEP and along > -_BESIDE):
            continue
        _load(path, k, curve)
        length = _length(curve)
        if not along < length + _BESIDE:
            continue
        s = along / length
        for _ in range(3):
            _at(curve, s, u)
            for i in range(7):
                s += wrap(y[i] - u[i]) * curve[1 if s < 0.5 else 3][i] / length
        _at(curve, s, u)
        off = 0.0
        for i in range(7):
            off = max(off, abs(wrap(y[i] - u[i])))
        if not off < _BESIDE:
            continue
        for _ in range(3):
            if not _project(task, u, p):
                break
            ahead = off = 0.0
            for i in range(7):
                d = wrap(y[i] - u[i])
                ahead += d * p.n[i]
                off = max(off, abs(d))
            if off < _SAME:
                return True
            for i in range(7):
                u[i] += ahead * p.n[i]
    return False


@jit
def trace(
    model: Array, T: Array, setting: Array, box: Array, margin: float, starts: Array, paths: Paths, arcs: Array,
    places: Array,
) -> int:  # fmt: skip
    """The feasible intervals of the redundancy parameter on the curves through postures; their number.

    A posture on a curve that has been followed adds none. arcs ``(PIECES, 3)`` ← their ends and a value inside;
    places ``(PIECES, 3, 7)`` ← the postures there. An interval that is whole turns of the parameter has the same
    posture in all three.

    Args:
        model, T, setting: as for `task_of`.
        box: ``(≥ 2, 7)`` lower and upper limits.
        margin: radians by which a joint may be outside its limits on the way.
        starts: ``(k, 7)`` postures close to the curves; NaN ← where the curve was lost on the way.
        paths: the curves that have been followed; these are added.
    """
    task, limits, count = task_of(model, T, setting), (box[0], box[1]), 0
    for i in range(starts.shape[0]):
        found = _trace(task, limits, margin, starts[i], paths, arcs[count:], places[count:])
        if found < 0:
            starts[i, 0] = math.nan
        count += max(found, 0)
    return count


@jit
def _trace(
    task: Task, limits: tuple[Array, Array], margin: float, start: Array, paths: Paths, arcs: Array, places: Array
) -> int:
    """As `trace` for one posture ``(7,)``; −1 if its curve is lost."""
    y, p = start.copy(), new_point()
    if not newton_to_event(task, PROJECT, 0.0, y, p):
        return -1
    if _least_slack(limits, y) < -margin:
        return 0
    first, points, ends = 0, paths.points, paths.ends
    for k in range(ends[0]):
        if _is_on(task, points[first : ends[1 + k]], y):
            return 0
        first = ends[1 + k]
    tangent, back = p.n.copy(), np.empty((_POINTS, 14))
    kind, count = _walk(task, limits, margin, (y, tangent), -1.0, back)
    if kind == FAILED:
        return -1
    if first + count + 2 + _POINTS > points.shape[0] or ends[0] == ends.shape[0] - 1:
        first = ends[0] = 0
    at = first
    for k in range(count - 1, -1, -1):
        points[at] = back[k]
        at += 1
    for i in range(7):
        points[at, i], points[at, 7 + i] = y[i], tangent[i]
    at += 1
    if kind == CLOSED:
        for i in range(7):
            points[at, i], points[at, 7 + i] = y[i] + wrap(back[count - 1, i] - y[i]), back[count - 1, 7 + i]
        at += 1
    else:
        other, more = _walk(task, limits, margin, (y, tangent), 1.0, points[at : at + _POINTS])
        if other != OPEN:
            return -1
        at += more
    found = _record(task, limits, points[first:at], kind == CLOSED, arcs, places)
    if found >= 0:
        ends[0] += 1
        ends[ends[0]] = at
    return found


@jit
def _record(task: Task, limits: tuple[Array, Array], path: Array, closed: bool, arcs: Array, places: Array) -> int:
    """Write down the feasible pieces of a path ``(m, 14)``, see `trace`; a closed one ends where it begins."""
    p, events, at = new_point(), np.empty((_EVENTS, 3)), np.empty(7)
    curve = (np.empty(7), np.empty(7), np.empty(7), np.empty(7))
    _load(path, 0, curve)
    best, piece = curve[0].copy(), curve[0].copy()
    value = redundancy_value(task, piece)
    first, score = value, -math.inf
    begun, around, found, k = not closed, False, 0, 0
    ahead, left, shortest = np.empty((_SPLITS, 14)), 0, 0.0
    while True:
        if left == 0 and k == path.shape[0] - 1:
            if not begun and is_inside(limits[0], limits[1], best, -1):
                return _put(task, (value - TURN, value), (best, best, best), arcs, places, found)
            if around or not (closed and begun):
                return found
            around, k = True, 0  # a closed curve: on to its first event
        if left == 0:
            _load(path, k, curve)
            k += 1
            shortest = 1.5 * _length(curve) / (1 << _SPLITS)
        else:
            left -= 1
            for i in range(7):
                curve[0][i], curve[1][i] = curve[2][i], curve[3][i]
                curve[2][i], curve[3][i] = ahead[left, i], ahead[left, 7 + i]
        while left < _SPLITS and _length(curve) > shortest and _is_close_call(task, limits, curve):
            _at(curve, 0.5, at)
            if not _project(task, at, p):
                return -1
            for i in range(7):
                ahead[left, i], ahead[left, 7 + i] = curve[2][i], curve[3][i]
                curve[2][i], curve[3][i] = at[i], p.n[i]
            left += 1
        n = _events_between(task, limits, curve, events)
        done = 0.0
        for i in range(n):
            middle = 0.5 * (done + events[i, 0])
            _at(curve, middle, at)
            done = events[i, 0]
            score = _clearer(limits, at, _rate(task, curve, middle), score, best)
            _at(curve, done, at)
            if not newton_to_event(task, int(events[i, 1]), events[i, 2], at, p):
                return -1
            there = value + wrap(redundancy_value(task, at) - value)
            if begun and abs(there - first) > _EMPTY and is_inside(limits[0], limits[1], best, -1):
                found = _put(task, (first, there), (piece, at, best), arcs, places, found)
                if found < 0:
                    return -1
            if around:
                return found
            begun, value, first, score = True, there, there, -math.inf
            _copy(at, piece)
        value += wrap(redundancy_value(task, curve[2]) - value)
        score = _clearer(limits, curve[2], _rate(task, curve, 1.0), score, best)


@jit
def _put(
    task: Task, ends: tuple[float, float], postures: tuple[Array, Array, Array], arcs: Array, places: Array,
    found: int,
) -> int:  # fmt: skip
    """Append a piece, the inner posture moved onto the curve; returns their number, −1 if they do not fit."""
    if found == arcs.shape[0]:
        return -1
    inner, p = postures[2].copy(), new_point()
    if not newton_to_event(task, PROJECT, 0.0, inner, p):
        return -1
    back = 0 if ends[0] <= ends[1] else 1
    arcs[found, back], arcs[found, 1 - back] = ends
    _copy(postures[0], places[found, back])
    _copy(postures[1], places[found, 1 - back])
    _copy(inner, places[found, 2])
    arcs[found, 2] = redundancy_value(task, inner)
    return found + 1
