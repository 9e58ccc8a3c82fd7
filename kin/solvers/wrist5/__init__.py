"""Five-joint elbow arms with a two-axis wrist (the Pioneer family).

**Geometry.** Joint axis 1 carries a planar arm with links a2 and d4: axes 2 and 3 are parallel to each other and
perpendicular to axis 1, a1 from it. Axes 3 and 4, and 4 and 5, meet at right angles. The tool point is d6 beyond
the wrist centre along the approach direction, the z axis of the tool.

Five joints meet five conditions: the tool point p and the approach direction a. The roll about a follows from
them. With w = p − d6 a the wrist centre, r = hypot(wx, wy), ρ = ±r − a1, h = −wz (seen from the shoulder's height)
and D² = ρ² + h²:

- θ1 = atan2(±wy, ±wx), the wrist centre in front of axis 1 or behind it;
- tan²(θ3/2) = ((a2 + d4)² − D²)/(D² − (a2 − d4)²), elbow up or down;
  θ2 = atan2(h, ρ) − atan2(d4 sin θ3, a2 + d4 cos θ3);
- u = R03ᵀ a = (−cos θ4 sin θ5, −sin θ4 sin θ5, cos θ5): θ4 = atan2(∓u2, ∓u1), θ5 = atan2(−(u1 cos θ4 + u2 sin θ4),
  u3).

**Number of solutions.** Eight branches (shoulder, elbow, wrist), four where one shoulder side is out of reach.

**Degenerate cases.** sin θ3 = 0: the elbow branches merge. sin θ5 = 0: θ4 is free and taken from the seed. Wrist
centre on axis 1: θ1 is a redundancy parameter; u is affine in (cos θ1, sin θ1), so its feasible intervals end at
roots of a cos θ1 + b sin θ1 + c = 0 and are exact.

**Tool point alone.** Without an approach direction θ4 and θ5 are redundancy parameters, see
:mod:`kin.solvers.wrist5.point`.

Source: planar two-link arm and decoupled wrist as in Paul, "Robot Manipulators", MIT Press 1981; tan(θ/2) form and
intervals as in Shimizu et al., IEEE Trans. Robotics 24(5), 2008.

Modules: `geometry` (layout of the parameter array, wrist angles), `redundancy` (feasible intervals of θ1),
`branches` (all branches of one target, also at singular poses), `batch` (vectorised loops over many targets),
`closed_form` (recognition of the family, the solver contract, singularities).
"""

from kin.solvers.wrist5.closed_form import NAME, Wrist5, match
from kin.solvers.wrist5.geometry import Geometry

__all__ = ["NAME", "Geometry", "Wrist5", "match"]
