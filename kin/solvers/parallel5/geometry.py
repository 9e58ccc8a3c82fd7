"""The geometry of an arm with three parallel axes and at most a roll, and the parameter array of its kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kin.axes import inverse, is_along, is_perpendicular, is_zero, links_of
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Layout of the parameter array: the first three rows of base⁻¹ and of the inverse of what turns the tool, then
# signs and offsets of the joints (the fifth is 0 where there is none).
BASE, TURNED, SIGN, OFFSET = 0, 12, 24, 29
# Lengths in metres; C as seen from axis 4, along x and y of its link; the distance L; how far C is from the origin
# of the last frame, along the roll axis; 1.0 if there is a roll; the tool's z axis, for arms without one.
A1, A2, A3, P, Q, BESIDE, ALONG, ROLLS, TOOL_Z = 34, 35, 36, 37, 38, 39, 40, 41, 42


class Geometry(NamedTuple):
    """The arm in canonical form: angles are θ = sign q + offset.

    Attributes:
        params: the array ``(45,)`` that the kernels read.
        sign, offset: ``(n,)``.
        a1, a2, a3: distances from axis 1 to 2, 2 to 3, 3 to 4.
        p, q: C as seen from axis 4, along x and y of its link.
        beside: L, the distance of C from axis 1 along the parallel axes.
        tool_on_axis: whether the roll, if there is one, keeps the tool's point and z axis.
    """

    params: Array
    sign: Array
    offset: Array
    a1: float
    a2: float
    a3: float
    p: float
    q: float
    beside: float
    tool_on_axis: bool


def geometry_of(robot: Robot) -> Geometry | None:
    """The geometry if axes 2, 3, 4 are parallel and perpendicular to axis 1, and axis 5 to them."""
    if robot.n not in (4, 5) or not robot.revolute.all():
        return None
    rolls = robot.n == 5
    links = links_of(robot, (-1,) * (robot.n - 1))
    a, d, alpha, tool = links.a, links.d, links.alpha, links.tool
    if not is_perpendicular(alpha[0]) or alpha[1] != 0.0 or alpha[2] != 0.0:
        return None
    if (rolls and not is_perpendicular(alpha[3])) or min(a[1], a[2]) < TOLERANCES.geometry:
        return None
    if rolls:
        p, q, beside, along = float(a[3]), float(tool[2, 3]), float(d[3]), float(tool[2, 3])
        on_axis = is_zero(tool[0, 3], tool[1, 3]) and is_along(tool)
        turned = inverse(tool)
    else:
        p, q, beside, along = float(tool[0, 3]), float(tool[1, 3]), float(tool[2, 3]), 0.0
        on_axis, turned = True, np.eye(4)
        turned[:3, :3] = tool[:3, :3].T
    a1, a2, a3 = (float(x) for x in a[:3])
    beside = 0.0 if is_zero(beside) else beside
    sign, offset = np.ones(5), np.zeros(5)
    sign[: robot.n], offset[: robot.n] = links.sign, links.theta
    lengths = [a1, a2, a3, p, q, beside, along, float(rolls), *tool[:3, 2].tolist()]
    poses = [*inverse(links.base)[:3].ravel(), *turned[:3].ravel()]
    params = np.array([*poses, *sign, *offset, *lengths])
    return Geometry(params, links.sign, links.theta, a1, a2, a3, p, q, beside, on_axis)
