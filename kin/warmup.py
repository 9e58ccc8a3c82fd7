"""Load or compile every kernel once, so that no user waits for it.

With a warm cache this takes a fraction of a second; on a machine that never ran these kernels some tens of
seconds, which a service spends before it says it is ready.
"""

from __future__ import annotations

import numpy as np

from kin.catalog import builtin_robots
from kin.fk import fk, jacobian, link_frames, manipulability
from kin.ik import solve_ik
from kin.path import solve_path


def warm_up() -> None:
    """Call each public function along each path that has a kernel of its own."""
    for robot in builtin_robots().values():
        q = robot.q_home.copy()
        T = fk(robot, q)
        fk(robot, np.stack([q, q]))
        link_frames(robot, q)
        jacobian(robot, q)
        manipulability(robot, q)
        far = T.copy()
        far[:3, 3] *= 10.0
        solve_ik(robot, T, task="pose")
        solve_ik(robot, T, task="approach")
        solve_ik(robot, T, task="position")
        solve_ik(robot, far, task="pose")
        solve_ik(robot, T, mask=(True, True, False, False, False, False))
        solve_ik(robot, T, task="approach", branch="seed", prefer="manipulability")
        solve_path(robot, fk(robot, np.stack([q, q])))
