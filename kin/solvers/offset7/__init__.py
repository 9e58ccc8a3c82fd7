"""Seven-joint arms with a spherical shoulder or wrist and offsets elsewhere: Panda, Gen3, xArm7, Fetch, PR2.

**Geometry.** Three axes at one end of the arm meet in a point W. The joint at the other end is given; its rotation
is moved into the target. Of the three joints between, the axes of the two next to the given joint meet in a point
O. Counted from the given joint, which is joint 1 of the chain:

- |W − O|² is a constant plus A cos t4 + B sin t4: two elbows;
- the height of W along axis 2 depends on t3 then: two sides of the plane of axes 2 and 3;
- t2 turns W into place, and ``Rz(t5) Ry(t6) Rz(t7)`` is left: two signs of sin t6.

**Number of solutions.** Eight branches for each value of the given joint. For the Panda (joint 7 given) this is
the result of He and Liu (Analytical inverse kinematics for Franka Emika Panda, 2021), with both elbows.

**Redundancy.** The redundancy parameter is the value of the given joint. Its feasible values have no closed form:
they are found by sampling, and their ends by root finding (:mod:`kin.solvers.offset7.ranges`).

Modules: `geometry` (recognition, parameters), `branches` (all branches at one value), `ranges` (feasible
intervals), `closed_form` (the solver contract).
"""

from kin.solvers.offset7.closed_form import NAME as NAME
from kin.solvers.offset7.closed_form import Offset7 as Offset7
from kin.solvers.offset7.closed_form import match as match
