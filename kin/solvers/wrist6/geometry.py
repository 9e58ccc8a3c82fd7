"""The geometry of an arm with a spherical wrist, and the parameter array that its kernels read."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.axes import Links, is_along, is_perpendicular, is_zero, links_of
from kin.robot import Robot
from kin.solvers.canonical import pose_params
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Layout of the parameter array: the first three rows of base⁻¹ and tool⁻¹, then signs and offsets of the joints.
BASE, TOOL, SIGN, OFFSET = 0, 12, 24, 30
# Lengths in metres; how axis 4 is turned against the line from axis 3 to W: cosine and sine of a rotation about
# axis 3 and of the twist; 1.0 if joint 3 slides.
A1, A2, F, BESIDE, COS_PHASE, SIN_PHASE, COS_TWIST, SIN_TWIST, SLIDES = range(36, 45)


class Geometry(NamedTuple):
    """The arm in canonical form: angles are θ = sign q + offset.

    Attributes:
        params: the array ``(45,)`` that the kernels read.
        sign, offset: ``(6,)``.
        a1, a2, f, beside: distances from axis 1 to 2, 2 to 3, 3 to W, and of the arm's plane from axis 1 (L).
        tool_on_axis: whether joint 6 turns the tool about its own z axis.
    """

    params: Array
    sign: Array
    offset: Array
    a1: float
    a2: float
    f: float
    beside: float
    tool_on_axis: bool


def geometry_of(robot: Robot) -> Geometry | None:
    """The geometry if axes 2, 3 are parallel and perpendicular to axis 1, and 4, 5, 6 are a spherical wrist."""
    if robot.n != 6 or not robot.revolute.all():
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if not (is_perpendicular(alpha[0]) and alpha[1] == 0.0 and has_spherical_wrist(links)):
        return None
    # W as seen from axis 3, across it and along it.
    across = complex(a[2], -math.sin(alpha[2]) * d[3])
    beside = float(d[2] + math.cos(alpha[2]) * d[3])
    a1, a2, f, phase = float(a[0]), float(a[1]), abs(across), math.atan2(across.imag, across.real)
    if min(a2, f) < TOLERANCES.geometry:
        return None
    beside = 0.0 if is_zero(beside) else beside
    offset = links.theta.copy()
    offset[2] += phase
    return pack(links, offset, (a1, a2, f, beside), phase, float(alpha[2]))


def has_spherical_wrist(links: Links) -> bool:
    """Whether axes 4, 5 and 6 meet in one point, neighbours at right angles."""
    square = is_perpendicular(links.alpha[3]) and is_perpendicular(links.alpha[4])
    return square and is_zero(links.a[3], links.a[4], links.d[4])


def pack(
    links: Links,
    offset: Array,
    lengths: tuple[float, float, float, float],
    phase: float,
    twist: float,
    slides: bool = False,
) -> Geometry:
    """The geometry of these lengths (a1, a2, f, L) and angle offsets ``(6,)``.

    Axis 4 is turned by −phase and then by the twist against the line from axis 3 to W. With `slides` the third
    joint is prismatic, see :mod:`kin.solvers.slide6`.
    """
    shape = [*lengths, math.cos(phase), math.sin(phase), math.cos(twist), math.sin(twist), float(slides)]
    pose = pose_params(links.base, links.tool)
    params = np.array([*pose, *links.sign, *offset, *shape])
    on_axis = is_zero(links.tool[0, 3], links.tool[1, 3]) and is_along(links.tool)
    return Geometry(params, links.sign, offset, *lengths, on_axis)
