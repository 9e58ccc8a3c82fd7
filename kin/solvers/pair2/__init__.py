"""Arms with one or two joints of any kind, in any position.

Seen from axis 1, some numbers of the tool do not depend on joint 1: height and distance of the point from a point
of the axis where joint 1 turns, the point's two coordinates across the axis where it slides, and the like of the
tool's directions. Each is linear in cosine and sine of θ2, so that one of them leaves two values of joint 2.
Joint 1 follows from the point, or from the directions where the point is on axis 1.

A pose fixes more than two joints can meet. Where not all of it can be met, the point comes first; the caller
measures what is left.

Modules: `geometry` (vectors, invariants), `configurations` (kernels), `closed_form` (the solver contract).
"""

from kin.solvers.pair2.closed_form import Pair2 as Pair2
from kin.solvers.pair2.closed_form import kernels_of as kernels_of
from kin.solvers.pair2.closed_form import match as match
