"""The arm as its kernels read it, and the wrist angles that point the tool.

Angles are canonical, θ = q + offset; θ3 = 0 is the straight elbow. Lengths are metres.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.fk import sine_cosine
from kin.kernels.simd import atan2
from kin.solvers.common import HIGH, LOW, NEAR
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Offsets into the parameter array: the first three rows of base⁻¹, joint offsets, lengths.
BASE, OFFSET, A1, A2, D4, D6 = 0, 12, 17, 18, 19, 20
REACH = TOLERANCES.reach
SINGULAR = TOLERANCES.singular


class Geometry(NamedTuple):
    """The arm in canonical form: joint values are q = θ − offset."""

    inverse_base: Array
    offset: Array
    a1: float
    a2: float
    d4: float
    d6: float

    def parameters(self) -> Array:
        """The parameter array of the kernels ``(21,)``."""
        return np.array([*self.inverse_base[:3].ravel(), *self.offset, self.a1, self.a2, self.d4, self.d6])


@jit
def wrist_angles(t1: float, t23: float, a: Array, branch: int, box: Array, out: Array) -> None:
    """out[3], out[4] ← θ4, θ5 that point the tool along a ``(3,)``, given θ1 and θ23 = θ2 + θ3.

    Bit 0 of the branch is the sign of θ5. Where sin θ5 = 0, θ4 is the seed's, inside its limits (box ``(3, 5)``).
    """
    (s1, c1), (s23, c23) = sine_cosine(t1), sine_cosine(t23)
    flip = -1.0 if branch & 1 else 1.0
    level = c1 * a[0] + s1 * a[1]
    u1 = s23 * level + c23 * a[2]
    u2 = s1 * a[0] - c1 * a[1]
    u3 = c23 * level - s23 * a[2]
    across = math.sqrt(u1 * u1 + u2 * u2)
    if across < SINGULAR:
        out[3] = min(max(box[NEAR, 3], box[LOW, 3]), box[HIGH, 3])
        s4, c4 = sine_cosine(out[3])
        out[4] = atan2(-(c4 * u1 + s4 * u2), u3)
    else:
        out[3], out[4] = atan2(-flip * u2, -flip * u1), atan2(flip * across, u3)
