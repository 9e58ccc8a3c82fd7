"""The geometry of an arm with three parallel axes, and the parameter array that its kernels read."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.axes import is_along, is_perpendicular, is_zero, links_of
from kin.robot import Robot
from kin.solvers.canonical import pose_params
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Layout of the parameter array: the first three rows of base⁻¹ and tool⁻¹, then signs and offsets of the joints.
BASE, TOOL, SIGN, OFFSET = 0, 12, 24, 30
# Lengths in metres, cosine and sine of the twist from axis 1 to axis 2.
A1, A2, A3, A4, D5, BESIDE, COS_TWIST, SIN_TWIST = range(36, 44)


class Geometry(NamedTuple):
    """The arm in canonical form: angles are θ = sign q + offset.

    Attributes:
        params: the array ``(44,)`` that the kernels read.
        sign, offset: ``(6,)``.
        a1, a2, a3, a4, d5: distances from axis 1 to 2, 2 to 3, 3 to 4, 4 to 5, and along axis 5 to W.
        beside: L, the sum of the offsets along axes 2, 3 and 4.
        tool_on_axis: whether joint 6 turns the tool about its own z axis.
    """

    params: Array
    sign: Array
    offset: Array
    a1: float
    a2: float
    a3: float
    a4: float
    d5: float
    beside: float
    tool_on_axis: bool


def geometry_of(robot: Robot) -> Geometry | None:
    """The geometry if axes 2, 3, 4 are parallel and 1 is not, 4-5 and 5-6 are perpendicular, and 5 and 6 meet."""
    if robot.n != 6 or not robot.revolute.all():
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if alpha[0] == 0.0 or alpha[1] != 0.0 or alpha[2] != 0.0 or not is_zero(a[4]):
        return None
    if not (is_perpendicular(alpha[3]) and is_perpendicular(alpha[4])) or min(a[1], a[2]) < TOLERANCES.geometry:
        return None
    a1, a2, a3, a4, d5 = (float(x) for x in (a[0], a[1], a[2], a[3], d[4]))
    beside = 0.0 if is_zero(d[3]) else float(d[3])
    shape = [a1, a2, a3, a4, d5, beside, math.cos(alpha[0]), math.sin(alpha[0])]
    pose = pose_params(links.base, links.tool)
    params = np.array([*pose, *links.sign, *links.theta, *shape])
    on_axis = is_zero(links.tool[0, 3], links.tool[1, 3]) and is_along(links.tool)
    return Geometry(params, links.sign, links.theta, a1, a2, a3, a4, d5, beside, on_axis)
