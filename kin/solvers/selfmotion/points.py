"""Points of a self-motion: a posture of seven joints that meets the target, moved with the tool still.

The postures that meet one target are curves. At each of their points the Jacobian J ``(6, 7)`` has one null vector
n, the direction of the curve. A point beside the curve with the error e moves onto it by the shortest x with
``J x = e``, and along it by any multiple of n. So one elimination answers every question asked here: the next
iterate is ``y + x + s n``, with

- s = 0 to come onto the curve;
- s = (v − y_c − x_c) / n_c to bring joint c to the value v;
- s = (v − ψ) / ψ' to bring the arm angle to v;
- s = −n_j / n_j' for a *fold*, where joint j turns back. n' follows from differentiating ``J n = 0``.

All of these are Newton's method, so they converge quadratically (:func:`newton_to_event`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.dense import shortest_and_null
from kin.kernels.jacobian import jacobian_into
from kin.solvers.canonical import canonical_pose
from kin.solvers.numeric.error import relative_pose
from kin.solvers.srs7.geometry import E1, E2, radial_of, triangle_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# What `newton_to_event` is asked for, if it is not the value of a joint (its index).
FOLD, VALUE, PROJECT = -1, -2, -3
_STEPS = 24
_LONGEST = 0.3  # rad of all joints together, in one step
_CLOSE = 1e-7  # rad: the last step
_MET_BY = 10.0  # times the last step, in m and rad: an error that this step can remove
_SLACK = TOLERANCES.limit
_NUDGE = 1e-5  # rad along the curve, for the rate of the arm angle


class Task(NamedTuple):
    """A target, and the redundancy parameter of the family.

    Attributes:
        model: the arm, as in `kin.kernels.fk`.
        T: target ``(4, 4)``.
        joint: index of the joint whose value the parameter is, −1 if it is the arm angle ψ of an S-R-S arm.
        frame: ``(22,)`` what `redundancy_value` needs for ψ: signs and offsets of canonical angles, lengths of
            upper arm and forearm, e1 and e2 of the target.

    Kernels that are called from Python get it as arrays, see `task_of`.
    """

    model: Array
    T: Array
    joint: int
    frame: Array


class Point(NamedTuple):
    """A posture and what `linearize` finds there; all arrays are written to.

    Attributes:
        J, pose, axes: as in `jacobian_into`.
        e: ``(6,)`` the twist that is left to the target.
        n: ``(7,)`` unit null vector of J, of one sense along the curve.
        x: ``(7,)`` the shortest motion that removes the error.
        bend: ``(7,)`` derivative of n along the curve, perpendicular to it.
        A, rest, spare: scratch ``(7, 8)``, ``(6,)``, ``(7,)``.
    """

    J: Array
    pose: Array
    axes: Array
    e: Array
    n: Array
    x: Array
    bend: Array
    A: Array
    rest: Array
    spare: Array


# Layout of a *setting*: index of the joint, rounding of the table, range of the joint, the wanted value, how far a
# row may move, and the frame.
JOINT, OFF, SPAN, WANTED, MOST, FRAME, SETTING = 0, 1, 2, 4, 5, 6, 28


@jit
def task_of(model: Array, T: Array, setting: Array) -> Task:
    """The task of a target and a setting ``(SETTING,)``."""
    return Task(model, T, int(setting[JOINT]), setting[FRAME:SETTING])


@jit
def joint_task(model: Array, T: Array, joint: int) -> Task:
    """The task of a target, with the value of a joint as the parameter."""
    setting = np.zeros(SETTING)
    setting[JOINT] = joint
    return task_of(model, T, setting)


@jit
def new_point() -> Point:
    """Scratch for one posture."""
    return Point(
        np.empty((6, 7)), np.empty((4, 4)), np.empty((7, 7)), np.empty(6), np.empty(7), np.empty(7), np.empty(7),
        np.empty((7, 8)), np.empty(6), np.empty(7),
    )  # fmt: skip


@jit
def set_frame(params: Array, T: Array, frame: Array) -> None:
    """Entries 16 to 21 of frame ``(22,)`` ← e1 and e2 of a target of an S-R-S arm, NaN if it is out of reach."""
    M, triangle = np.empty((4, 4)), np.empty((4, 3))
    canonical_pose(params, T, M)
    code, _ = triangle_of(params, M, triangle)
    for i in range(3):
        frame[16 + i] = triangle[E1, i] if code == 0 else math.nan
        frame[19 + i] = triangle[E2, i] if code == 0 else math.nan


@jit
def redundancy_value(task: Task, y: Array) -> float:
    """The redundancy parameter at a posture y ``(7,)``: as the family has it, but for the posture as it is."""
    if task.joint >= 0:
        return float(y[task.joint])
    f, theta = task.frame, np.empty(7)
    for i in range(7):
        theta[i] = f[i] * y[i] + f[7 + i]
    r = radial_of(theta, f[14], f[15])
    return math.atan2(r[0] * f[19] + r[1] * f[20] + r[2] * f[21], r[0] * f[16] + r[1] * f[17] + r[2] * f[18])


@jit
def _rate_of_value(task: Task, y: Array, n: Array) -> float:
    """The derivative of the redundancy parameter along n ``(7,)``."""
    if task.joint >= 0:
        return float(n[task.joint])
    there, back = np.empty(7), np.empty(7)
    for i in range(7):
        there[i], back[i] = y[i] + _NUDGE * n[i], y[i] - _NUDGE * n[i]
    return wrap(redundancy_value(task, there) - redundancy_value(task, back)) / (2.0 * _NUDGE)


@jit
def linearize(task: Task, y: Array, p: Point) -> float:
    """p ← what is found at y ``(7,)``; returns the largest entry of the error, infinity where J has no rank."""
    jacobian_into(task.model, y, p.J, p.pose, p.axes)
    relative_pose(p.pose, task.T, False, p.e)
    miss = 0.0
    for r in range(6):
        miss = max(miss, abs(p.e[r]))
        p.e[r] = -p.e[r]
    return miss if shortest_and_null(p.J, p.e, p.A, p.n, p.x) else math.inf


@jit
def linearize_tangent(p: Point) -> bool:
    """p.bend ← the derivative of n along the curve, where `linearize` was last; False if there is none.

    ``J n' = −J̇ n``: the acceleration of the tool at constant joint rates n. With ω the axis of a joint, v its
    column of the point's Jacobian and Ω the sum of n ω over the joints before it, that is the sum of
    n (2Ω + n ω) × v, and of n Ω × ω.
    """
    J, n, rest = p.J, p.n, p.rest
    for r in range(6):
        rest[r] = 0.0
    X = Y = Z = 0.0
    for i in range(7):
        wx, wy, wz = J[3, i], J[4, i], J[5, i]
        a, b, c = 2.0 * X + n[i] * wx, 2.0 * Y + n[i] * wy, 2.0 * Z + n[i] * wz
        rest[0] -= n[i] * (b * J[2, i] - c * J[1, i])
        rest[1] -= n[i] * (c * J[0, i] - a * J[2, i])
        rest[2] -= n[i] * (a * J[1, i] - b * J[0, i])
        rest[3] -= n[i] * (Y * wz - Z * wy)
        rest[4] -= n[i] * (Z * wx - X * wz)
        rest[5] -= n[i] * (X * wy - Y * wx)
        X, Y, Z = X + n[i] * wx, Y + n[i] * wy, Z + n[i] * wz
    return shortest_and_null(J, rest, p.A, p.spare, p.bend)


@jit
def newton_to_event(task: Task, what: int, value: float, y: Array, p: Point) -> bool:
    """Move y ``(7,)``, in place, to where the curve has the value of a joint (`what` ≥ 0) or of the redundancy
    parameter (VALUE), to a fold of the parameter's joint (FOLD), or just onto the curve (PROJECT).

    p ← as by `linearize` at about y. False if Newton's method does not converge.
    """
    met = False
    for _ in range(_STEPS):
        miss = linearize(task, y, p)
        if not miss < 1.0:
            return False
        along, off = 0.0, 0.0
        if what >= 0:
            off = value - y[what]
            along = (off - p.x[what]) / p.n[what] if off != 0.0 or p.x[what] != 0.0 else 0.0
        elif what == VALUE:
            off = wrap(value - redundancy_value(task, y)) if task.joint < 0 else value - y[task.joint]
            step = off if task.joint < 0 else off - p.x[task.joint]
            along = step / _rate_of_value(task, y, p.n) if step != 0.0 else 0.0
        elif what == FOLD:
            off = p.n[task.joint]
            if not linearize_tangent(p):
                return False
            along = -off / p.bend[task.joint]
        size = 0.0
        for i in range(7):
            size = max(size, abs(p.x[i] + along * p.n[i]))
        if not size < math.inf:
            return False
        shrink = _LONGEST / size if size > _LONGEST else 1.0
        for i in range(7):
            y[i] += shrink * (p.x[i] + along * p.n[i])
        if size < _CLOSE:  # what is left is the square of this step
            met = miss < _MET_BY * _CLOSE
            break
    if met and what >= 0:
        y[what] = value
    elif met and what == VALUE and task.joint >= 0:
        y[task.joint] = value
    return met


@jit
def correct(task: Task, value: float, sense: float, y: Array, p: Point) -> bool:
    """Move y ``(7,)``, in place, along the curve to a value of the redundancy parameter; whether that is possible.

    sense: sign of n_j where the posture is wanted: at a fold, two postures of different branches meet. 0.0 for
    that at y. From the wrong side of a fold the other one is found by the parabola around it.
    """
    start, j = y.copy(), task.joint
    if j >= 0 and sense == 0.0:
        if not linearize(task, y, p) < 1.0:
            return False
        sense = p.n[j]
    if newton_to_event(task, VALUE, value, y, p) and (j < 0 or p.n[j] * sense > 0.0):
        return True
    if j < 0:
        return False
    for i in range(7):
        y[i] = start[i]
    if not (newton_to_event(task, FOLD, 0.0, y, p) and linearize_tangent(p)):
        return False
    squared = 2.0 * (value - y[j]) / p.bend[j]
    if not 0.0 <= squared < _LONGEST * _LONGEST:
        return False
    s = math.copysign(math.sqrt(squared), sense * p.bend[j])
    for i in range(7):
        y[i] += s * (p.n[i] + 0.5 * s * p.bend[i])
    return newton_to_event(task, VALUE, value, y, p) and p.n[j] * sense > 0.0


@jit
def slack_of(lower: Array, upper: Array, y: Array, c: int) -> float:
    """How far joint c is inside its limits at its best whole turn; infinite where they leave a whole turn."""
    half = 0.5 * (upper[c] - lower[c])
    if half >= math.pi:
        return math.inf
    return float(half - abs(wrap(y[c] - 0.5 * (lower[c] + upper[c]))))


@jit
def is_inside(lower: Array, upper: Array, y: Array, but: int) -> bool:
    """Whether all joints but one are inside their limits."""
    inside = True
    for c in range(7):
        inside = inside and (c == but or slack_of(lower, upper, y, c) >= -_SLACK)
    return inside
