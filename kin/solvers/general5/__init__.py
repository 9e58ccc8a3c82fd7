"""All solutions of arms with three to five joints, turning or sliding, for arms that belong to no family.

Virtual joints at the tool complete the arm to six joints, so that the families and the general solver of six
joints (:mod:`kin.solvers.general6`) apply:

- **Five joints:** a roll about the tool's z axis. Every solution meets the point and the approach direction; the
  value of the virtual joint is the roll that is left. If joint 5 is this roll itself, any other axis does, see
  below.
- **Three joints:** three axes through the tool's point, if that makes an arm of a family. Every solution meets the
  point, and the orientation of the target does not matter: one in no special position is asked for. Otherwise a
  polynomial gives the configurations for the point: up to four.
- **Otherwise:** axes in general position. Solutions are those whose virtual joints are at 0: a pose that the arm
  cannot reach has none.

Modules: `completion` (virtual joints), `point` (three joints without them), `closed_form` (the solver contract).
"""

from kin.solvers.general5.closed_form import General5 as General5
from kin.solvers.general5.closed_form import match as match
