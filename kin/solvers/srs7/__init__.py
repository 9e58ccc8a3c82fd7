"""S-R-S arms: seven joints with a spherical shoulder, a revolute elbow and a spherical wrist (KUKA iiwa).

**Geometry.** Joint axes 1, 2, 3 meet in the shoulder centre S, joint axes 5, 6, 7 in the wrist centre W, and the
elbow axis 4 is perpendicular to both links SE (length d3) and EW (length d5). A target pose fixes W. The triangle
S–E–W has three known sides, so it is fixed up to a rotation about the line SW. That rotation is the redundancy
parameter, the *arm angle* ψ. With u = unit(W − S), e2 = unit(u × z), e1 = e2 × u, the elbow lies in the direction

    radial(ψ) = e1 cos ψ + e2 sin ψ,

so ψ = 0 is the highest elbow, and |θ4| = 2 atan √(((d3 + d5)² − L²) / (L² − (d3 − d5)²)) with L = |W − S|.

**Number of solutions.** For a given ψ there are eight branches, the signs of sin θ2, sin θ4 and sin θ6. With
A = d3 (d3 + d5 cos θ4)/L and ρ = d3 d5 sin |θ4|/L,

- R03 = [x3 y3 z3] with z3 = (A u + ρ radial)/d3 = unit(E − S), y3 = −sign(θ4) u × radial; its Z-Y-Z angles are θ1,
  θ2, θ3;
- R47 = R04ᵀ R; its Z-Y-Z angles are θ5, θ6, θ7.

**Redundancy.** Both rotations are affine in (cos ψ, sin ψ), so the arm angles at which a joint meets a limit are
roots of a cos ψ + b sin ψ + c = 0. Between neighbouring roots nothing changes: the feasible intervals of ψ are
exact, not sampled.

**Degenerate cases.** θ4 = 0 (elbow straight): the two elbow branches merge and θ3, θ5 turn about one line.
sin θ2 = 0 or sin θ6 = 0: only θ1 ± θ3 or θ5 ± θ7 is determined. W on joint axis 1: ψ has no reference direction,
the x axis of the base replaces it.

Source: Shimizu, Kakuya, Yoon, Kitagaki, Kosuge, "Analytical inverse kinematic computation for 7-DOF redundant
manipulators with joint limits and its application to redundancy resolution", IEEE Trans. Robotics 24(5), 2008.

Modules: `geometry` (triangle, rotations, arm angle), `redundancy` (feasible intervals and choice of ψ),
`branches` (all branches of one target, also at singular poses), `batch` (vectorised loops over many targets),
`closed_form` (recognition of the family, the solver contract, singularities).
"""

from kin.solvers.srs7.closed_form import NAME, Srs7, match

__all__ = ["NAME", "Srs7", "match"]
