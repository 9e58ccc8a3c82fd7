"""The six cuts of an arm's loop as arrays that the kernels read.

A joint's value in the loop is an angle, or the travel of a slide in sizes of the arm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kin.axes import Links, links_of, screw_x, screw_z
from kin.robot import Robot
from kin.transforms import Array

Flags = NDArray[np.bool_]

# Layout of the parameter array of one cut: the first joint of the loop, the place of the target in it, the size of
# the arm in metres; signs and offsets of the joints in the robot's order; the six transforms of the loop; what
# stands before and after the target's inverse; which joints of the loop slide.
SHIFT, PLACE, SIZE_OF_ARM = range(3)
SIGN, OFFSET, LOOP = 3, 9, 15
BEFORE, AFTER, SLIDES = LOOP + 72, LOOP + 84, LOOP + 96
SIZE = SLIDES + 6
# Offsets of d and e: without them, the zeros and right angles of tables would meet infinite half tangents.
TURN_D, TURN_E = 0.7391, 1.1713


def cuts_of(robot: Robot) -> list[Array]:
    """The parameter arrays ``(117,)`` of the loops that begin with joint 0, 1, …

    A loop whose last joint slides is left out: only the turns of that joint leave the equations.
    """
    links = links_of(robot, (1,) * 5)
    size = size_of(robot, links)
    return [cut_at(links, ~robot.revolute, size, shift) for shift in range(6) if robot.revolute[shift - 1]]


def size_of(robot: Robot, links: Links) -> float:
    """The size of an arm, with the travel that its slides have by their limits, metres."""
    strokes = [max(map(abs, joint.limits)) for joint in robot.joints if joint.kind == "prismatic" and joint.limits]
    return float(np.abs(links.a).sum() + np.abs(links.d).sum() + sum(strokes)) or 1.0


def cut_at(links: Links, slides: Flags, size: float, shift: int) -> Array:
    """The parameter array of the loop that begins with joint `shift`."""
    out = np.zeros(SIZE)
    out[SHIFT], out[PLACE], out[SIZE_OF_ARM] = shift, (5 - shift) % 6, size
    out[SIGN:OFFSET], out[OFFSET:LOOP] = links.sign, np.where(slides, links.d / size, links.theta)
    out[SLIDES:SIZE] = np.roll(slides, -shift)
    # Of a joint, what its value is not added to: the offset along its axis, or the angle about it.
    along = [screw_z(links.theta[i], 0.0) if slides[i] else screw_z(0.0, links.d[i]) for i in range(6)]
    for place in range(6):
        joint, following = (shift + place) % 6, (shift + place + 1) % 6
        turn = {2: TURN_D, 3: TURN_E}.get(place, 0.0)
        after = np.eye(4) if slides[following] else screw_z(turn, 0.0)
        if joint == 5:
            out[BEFORE:AFTER] = _rows(along[5] @ links.tool, size)
            out[AFTER:SLIDES] = _rows(links.base @ after, size)
        else:
            link = along[joint] @ screw_x(links.a[joint], links.alpha[joint])
            out[LOOP + 12 * place : LOOP + 12 * place + 12] = _rows(link @ after, size)
    return out


def _rows(T: Array, size: float) -> Array:
    """The first three rows of a transform ``(12,)``, its lengths in arm sizes."""
    rows = T[:3].copy()
    rows[:, 3] /= size
    return rows.ravel()
