"""The arm that is left of another one under limits and locks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kin.ik.options import JointConstraints
from kin.robot import Robot
from kin.solvers.reduced import fixed
from kin.transforms import Array


@dataclass(frozen=True, eq=False)
class Movable:
    """An arm without its locked joints.

    Attributes:
        whole: the arm with them.
        arm: the same with narrower limits, and with locked joints as rigid links.
        locked: their values, by index.
    """

    whole: Robot
    arm: Robot
    locked: dict[int, float]

    @classmethod
    def of(cls, robot: Robot, constraints: JointConstraints) -> Movable:
        """What the constraints leave; raises `InputError` naming the wrong limit or lock."""
        lower, upper, _ = constraints.bounds(robot)
        rows = list(robot.rows)
        for i, k in enumerate(robot.joint_rows):
            if np.isfinite(upper[i] - lower[i]):  # a joint without limits of its own may be given some
                rows[k] = replace(rows[k], limits=(float(lower[i]), float(upper[i])))
        locked = {i: x for i, x in enumerate(constraints.locks(robot) or ()) if x is not None}
        narrowed = replace(robot, rows=tuple(rows))
        return cls(robot, fixed(narrowed, locked) if locked else narrowed, locked)

    @property
    def joints(self) -> list[int]:
        """Indices in the whole arm of the joints that move."""
        return [i for i in range(self.whole.n) if i not in self.locked]

    def expanded(self, q: Array) -> Array:
        """Configurations of the whole arm ``(…, n)`` from those of the joints that move."""
        out = np.empty((*q.shape[:-1], self.whole.n))
        out[..., self.joints] = q
        out[..., list(self.locked)] = list(self.locked.values())
        return out
