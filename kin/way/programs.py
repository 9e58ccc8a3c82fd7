"""A way as a program: PTP segments through its waypoints, with zones where the motion stays free with them.

The joints of a PTP that stops at both ends do not move on a straight line: each keeps its own limits on the way.
So the motion of the program is checked, not taken for the way. Where it touches, the zone is made smaller, and
then a waypoint is put in the middle of the straight line, which the motion cannot leave by much then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from kin.collision import Obstacle
from kin.errors import InputError
from kin.ik.problem import never_cancel
from kin.motion import JointTarget, Motion, Ptp, plan_motion
from kin.way.results import Way

ZONES = (0.05, 0.02, 0.005, 0.0)  # metres, the largest one that touches nothing is taken
_ROUNDS = 60


def way_program(
    way: Way,
    obstacles: Sequence[Obstacle] = (),
    avoid_self_collision: bool = False,
    cancel: Callable[[], None] = never_cancel,
    like: Ptp | None = None,
) -> Motion:
    """The motion through the waypoints of a way, proven free; its `program` starts at the start of the way.

    Args:
        way: that was found.
        obstacles, avoid_self_collision: what must not be touched.
        cancel: called now and then; cancels by raising.
        like: its segments have the speed, acceleration and limits of the tool of this one.

    Raises:
        InputError: no way was found.
    """
    if way.q is None:
        raise InputError("way", way.reason, "a way that was found")
    like = like or Ptp(JointTarget(tuple(way.q[-1].tolist())))
    q = list(way.q)
    zones = [0] * len(q)
    for _ in range(_ROUNDS):
        segments = [
            replace(like, target=JointTarget(tuple(row.tolist())), blend=ZONES[zone] if i < len(q) - 2 else 0.0)
            for i, (row, zone) in enumerate(zip(q[1:], zones[1:], strict=True))
        ]
        motion = plan_motion(
            way.robot,
            segments,
            q[0],
            avoid_self_collision=avoid_self_collision,
            obstacles=obstacles,
            cancel=cancel,
        )
        if motion.refusal is None or motion.refusal.cause != "collision":
            return motion
        k = motion.refusal.segment + 1  # of the waypoint that it leads to
        around = [i for i in (k - 1, k) if 0 < i < len(q) - 1 and zones[i] < len(ZONES) - 1]
        if around:
            for i in around:
                zones[i] += 1
        else:
            q.insert(k, 0.5 * (np.asarray(q[k - 1]) + np.asarray(q[k])))
            zones.insert(k, len(ZONES) - 1)
    return motion
