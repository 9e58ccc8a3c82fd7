"""Every threshold of the core, named and explained in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Thresholds, in metres and radians.

    Attributes:
        closure_position: a solution's FK position must be this close to the target to count as exact.
        closure_rotation: the same for the rotation angle.
        limit: slack on joint limits, so that a target made *at* a stop is not refused for a rounding error.
        merge: two configurations closer than this in every joint are one (double roots of acos and sqrt
            split by the square root of the rounding error, hence far above machine epsilon).
        geometry: lengths and twists closer than this to a family's pattern count as that pattern.
        rotation_matrix: how far RᵀR may be from I in a target; beyond it the target is refused.
        singular: below this sine a closed form has lost one angle and takes it from the seed.
        at_singularity: an answer this near to a singularity (radians, metres) is told to be singular.
    """

    closure_position: float = 1e-9
    closure_rotation: float = 1e-9
    limit: float = 1e-9
    merge: float = 1e-7
    geometry: float = 1e-9
    rotation_matrix: float = 1e-6
    singular: float = 1e-11
    at_singularity: float = 1e-4


TOLERANCES = Tolerances()
