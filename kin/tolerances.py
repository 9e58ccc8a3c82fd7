"""The thresholds of the core, named and explained in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Thresholds, in metres and radians.

    Attributes:
        closure_position: largest position error, measured by FK, of a solution that counts as exact.
        closure_rotation: the same for the rotation error.
        reach: how far a target may be beyond the reach of a closed form, whose arm is straight or folded then. Its
            error has to stay below `closure_position`.
        rounding: error of the coordinates of a target that is computed, of an arm of some metres.
        double_root: the same of a length or an angle of which two solutions merge there: its square root.
        limit: slack on joint limits, so that a rounding error does not reject a configuration *at* a limit.
        merge: configurations closer than this in every joint are duplicates. Double roots of acos and sqrt
            split by the square root of the rounding error, hence the value far above machine epsilon.
        geometry: lengths and twists this close to the pattern of a solver family match it.
        rotation_matrix: largest deviation of RᵀR from I in a pose; beyond it a pose is rejected, and a target made
            orthonormal if it may have been rounded (`kin.ik.problem`).
        singular: sine below which a closed form cannot determine an angle and takes it from the seed.
        regular: smallest singular value of the Jacobian, as a share of the largest, above which a solution has no
            other one beside it.
        at_singularity: distance to a singularity (radians, metres) below which a solution is reported as singular.
        near_miss: a candidate that misses its target or its limits by less than this in all (metres and radians
            added) is refined by a descent. Where two branches merge, a rounding error of 1e-16 in the target is
            1e-8 in an angle.
        point_met: distance below which a descent has reached a point. It ends at about the root of the rounding
            error where the arm is singular.
        same_distance: lengths that differ by less count as equal when a target is judged too far or too near:
            the distance of the nearest point comes from a descent.
        same_minimum: descents whose errors (metres) differ by less ended in the same minimum.
        same_minimum_angle: the same for errors in radians.
        better_minimum, better_minimum_share: a later minimum replaces an earlier one if it is smaller by this
            share of it and this many metres. Otherwise rounding would decide between equal minima, and the arm
            would jump while a target is dragged out of reach.
        same_branch: joint values (radians, metres) that differ by less are on the same branch.
        interval_inset: how far inside the ends of its feasible interval a redundancy parameter stays, so that
            rounding does not carry a joint past its limit.
    """

    closure_position: float = 1e-9
    closure_rotation: float = 1e-9
    reach: float = 1e-10
    rounding: float = 1e-14
    double_root: float = 3e-7
    limit: float = 1e-9
    merge: float = 1e-7
    geometry: float = 1e-9
    rotation_matrix: float = 1e-6
    singular: float = 1e-11
    regular: float = 1e-4
    at_singularity: float = 1e-4
    near_miss: float = 1e-6
    point_met: float = 1e-7
    same_distance: float = 1e-6
    same_minimum: float = 1e-9
    same_minimum_angle: float = 1e-6
    better_minimum: float = 1e-12
    better_minimum_share: float = 1e-6
    same_branch: float = 0.05
    interval_inset: float = 1e-7


TOLERANCES = Tolerances()
