"""Arms whose tables are rounded: the nominal family, and every posture on the table as it is.

A right angle typed as 1.5708 is not one, and the closed form of the family does not apply. Its postures are close
to those of the arm whose axes are exactly parallel, perpendicular or intersecting where the table misses that by
little (:mod:`kin.solvers.rounded.table`). That arm's closed form gives the postures, a descent makes each of them
exact on the true table (:mod:`kin.solvers.rounded.closed_form`).

With seven joints each posture is a point of a curve, the self-motion of the table
(:mod:`kin.solvers.selfmotion`). The family gives the structure, and the table the numbers
(:mod:`kin.solvers.rounded.seven`): ends of intervals (:mod:`kin.solvers.rounded.ends`), whole curves where the
structure is in doubt (:mod:`kin.solvers.selfmotion.tracing`), and the posture of each branch
(:mod:`kin.solvers.rounded.rows`).
"""

from kin.solvers.rounded.closed_form import Rounded as Rounded
from kin.solvers.rounded.seven import Rounded7 as Rounded7
from kin.solvers.rounded.table import IntendedArm as IntendedArm
from kin.solvers.rounded.table import intended_arm as intended_arm
