"""The thresholds of the core, named and explained in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Thresholds, in metres and radians.

    Attributes:
        closure_position: largest position error, measured by FK, of a solution that counts as exact.
        closure_rotation: the same for the rotation error.
        limit: slack on joint limits, so that a rounding error does not reject a configuration *at* a limit.
        merge: configurations closer than this in every joint are duplicates. Double roots of acos and sqrt
            split by the square root of the rounding error, hence the value far above machine epsilon.
        geometry: lengths and twists this close to the pattern of a solver family match it.
        rotation_matrix: largest deviation of RᵀR from I in a target; beyond it the target is rejected.
        singular: sine below which a closed form cannot determine an angle and takes it from the seed.
        at_singularity: distance to a singularity (radians, metres) below which a solution is reported as singular.
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
