"""What the gizmo offers: the motions of a target that the arm can follow in its task.

An arm of five joints keeps a point and an approach direction, and the roll about it is whatever it is: a ring for
the roll would promise too much. A SCARA arm turns its tool about the vertical and tilts it never. Which motions
there are is read off the Jacobian: one is offered if it lies in the span of what the joints can do.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kin import Robot, Task, jacobian
from kin.transforms import Array

_LOOKS = 9
_TILTS = 5  # rows of the Jacobian that a point and an approach direction take


class Offer(NamedTuple):
    """Which arrows and which rings about the tool's x, y and z axes a gizmo has."""

    arrows: tuple[bool, bool, bool]
    rings: tuple[bool, bool, bool]


@lru_cache(maxsize=256)
def offered(robot: Robot, task: Task) -> Offer:
    """What the arm can follow almost everywhere in this task, judged at a few configurations."""
    q = robot.random_q(np.random.default_rng(5), _LOOKS)
    J = jacobian(robot, q, frame="tool")
    point, approach = J[:, :3], J[:, :_TILTS]
    arrows = (_follows(point, 0), _follows(point, 1), _follows(point, 2))
    if task == "position":
        return Offer(arrows, (False, False, False))
    roll = task == "pose" and _follows(J, 5)
    return Offer(arrows, (_follows(approach, 3), _follows(approach, 4), roll))


def _follows(J: Array, row: int) -> bool:
    """Whether the unit motion along one row lies in the span of Jacobians ``(k, rows, n)``, at most of them."""
    wish = np.zeros(J.shape[1])
    wish[row] = 1.0
    left = [wish - A @ np.linalg.lstsq(A, wish, rcond=1e-9)[0] for A in J]
    return bool(np.median(np.linalg.norm(left, axis=1)) < 1e-6)
