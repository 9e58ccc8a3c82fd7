"""The canonical form of a seven-joint arm, as the kernels of its closed form read it.

Canonical angles are θ = q + offset, and the canonical target is ``base⁻¹ · T · tool⁻¹``: in these the formulas of
a family have no constants but the lengths of upper arm and forearm. An arm is one float64 array:

======================  =================================
``arm[BASE:TOOL]``      first three rows of base⁻¹
``arm[TOOL:OFFSET]``    first three rows of tool⁻¹
``arm[OFFSET:+7]``      joint offsets, radians
``arm[UPPER_ARM]``      length of the upper arm d3, metres
``arm[FOREARM]``        length of the forearm d5, metres
======================  =================================
"""

from __future__ import annotations

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.pose import canonical
from kin.transforms import Array

BASE, TOOL, OFFSET, UPPER_ARM, FOREARM = 0, 12, 24, 31, 32


def parameters(inverse_base: Array, inverse_tool: Array, offset: Array, d3: float, d5: float) -> Array:
    """The parameter array ``(33,)`` of an arm."""
    return np.array([*inverse_base[:3].ravel(), *inverse_tool[:3].ravel(), *offset, d3, d5])


@jit
def canonical_pose(arm: Array, T: Array, M: Array) -> None:
    """M ← the first three rows of base⁻¹ · T · tool⁻¹, for ``(4, 4)`` arrays."""
    (
        M[0, 0], M[0, 1], M[0, 2], M[0, 3], M[1, 0], M[1, 1], M[1, 2], M[1, 3], M[2, 0], M[2, 1], M[2, 2], M[2, 3]
    ) = canonical(arm, T)  # fmt: skip


@jit
def canonical_box(offsets: Array, seed: Array, lower: Array, upper: Array, box: Array) -> None:
    """Rows NEAR, LOW, HIGH of box ``(≥ 3, n)`` ← seed and joint limits ``(n,)`` as canonical angles."""
    for i in range(offsets.shape[0]):
        box[NEAR, i], box[LOW, i], box[HIGH, i] = (
            seed[i] + offsets[i],
            lower[i] + offsets[i],
            upper[i] + offsets[i],
        )
