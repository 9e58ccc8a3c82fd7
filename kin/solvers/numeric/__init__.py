"""A numeric solver for any chain: bounded Levenberg–Marquardt on the task error, from several starts.

It answers what the closed forms do not: what is the *closest* configuration inside the limits when a target
cannot be met, and how to meet a task that has no closed form. It minimises

    E(q)² = |Δp|² + (ℓ · angle)²

with Δp the position error in metres, the angle between the orientations (pose) or approach directions
(approach; ignored for position), and ℓ metres per radian. A mask keeps some of the six coordinates (Δp, φ) of
the error in the target's or the base frame.

**One descent.** Gradient and Gauss–Newton matrix JᵀJ come from the geometric Jacobian. For the three whole tasks
the gradient is exact at any angle: the log of a rotation is its own image under the inverse left Jacobian; for a
mask that Jacobian has to be applied. The damping follows the gain ratio, the actual decrease over the decrease
that the quadratic model predicts (Nielsen, Damping Parameter in Marquardt's Method, 1999). As E → 0 it vanishes,
and convergence is quadratic. Where the target is out of reach, E stays positive, and Gauss–Newton only creeps:
there the second derivatives are added, which for a chain of screws cost almost nothing (a later axis is turned
by an earlier one), and it is Newton's method (Nocedal & Wright, Numerical Optimization, chapters 3, 10 and 16).

**Limits.** A joint that the step would carry past a limit goes to the image of that angle a whole turn away if
that one is inside: a joint with a range of a turn or more has no limit, and one of 340° leaps the gap. Otherwise
it goes to its limit and the other joints are solved again with it held there (an active set). Joints at a limit
whose gradient pushes outwards are held from the start. No configuration that is tried is ever outside.

**Many starts.** A descent may end in a valley that is not the deepest. `solve` descends from the seed and then
from points spread evenly over the limits until one meets the target, and drops a descent early that makes no
progress. The longer nothing is found, the more patience each descent is given.

Arguments are grouped: a *goal* is the tuple (target pose ``(4, 4)``, task code, mask ``(7,)``, metres per
radian), *bounds* are (lower, upper, turns), each ``(n,)``; turns is 2π for a joint that has whole-turn images,
else 0.
"""

from kin.solvers.numeric.starts import descend_freely as descend_freely
from kin.solvers.numeric.starts import each_of as each_of
from kin.solvers.numeric.starts import solve as solve
from kin.solvers.numeric.starts import spread as spread
