"""Elbow arms with a spherical wrist: six joints, axes 2 and 3 parallel, axes 4, 5 and 6 through one point W.

Most industrial arms are of this family: Puma 560, IRB 120, KR 6. The pose fixes W, and W fixes the first three
joints, whatever the wrist does (Pieper 1968). Seen from the frame that turns with axis 1, the elbow moves in a
plane at the distance L from the axis, so W = (X, L, −h) there and

- X = ±√(wx² + wy² − L²), shoulder in front or at the back; θ1 = atan2(wy, wx) − atan2(L, X);
- D² = (X − a1)² + h²; tan²(θ3/2) = ((a2+f)² − D²)/(D² − (a2−f)²), elbow up or down, where f is the distance of W
  from axis 3; θ2 = atan2(h, X − a1) − atan2(f s3, a2 + f c3);
- R03ᵀ R = Rz(θ4) Ry(θ5) Rz(θ6): two wrists, (θ4, θ5, θ6) and (θ4 + π, −θ5, θ6 + π).

Eight branches; no angle is taken from a sine or cosine alone, so none loses digits. L, a1, the twist from axis
3 to axis 4 and the offsets of the elbow may be anything. Singular: s3 = 0 (two elbows merge); X = 0, where two
shoulders merge, or, if L = 0, W is on axis 1 and θ1 is free: R03ᵀ R is affine in cos θ1, sin θ1 and the
feasible θ1 are exact arcs; s5 = 0 (only θ4 ± θ6 matters).
"""

from kin.solvers.wrist6.closed_form import Wrist6 as Wrist6
from kin.solvers.wrist6.closed_form import match as match
