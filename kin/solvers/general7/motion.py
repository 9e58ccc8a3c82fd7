"""Along the self-motions of an arm with seven joints to where they are nearest to a seed."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import nearest_image
from kin.kernels.compile import jit
from kin.solvers.selfmotion.points import PROJECT, joint_task, linearize, new_point, newton_to_event
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# The longest step along a curve and one that does not count, rad of all joints together; the most steps.
_STRIDE, _CLOSE, _STEPS = 0.3, 1e-5, 60
_LIMIT = TOLERANCES.limit


@jit
def _is_inside(q: Array, lower: Array, upper: Array) -> bool:
    """Whether q ``(7,)`` is inside its limits as it is, not at other whole turns."""
    outside = 0
    for i in range(q.shape[0]):
        outside += 1 if q[i] < lower[i] - _LIMIT or q[i] > upper[i] + _LIMIT else 0
    return outside == 0


@jit
def _squared(q: Array, seed: Array) -> float:
    total = 0.0
    for i in range(q.shape[0]):
        total += (q[i] - seed[i]) ** 2
    return total


@jit
def nearest_on_motion(
    model: Array, target: Array, joint: int, q: Array, seed: Array, lower: Array, upper: Array
) -> float:
    """Move q ``(7,)``, in place, along its self-motion to where it is nearest to the seed, inside the limits.

    Downhill only, from a configuration that meets the target; returns the squared distance there.
    """
    task, p, n, there = joint_task(model, target, joint), new_point(), np.empty(7), np.empty(7)
    least, most, moved, before, wanted = _squared(q, seed), _STRIDE, 0.0, 0.0, 0.0
    for count in range(_STEPS):
        if count == 0 or moved != 0.0:
            if not linearize(task, q, p) < 1.0:
                break
            down = 0.0  # half the derivative of the squared distance along the curve
            for i in range(7):
                n[i] = p.n[i]
                down += (q[i] - seed[i]) * n[i]
            # The secant of the derivative where it rises, else that of a straight curve.
            slope = (down - before) / moved if moved != 0.0 else 1.0
            wanted = -down / (slope if slope > 0.1 else 1.0)
            before = down
        step = min(max(wanted, -most), most)
        if abs(step) < _CLOSE:
            break
        for i in range(7):
            there[i] = q[i] + step * n[i]
        nearer = newton_to_event(task, PROJECT, 0.0, there, p) and _is_inside(there, lower, upper)
        distance = _squared(there, seed) if nearer else math.inf
        if distance < least:
            least, most, moved = distance, _STRIDE, step
            for i in range(7):
                q[i] = there[i]
        else:
            most, moved = 0.4 * abs(step), 0.0
    return least


@jit
def to_images(q: Array, seed: Array, lower: Array, upper: Array, squares: Array) -> None:
    """Bring configurations q ``(k, 7)``, in place, to the whole turns inside the limits nearest to the seed.

    squares ``(k,)`` ← the squared distance from the seed; infinity for those that do not
    exist or are outside the limits.
    """
    for k in range(q.shape[0]):
        squares[k] = 0.0 if q[k, 0] == q[k, 0] else math.inf
        for i in range(7):
            if squares[k] < math.inf:
                q[k, i] = nearest_image(q[k, i], seed[i], lower[i], upper[i])
                outside = q[k, i] < lower[i] - _LIMIT or q[k, i] > upper[i] + _LIMIT
                squares[k] += math.inf if outside else (q[k, i] - seed[i]) ** 2
