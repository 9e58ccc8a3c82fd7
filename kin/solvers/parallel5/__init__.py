"""Arms with four or five joints: three parallel axes behind axis 1, and a roll.

**Geometry.** Axes 2, 3 and 4 have the common direction n, perpendicular to axis 1: joints 2, 3 and 4 move the tool
in a plane that joint 1 turns. Axis 5 lies in a plane perpendicular to n and rolls the tool. Arms with four joints
have no roll. C is the tool's point or, if the tool is beside axis 5, the point of axis 5 nearest to it. It is L
from axis 1 along n.

- x = ±√(cx² + cy² − L²), in front of axis 1 or behind it; θ1 = atan2(cy, cx) − atan2(L, x).
- In the frame that turns with axis 1 the target's rotation is Rz(ψ) Rx(−90°) Rz(θ5), so its third column gives ψ =
  θ2 + θ3 + θ4, and its third row gives θ5.
- (x, cz) and ψ give axis 4, the triangle of axes 2, 3 and 4 gives θ3 and θ2, elbow positive or negative.

**Number of solutions.** Four branches (shoulder, elbow).

**Orientations out of reach.** The poses of such an arm are a set of five dimensions (four without the roll). Of
any other target the point is kept; ψ and θ5 are those of the nearest rotation, since the half sum and the half
difference of the outer angles of Rz(ψ) Rx(β) Rz(θ5) do not depend on β. The caller decides whether to accept the
result.

**Degenerate cases.** sin θ3 = 0: the elbow branches merge. x = 0: the shoulder branches merge. C on axis 1 (L =
0): the orientation gives θ1; if axis 5 is on axis 1, only the sum or difference of θ1 and θ5 counts.

**Tool point alone.** ψ is a redundancy parameter with exact arcs (:mod:`kin.solvers.planar`), and so is θ5.

Source: planar arm with three links as in Craig, "Introduction to Robotics", chapter 4.

Modules: `geometry` (recognition, parameter array), `branches` (kernels), `closed_form` (the solver contract).
"""

from kin.solvers.parallel5.closed_form import NAME as NAME
from kin.solvers.parallel5.closed_form import Parallel5 as Parallel5
from kin.solvers.parallel5.closed_form import match as match
