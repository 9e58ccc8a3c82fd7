"""The self-motion of an arm with seven joints: the tool stays, one joint is moved, the other six follow.

A step along the tangent, then Newton steps back onto the target. Where the joints would have to move fast the step
is halved; where it vanishes, the motion turns back, and the range of the moved joint ends.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into
from kin.solvers.common import nearest_image
from kin.solvers.numeric.error import relative_pose
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_STEP = 0.06  # rad of the moved joint
_MOST = 0.25  # rad of any other joint in one step
_LEAST = 1e-10  # rad: a shorter step ends the motion
_NEWTON = 6
_THERE = 1e-12
_STEPS = 2000
# Of motions downhill: the longest step and one that does not count, rad of the moved joint; the most steps.
_STRIDE, _CLOSE, _DOWNHILL = 0.3, 1e-5, 60
_LIMIT = TOLERANCES.limit


@jit
def _solved(J: Array, joint: int, right: Array, x: Array) -> bool:
    """x ``(7,)`` ← the motion of the other joints with ``J x = right`` ``(6,)``; False if there is none."""
    A, b = np.empty((6, 6)), np.empty(6)
    for r in range(6):
        b[r] = right[r]
        for k in range(6):
            A[r, k] = J[r, k + (1 if k >= joint else 0)]
    for k in range(6):
        pivot = k
        for r in range(k + 1, 6):
            if abs(A[r, k]) > abs(A[pivot, k]):
                pivot = r
        if abs(A[pivot, k]) < 1e-12:
            return False
        if pivot != k:
            for m in range(6):
                A[k, m], A[pivot, m] = A[pivot, m], A[k, m]
            b[k], b[pivot] = b[pivot], b[k]
        for r in range(k + 1, 6):
            factor = A[r, k] / A[k, k]
            b[r] -= factor * b[k]
            for m in range(k + 1, 6):
                A[r, m] -= factor * A[k, m]
    x[joint] = 0.0
    for k in range(5, -1, -1):
        total = b[k]
        for m in range(k + 1, 6):
            total -= A[k, m] * x[m + (1 if m >= joint else 0)]
        x[k + (1 if k >= joint else 0)] = total / A[k, k]
    return True


@jit
def _moved(model: Array, target: Array, joint: int, step: float, q: Array, out: Array) -> bool:
    """out ``(7,)`` ← q ``(7,)``, which meets the target, with one joint moved by `step` and the tool still there.

    False if another joint has to jump.
    """
    J, T, axes, e, x = np.empty((6, 7)), np.empty((4, 4)), np.empty((7, 7)), np.empty(6), np.empty(7)
    jacobian_into(model, q, J, T, axes)
    for r in range(6):
        e[r] = -step * J[r, joint]
    if not _solved(J, joint, e, x):
        return False
    for i in range(7):
        if abs(x[i]) > _MOST:
            return False
        out[i] = q[i] + x[i]
    out[joint] = q[joint] + step
    for _ in range(_NEWTON):
        jacobian_into(model, out, J, T, axes)
        relative_pose(T, target, False, e)
        miss = 0.0
        for r in range(6):
            miss = max(miss, abs(e[r]))
            e[r] = -e[r]
        if miss < _THERE:
            break
        if not _solved(J, joint, e, x):
            return False
        for i in range(7):
            out[i] += x[i]
    for i in range(7):
        if not abs(out[i] - q[i]) < 2.0 * _MOST:
            return False
    return miss < 1e3 * _THERE


@jit
def _inside(q: Array, lower: Array, upper: Array) -> bool:
    outside = 0
    for i in range(q.shape[0]):
        outside += 1 if q[i] < lower[i] - _LIMIT or q[i] > upper[i] + _LIMIT else 0
    return outside == 0


@jit
def end_of_motion(
    model: Array, target: Array, joint: int, sense: float, q: Array, lower: Array, upper: Array
) -> float:
    """The value of the moved joint up to which the self-motion from q ``(7,)`` goes on inside the limits.

    sense: 1.0 upwards, −1.0 downwards; at most one turn.
    """
    at, there = q.copy(), np.empty(7)
    start = float(q[joint])
    step = _STEP
    for _ in range(_STEPS):
        if step < _LEAST:
            break
        if abs(at[joint] - start) >= 2.0 * math.pi:
            return start + sense * 2.0 * math.pi
        if _moved(model, target, joint, sense * step, at, there) and _inside(there, lower, upper):
            for i in range(7):
                at[i] = there[i]
            step = min(1.5 * step, _STEP)
        else:
            step *= 0.5
    return float(at[joint])


@jit
def nearest_on_motion(
    model: Array, target: Array, joint: int, q: Array, seed: Array, lower: Array, upper: Array
) -> float:
    """Move q ``(7,)``, in place, along its self-motion to where it is nearest to the seed, inside the limits.

    Downhill only, from a configuration that meets the target; returns the squared distance there.
    """
    J, T, axes, e, x = np.empty((6, 7)), np.empty((4, 4)), np.empty((7, 7)), np.empty(6), np.empty(7)
    there, most, step, before = np.empty(7), _STRIDE, 0.0, 0.0
    least = _squared(q, seed)
    for _ in range(_DOWNHILL):
        if step != 0.0 or before == 0.0:
            jacobian_into(model, q, J, T, axes)
            for r in range(6):
                e[r] = -J[r, joint]
            if not _solved(J, joint, e, x):
                break
            down, rate = q[joint] - seed[joint], 1.0
            for i in range(7):
                down += (q[i] - seed[i]) * x[i]
                rate += x[i] * x[i]
            # The secant of the derivative where it rises, else the squared rate of the joints.
            slope = (down - before) / step if step != 0.0 else 0.0
            wanted = -down / (slope if slope > 0.1 * rate else rate)
            before = down
        # The other joints go no farther than a step of `_moved` may.
        most = min(most, 0.8 * _MOST / math.sqrt(rate))
        step = min(max(wanted, -most), most)
        if abs(step) < _CLOSE:
            break
        nearer = _moved(model, target, joint, step, q, there) and _inside(there, lower, upper)
        distance = _squared(there, seed) if nearer else math.inf
        if distance < least:
            least, most = distance, _STRIDE
            for i in range(7):
                q[i] = there[i]
        else:
            most, step = 0.4 * abs(step), 0.0
    return least


@jit
def _squared(q: Array, seed: Array) -> float:
    total = 0.0
    for i in range(q.shape[0]):
        total += (q[i] - seed[i]) ** 2
    return total


@jit
def to_images(q: Array, seed: Array, lower: Array, upper: Array, joint: int, squares: Array) -> None:
    """Bring configurations q ``(k, 7)``, in place, to the whole turns inside the limits nearest to the seed.

    The given joint stays. squares ``(k,)`` ← the squared distance from the seed; infinity for those that do not
    exist or are outside the limits.
    """
    for k in range(q.shape[0]):
        squares[k] = 0.0 if q[k, 0] == q[k, 0] else math.inf
        for i in range(7):
            if squares[k] < math.inf:
                if i != joint:
                    q[k, i] = nearest_image(q[k, i], seed[i], lower[i], upper[i])
                outside = q[k, i] < lower[i] - _LIMIT or q[k, i] > upper[i] + _LIMIT
                squares[k] += math.inf if outside else (q[k, i] - seed[i]) ** 2
