"""From which configuration a line or an arc arrives as recorded.

The curve is followed backwards, from the recorded joint values to the pose at its start. Followed forwards from
there it arrives as recorded, unless a joint is left over: that is planned along the whole path. So the answer is
followed forwards once more, and compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.fk import fk
from kin.ik.problem import never_cancel
from kin.motion.arrivals import Arrival
from kin.motion.geometry.chain import LostError, followed
from kin.motion.geometry.curves import poses
from kin.motion.geometry.splines import values
from kin.motion.paths import NO_LENGTH, Layout, chained, curve_of
from kin.motion.planning.plan import task_of
from kin.motion.program import Circ, JointTarget, Lin, PoseTarget
from kin.motion.refusals import outside
from kin.motion.results import Motion
from kin.motion.tasks import CODES
from kin.robot import Robot
from kin.transforms import Array

_LOOKS = 999  # places of a path at which the limits of the joints are looked at


def segment_poses(motion: Motion, index: int, count: int) -> Array | None:
    """Poses ``(count, 4, 4)`` at equal steps along the curve of a LIN or CIRC, from its start to its end.

    None if the segment is another one, has no length or no arc, or it is not known where it starts.
    """
    robot, segment, before = motion.robot, motion.program.segments[index], motion.q_before(index)
    if not isinstance(segment, Lin | Circ) or before is None:
        return None
    curve = curve_of(robot, segment, fk(robot, before), task_of(motion.program, robot) != "approach")
    if curve is None or isinstance(curve, tuple) or curve.length < NO_LENGTH:
        return None
    return poses(curve, np.linspace(0.0, curve.length, count))


def start_as_recorded(motion: Motion, index: int, cancel: Callable[[], None] = never_cancel) -> Array | None:
    """The configuration ``(n,)`` at the start of a segment from which it arrives as its target was recorded.

    Args:
        motion: planned, or refused at this segment or a later one.
        index: of a LIN or CIRC whose target has joint values.
        cancel: called now and then; cancels the computation by raising.

    Returns:
        None if there is none inside the limits, the segment is another one, or it is not known where it starts.

    Raises:
        IndexError: there is no such segment.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("ur5")
        >>> motion = kin.plan_motion(arm, [kin.motion.Lin(kin.motion.JointTarget(arm.q_home + 0.02))])
        >>> kin.motion.start_as_recorded(motion, 0).shape
        (6,)
    """
    robot, segment = motion.robot, motion.program.segments[index]
    before = motion.q_before(index)
    if not isinstance(segment, Lin | Circ) or not isinstance(segment.target, JointTarget) or before is None:
        return None
    recorded = np.array(segment.target.q)
    back = replace(segment, target=PoseTarget.of(fk(robot, before)))
    code = CODES[task_of(motion.program, robot)]
    start = _end_of(robot, back, recorded, code, cancel)
    if start is None:
        return None
    end = _end_of(robot, segment, start, code, cancel)
    return start if end is not None and Arrival.of(robot, segment, end).as_recorded else None


def _end_of(robot: Robot, segment: Lin | Circ, q: Array, code: int, cancel: Callable[[], None]) -> Array | None:
    """Where a segment alone arrives from q ``(n,)``; None if it cannot be driven inside the limits."""
    curve = curve_of(robot, segment, fk(robot, q), code != CODES["approach"])
    if curve is None or isinstance(curve, tuple):
        return None
    if curve.length < NO_LENGTH:
        return q
    layout = Layout.of([curve.length], [], 0)
    try:
        knots, pieces = followed(robot, chained([curve], [], layout), q, code, cancel)
    except LostError:
        return None
    path = values(knots, pieces, np.linspace(0.0, float(knots[-1]), _LOOKS))
    return None if outside(robot, path).any() else robot.clip(path[-1])
