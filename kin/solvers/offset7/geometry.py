"""The chain of an arm with a spherical shoulder or wrist, and the parameter array that its kernels read.

The chain is the arm, or the arm from the tool to the base, so that its first joint is the one that is given and
its last three meet in one point. Chain joint i turns by ``t_i = sign_i q_j + offset_i`` with j = i, or j = 6 − i
where the chain is reversed. It has the links of :class:`kin.axes.Links`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.axes import Links, inverse, is_perpendicular, is_zero, links_of
from kin.robot import Robot
from kin.solvers.canonical import pose_params
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Layout of the parameter array: the first three rows of base⁻¹ and of tool⁻¹, signs and offsets of the chain's
# joints, lengths d and a, cosines and sines of the twists, the wrist centre as seen from joint 4, 1.0 if the chain
# is reversed, and the metres by which lengths may miss and still close.
SIGN, OFFSET = 24, 31
D1, A1, COS1, SIN1, D2, COS2, SIN2, A3, D3, COS3, SIN3, X4, Y4, Z4, COS4, SIN4, REVERSED, REACH = range(38, 56)
_TWISTS = (1, 1, 1, 1, -1, 1)
_REVERSED_TWISTS = (-1, 1, 1, 1, 1, 1)


class Geometry(NamedTuple):
    """A chain of seven joints of which the first is given.

    Attributes:
        params: the array ``(56,)`` that the kernels read.
        reversed: whether the chain runs from the tool to the base.
        sign, offset: ``(7,)``, in the order of the chain.
        elbow: t4 where the wrist centre is farthest from the meeting point of axes 2 and 3.
        base: ``(4, 4)`` of the arm's own links.
        along: 1.0 if the upper arm of a spherical shoulder points along axis 3, −1.0 if against it.
    """

    params: Array
    reversed: bool
    sign: Array
    offset: Array
    elbow: float
    base: Array
    along: float

    def joint(self, i: int) -> int:
        """The index in the arm of chain joint i."""
        return 6 - i if self.reversed else i


def geometry_of(robot: Robot) -> Geometry | None:
    """The geometry if one end of the arm is spherical and of the other four axes the second and third meet.

    Counted from the other end. Where both ends are spherical, the last joint is the given one.
    """
    if robot.n != 7 or not robot.revolute.all():
        return None
    links = links_of(robot, _REVERSED_TWISTS)
    found = _geometry(_reversed(links), True, links.base)
    if found is None:
        links = links_of(robot, _TWISTS)
        found = _geometry(links, False, links.base)
    return found


def _reversed(links: Links) -> Links:
    """The chain from the tool to the base: ``(Rz(θ) Tz(d) Tx(a) Rx(α))⁻¹`` regrouped around each joint."""
    a, alpha = np.zeros(7), np.zeros(7)
    a[:6], alpha[:6] = -links.a[5::-1], -links.alpha[5::-1]
    base, tool = inverse(links.tool), inverse(links.base)
    return Links(base, -links.sign[::-1], -links.theta[::-1], -links.d[::-1], a, alpha, tool)


def _geometry(links: Links, is_reversed: bool, base: Array) -> Geometry | None:
    """The geometry of a chain, None if it has another form."""
    a, d, alpha = links.a, links.d, links.alpha
    spherical = is_perpendicular(alpha[4]) and is_perpendicular(alpha[5]) and is_zero(a[4], a[5], d[5])
    meet = is_zero(a[1]) and abs(math.sin(alpha[1])) > math.sqrt(TOLERANCES.geometry)
    if not (spherical and meet):
        return None
    c1, s1, c2, s2, c3, s3, c4, s4 = (f(x) for x in alpha[:4].tolist() for f in (math.cos, math.sin))
    x4, y4, z4 = float(a[3]), -s4 * float(d[4]), float(d[3]) + c4 * float(d[4])
    cosine, sine = a[2] * x4 + d[2] * s3 * y4, d[2] * s3 * x4 - a[2] * y4
    if math.hypot(cosine, sine) < TOLERANCES.geometry:
        return None
    shape = [d[0], a[0], c1, s1, d[1], c2, s2, a[2], d[2], c3, s3, x4, y4, z4, c4, s4, float(is_reversed)]
    shape.append(TOLERANCES.reach)
    params = np.array([*pose_params(links.base, links.tool), *links.sign, *links.theta, *shape])
    along = 1.0 if d[4] <= 0.0 else -1.0
    return Geometry(params, is_reversed, links.sign, links.theta, math.atan2(sine, cosine), base, along)
