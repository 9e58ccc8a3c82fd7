"""Seven-joint arms whose joints 1 and 2 turn about the same axis (the redundant arm of the chapter as printed).

**Geometry.** Only the sum θ12 = θ1 + θ2 matters to the tool. The upper arm (length d3) is perpendicular to axis 1
and points along u = (−sin θ12, cos θ12, 0); the forearm (length d5) ends in the wrist centre W, where axes 5, 6, 7
meet. With w = W − S, S the point where the upper arm starts:

- w·u = k with k = (|w|² + d3² − d5²)/(2 d3), so azimuth(u) = atan2(wy, wx) ± acos(k / hypot(wx, wy));
- R02ᵀ (w − d3 u)/d5 = (cos θ3 sin θ4, sin θ3 sin θ4, cos θ4);
- R04ᵀ R = Rz(θ5) Ry(θ6) Rz(θ7).

**Number of solutions.** Two for θ12 (shoulder), two signs of sin θ4 (elbow), two signs of sin θ6 (wrist): eight
branches.

**Redundancy.** Each branch is a family θ2 = θ12 + 2πk − θ1, so the feasible values of θ1 are the intervals
[low1, high1] ∩ [θ12 + 2πk − high2, θ12 + 2πk − low2]. If the task is a point and an approach direction through the
wrist centre, the roll φ about that direction is a second redundancy parameter. R47 is affine in (cos φ, sin φ), so
its feasible intervals are exact, too: their ends are roots of a cos φ + b sin φ + c = 0 (Shimizu et al., IEEE
Trans. Robotics 24(5), 2008).

**Degenerate cases.** sin θ4 = 0 (elbow straight or folded): θ3 and θ5 turn about one line. sin θ6 = 0: only
θ5 ± θ7 is determined. cos θ3 = 0: the two shoulder branches merge. W on axis 1: θ12 is free and taken from the
seed.

Modules: `branches` (all branches of one target, also at singular poses), `redundancy` (feasible intervals of θ1
and of the roll), `batch` (vectorised loops over many targets), `closed_form` (recognition of the family, the
solver contract, singularities).
"""

from kin.solvers.collinear7.closed_form import NAME, Collinear7, match

__all__ = ["NAME", "Collinear7", "match"]
