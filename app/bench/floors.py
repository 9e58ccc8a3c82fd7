"""What no contestant can be faster than here: the unit in which the gate measures us.

An *empty call* is what it costs to get from Python into compiled code and back. *Sine and cosine* of every joint
value are what forward kinematics cannot do without.
"""

from __future__ import annotations

import math

from kin.compiled import jit
from kin.transforms import Array


@jit
def empty_call(model: Array, q: Array) -> float:
    """Nothing, with the arguments of one pose."""
    return 0.0


@jit
def sines_and_cosines(q: Array) -> float:
    """Sum of sin·cos of all joint values ``(k, n)``; the sum keeps the compiler from dropping them."""
    total = 0.0
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            total += math.sin(q[i, j]) * math.cos(q[i, j])
    return total
