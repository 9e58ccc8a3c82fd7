"""Load or compile every kernel that a service needs once, so that no user waits for it.

The thin call (:mod:`kin.thin`) is for who computes, not for who serves: its kernels are compiled when first used.

With a warm cache this takes a fraction of a second; on a machine that never ran these kernels some tens of
seconds, which a service spends before it says it is ready. Kernels belong to families of arms, not to arms: one
arm of each family is asked, however many there are.
"""

from __future__ import annotations

import numpy as np

from kin.catalog import builtin_robots
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.ik import solve_ik
from kin.path import solve_path
from kin.robot import Robot
from kin.solvers import solver_for


def warm_up() -> None:
    """Call each public function along each path that has a kernel of its own."""
    for robot in one_of_each_family():
        q = robot.q_home.copy()
        T = fk(robot, q)
        fk(robot, np.stack([q, q]))
        link_frames(robot, q)
        fk_positions(robot, q)
        jacobian(robot, q)
        jacobian(robot, np.stack([q, q]))
        manipulability(robot, q)
        far = T.copy()
        far[:3, 3] *= 10.0
        solve_ik(robot, T, task="pose")
        solve_ik(robot, T, task="approach")
        solve_ik(robot, T, task="position")
        solve_ik(robot, far, task="pose")
        solve_ik(robot, T, mask=(True, True, False, False, False, False))
        solve_ik(robot, T, task="pose", prefer="manipulability")
        solve_path(robot, fk(robot, np.stack([q, q])))


def one_of_each_family() -> tuple[Robot, ...]:
    """The first built-in arm of each closed form, and the first that has none."""
    families: dict[str, Robot] = {}
    for robot in builtin_robots().values():
        match = solver_for(robot)
        families.setdefault("" if match is None else match.solver.NAME, robot)
    return tuple(families.values())
