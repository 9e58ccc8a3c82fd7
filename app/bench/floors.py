"""Lower bounds for every contestant on this machine: the unit of the gate.

An *empty call* is the cost of a call from Python into compiled code and back. *Sine and cosine* of every joint
value are needed by any forward kinematics.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.sampling.kernels import Points


@jit
def empty_call(model: Array, q: Array) -> float:
    """Does nothing, with the arguments of one pose."""
    return 0.0


@jit
def sines_and_cosines(q: Array) -> float:
    """Sum of sin·cos of all joint values ``(k, n)``; the sum keeps the compiler from dropping them."""
    total = 0.0
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            total += math.sin(q[i, j]) * math.cos(q[i, j])
    return total


@jit
def written(out: Points) -> None:
    """Write every value of an array ``(k, 3)`` once."""
    for i in range(out.shape[0]):
        x = np.float32(i)
        out[i, 0] = x
        out[i, 1] = x
        out[i, 2] = x
