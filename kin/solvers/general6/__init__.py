"""All real solutions of any arm with six joints of which at most two slide, for arms that belong to no family.

The loop of six joints and the target is reduced to one polynomial of degree sixteen in one joint's angle (Raghavan
and Roth 1993, :mod:`kin.solvers.general6.elimination`). It is never written down: its values are determinants,
seventeen of them give it, and all its roots are found at once (:mod:`kin.solvers.general6.roots`). Each real root
gives the other joints by linear algebra, and least squares on the whole loop makes them exact
(:mod:`kin.solvers.general6.recovery`).

Where two slides are opposite each other in the loop, two equations in two angles take the place of the elimination
(:mod:`kin.solvers.general6.opposite`).

The loop may be cut at any of its six joints. Special axes make some of the cuts degenerate: the determinant then
is zero for every angle, and its computed values are rounding errors, which no polynomial of this degree fits. The
best cuts are chosen once for an arm.

Discs around the roots prove for most targets that no solution is missing. Where they do not, another cut is tried,
and solutions of targets close by, until independent ways have found the same (`General6.add_missing`).
"""

from kin.solvers.general6.closed_form import General6 as General6
from kin.solvers.general6.closed_form import match as match
