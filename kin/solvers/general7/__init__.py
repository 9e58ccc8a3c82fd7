"""All real solutions of any arm with seven revolute joints for a given value of one joint.

The given joint is the last or the first one. Its rotation is moved into the target, and what is left is an arm
with six joints that does not depend on the value: a family with a closed form if there is one, else
:mod:`kin.solvers.general6`, whose cuts are validated once.

Rows are numbered, not named: from one value to the next, solutions appear, vanish and change places. The range of
a solution is found by following its self-motion (:mod:`kin.solvers.selfmotion`), and so is the solution nearest
to a seed (:mod:`kin.solvers.general7.motion`).
"""

from kin.solvers.general7.closed_form import NAME as NAME
from kin.solvers.general7.closed_form import General7 as General7
from kin.solvers.general7.closed_form import match as match
