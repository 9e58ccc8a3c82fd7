"""Arms whose last joint turns the tool about its point.

Such a joint does not move the point, so the joints before it meet the point alone; virtual joints at the point
(:mod:`kin.solvers.general5`) would not complete the arm.

- **Three joints:** the closed form of the first two (:mod:`kin.solvers.pair2`) meets the point and the direction
  of axis 3. θ3 follows from the orientation; for a point it is free.
- **Four or five joints:** poses have the solver of the whole arm. For a point, that of the other joints applies
  and the last one is free; for an approach direction the last joint turns the tool's z axis to it.
"""

from kin.solvers.turned.closed_form import Turned as Turned
from kin.solvers.turned.closed_form import match as match
from kin.solvers.turned.closed_form import with_point as with_point
