"""Arms with three parallel axes: six joints, axes 2, 3 and 4 parallel, axes 5 and 6 through one point W.

Universal Robots and their kin. With n the direction of axes 2, 3, 4, everything between joint 1 and W happens in
planes perpendicular to n, so two figures of the pose do not depend on joints 2, 3 and 4 (Hawkins, "Analytic
Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms", 2013; the subproblems are those of Elias and Wen,
"IK-Geo",
2022):

- n·W = L, the sum of the offsets along n. In the frame that turns with axis 1 this fixes y, hence
  x = ±√(wx² + wy² − y²), shoulder left or right, and θ1 = atan2(wy, wx) − atan2(y, x);
- R1ᵀ R = Rz(A) Ry(θ5) Rz(θ6) with A = θ2 + θ3 + θ4: two wrists, (A, θ5, θ6) and (A + π, −θ5, θ6 + π);
- A and W give axis 4, and the triangle of axes 2, 3, 4 gives θ3 and θ2, elbow up or down; θ4 = A − θ2 − θ3.

Eight branches. The twist between axes 1 and 2 and all offsets may be anything, but axes 5 and 6 meet at a right
angle. Singular: s3 = 0 (two elbows merge); x = 0 (two shoulders merge); s5 = 0, where axis 6 is parallel to the
three
and θ6 is free: then axis 4 goes round a circle, and where it meets the end of the elbow's reach or a joint a
limit is a root of ``a cos ψ + b sin ψ + c = 0``, so the feasible θ6 are exact arcs.
"""

from kin.solvers.parallel6.closed_form import Parallel6 as Parallel6
from kin.solvers.parallel6.closed_form import match as match
