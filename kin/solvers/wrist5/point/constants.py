"""Names of the entries of the small arrays that the kernels of the point solver share, and its thresholds."""

from __future__ import annotations

from kin.tolerances import TOLERANCES

# Constants of a problem, k: lengths of the arm; the target's x, y, h = −z, r = hypot(x, y), azimuth, and K.
A1, A2, D4, D6, X, Y, H, RAD, PHI, KAY = range(10)
# Columns of a plane: the joint whose limit it is, the four numbers pC, pT, pR, p0, and m and the sign of sin θ5 on
# it (0 if they vary).
JOINT, PC, PT, PR, P0, M, S = range(7)
# Columns of a piece of θ5: the branch, its ends, the sheet, that is 2 · (tool behind axis 1) + (elbow angle < 0).
BRANCH, START, END, SHEET = range(4)
REACH = TOLERANCES.reach
SLACK = TOLERANCES.limit
INSET = TOLERANCES.interval_inset
AMBIGUOUS = 1e-6  # rad or m; a quantity smaller than this may have either sign, because of rounding
