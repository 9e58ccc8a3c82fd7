"""All real solutions of any arm with seven revolute joints for a given value of one joint.

The given joint is the last or the first one. Its rotation is moved into the target, and what is left is an arm
with six joints that does not depend on the value: a family with a closed form if there is one, else
:mod:`kin.solvers.general6`, whose cuts are validated once.

Rows are numbered, not named: from one value to the next, solutions appear, vanish and change places. Where all
values are asked for, the solutions at some of them are followed along their self-motions
(:mod:`kin.solvers.selfmotion`). That gives every range, and the solution nearest to a seed
(:mod:`kin.solvers.general7.motion`). Both ways agree if at each of these values as many motions pass as there are
solutions. A motion that is wholly between two of the values is missed by both. The values may be those of the
joint at the other end, if the arm without it is solved with more certainty; few are enough if a nominal arm tells
where there are motions.
"""

from kin.solvers.general7.closed_form import NAME as NAME
from kin.solvers.general7.closed_form import General7 as General7
from kin.solvers.general7.closed_form import match as match
