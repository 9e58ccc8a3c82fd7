"""The tool point alone: five joints, three conditions, so θ4 and θ5 are redundancy parameters.

**Geometry.** Seen from the elbow in frame 3 the tool point is (tx, −m, d4 + C) = (−d6 cos θ4 sin θ5,
−d6 sin θ4 sin θ5, d4 + d6 cos θ5): m is its distance from the plane of the arm. With r = hypot(x, y), h = −z (from
the shoulder's height) and L = hypot(tx, d4 + C), given θ4 and θ5:

- R = ±√(r² − m²), the tool in front of axis 1 or behind it; θ1 = atan2(y, x) − atan2(m, R);
- a planar arm with links a2 and L from (a1, 0) to (R, h): elbow angle ±w, θ3 = w + atan2(tx, d4 + C), then θ2.

So (θ4, θ5) and two signs, together called a *sheet*, determine a configuration.

**Every joint limit is a plane** in the coordinates (C, tx, R), and the configurations form a hyperboloid in them,
R² − tx² − C² = r² − d6². With K = r² + h² + a1² − a2² − d4² − d6², e = a1 + a2 cos θ2, f = h − a2 sin θ2:

- θ1: R = x cos θ1 + y sin θ1 (and m = y cos θ1 − x sin θ1);
- θ2: 2 e R + 2 d4 C = r² + e² + f² − d4² − d6²;
- θ3: 2 a1 R + 2 a2 (tx sin θ3 + (d4 + C) cos θ3) + 2 d4 C = K;
- θ5: C = d6 cos θ5.

In addition there is the edge of reach: R = 0, and the arm stretched or folded, K − 2 d4 C − 2 a1 R = ±2 a2 L.

**θ5 for a given θ4** (`theta5`). Each plane, and the edge, is a polynomial of degree four at most in tan(θ5/2) or
cos θ5. Its real roots, the limits of θ5 and the places where a branch changes its name cut the circle into pieces
on which feasibility is constant. A test of each root and of each piece gives the exact intervals, without
sampling.

**θ4 for which some θ5 exists** (`theta4`). This set is the projection of a region bounded by the same curves. It
ends where two curves intersect or where one has a vertical tangent, along θ5 (cylindrical algebraic decomposition,
Collins 1975). Two planes intersect in a line, which meets the hyperboloid twice. A plane pC C + pT tx + pR R + p0
= 0 has a vertical tangent, that is tx²/sin² θ5 is stationary along it, where R (pC d6² + p0 C) + pR r² C = 0: a
quartic in C; the edge of reach has one at the roots of a polynomial of degree six. Where the edge meets a limit of
θ1 or θ5 the interval may end too, as these do not depend on the side to which the elbow bends. Those points that
are inside all limits cut θ4 into pieces, one test per piece.

**The choice** (`search`). Of a branch's feasible configurations the one nearest to the seed is wanted. It is
searched from the seed itself, and from the best feasible point found, by Newton steps on the condition of the
nearest point within the limits. The result is exact and feasible, and a local minimum of the distance.

Modules: `roots` (real roots of polynomials), `configuration` (one configuration, its branch), `newton` (moving a
configuration along those that reach the point), `planes`, `theta5`, `theta4`, `search`, `solve`.
"""

from kin.solvers.wrist5.point.solve import REDUNDANCIES, solve

__all__ = ["REDUNDANCIES", "solve"]
