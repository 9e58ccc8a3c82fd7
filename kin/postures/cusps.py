"""Cusps of three revolute joints that place a point.

At a singularity det J = 0 two solutions of the inverse kinematics meet. Where the direction v that the joints
lose (J v = 0) is tangent to the singular curve, three meet: a *cusp*. Around one, two of the three postures turn
into each other without a singularity. An arm whose singular curves do not cross each other is cuspidal if and only
if it has a cusp (D. Salunkhe, C. Spartalis, J. Capco, D. Chablat, P. Wenger, Necessary and sufficient condition
for a generic 3R serial manipulator to be cuspidal, Mechanism and Machine Theory 171, 2022). Between arms with and
without cusps are those with four equal roots of the quartic that gives θ3 (S. Corvez, F. Rouillier, Using computer
algebra tools to classify serial manipulators, Automated Deduction in Geometry, 2004).

Nothing of this depends on θ1. All squares of the (θ2, θ3) torus are tested: det J and the derivative of det J
along v are trigonometric polynomials, and the sums of their coefficients bound how fast they change. A square in
which one of them cannot vanish is left out, the others are divided. If none is left, it is proved that there is no
cusp, and no crossing either.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.angles import wrapped
from kin.axes import generic_q, lines_of, spherical_groups
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_COARSE = 64  # squares along a turn at first
_SAME = 0.02  # rad: places that are closer count as one
_ASIDE = np.array([s * x for x in (0.6, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001) for s in (1.0, -1.0)])  # rad
_FINE = 1e-6  # rad: half a side of the smallest squares
_MOST = 60_000  # squares at a time
_SAMPLES = 16  # values along a turn that determine the polynomials, whose degree is at most 6


class Chain(NamedTuple):
    """Three axes that place a point, with every joint at 0.

    Attributes:
        z: directions ``(3, 3)``, unit vectors.
        points: a point of each ``(3, 3)``, in any unit.
        tip: the point that is placed ``(3,)``.
        joints: indices of the three joints.
        sense: 1.0, or −1.0 for joints that are seen from the hand and turn what is before them.
    """

    z: Array
    points: Array
    tip: Array
    joints: tuple[int, int, int]
    sense: float


def chain_of(robot: Robot) -> Chain | None:
    """The three axes of a revolute arm that place a point, if what the others do is separate from that.

    All three of an arm with three joints. Of six, those before a spherical wrist, which place its centre; or those
    behind a spherical shoulder, seen from the hand. The three axes through one point turn the hand into any
    orientation with two postures, which only a singularity of their own connects.
    """
    if robot.coupled or not robot.revolute.all():
        return None
    lines = lines_of(robot, as_counted=True)
    if robot.n == 3:
        return Chain(lines.z, lines.points, lines.T_base_tool[:3, 3], (0, 1, 2), 1.0)
    groups = spherical_groups(robot) if robot.n == 6 else ()
    if 3 in groups:
        return Chain(lines.z[:3], lines.points[:3], _meeting(lines.z[3:5], lines.points[3:5]), (0, 1, 2), 1.0)
    if 0 in groups:
        tip = _meeting(lines.z[:2], lines.points[:2])
        return Chain(lines.z[:2:-1], lines.points[:2:-1], tip, (5, 4, 3), -1.0)
    return None


def is_staged(chain: Chain) -> bool:
    """Whether θ1, θ2 and θ3 follow one after the other, each from an equation a cos θ + b sin θ = c.

    That is so where two neighbouring axes are parallel or meet: then something about the point depends on one
    joint alone. Each equation has two solutions, whose derivatives have opposite signs, and det J is the
    product of the derivatives: no posture turns into another one without a singularity.
    """
    scale = float(np.ptp(np.vstack([chain.points, chain.tip]), axis=0).max()) or 1.0
    for i in (0, 1):
        normal = np.cross(chain.z[i], chain.z[i + 1])
        sine = float(np.linalg.norm(normal))
        between = chain.points[i + 1] - chain.points[i]
        if sine < TOLERANCES.geometry or abs(between @ normal) < TOLERANCES.geometry * scale * sine:
            return True
    return False


def possible_cusps(chain: Chain) -> Array:
    """Places (θ2, θ3) ``(k, 2)`` close to all cusps and crossings of singular curves.

    If there are none, it is proved, up to rounding, that there is no cusp and no crossing.
    """
    bounds = _steepness(chain)
    half = math.pi / _COARSE
    middle = -math.pi + half * (2.0 * np.arange(_COARSE) + 1.0)
    squares = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
    while True:
        squares = squares[(np.abs(_conditions(chain, squares)) <= bounds * half).all(axis=1)]
        half *= 0.5
        if not len(squares) or 4 * len(squares) > _MOST or half < _FINE:
            return _apart(squares)
        corners = half * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
        squares = (squares[:, None] + corners).reshape(-1, 2)


def _conditions(chain: Chain, angles: Array) -> Array:
    """What vanishes at a cusp ``(k, 4)``, at (θ2, θ3) ``(k, 2)``.

    The first is det J. With J = (a, b, c) and any n, ``v = (n·(b × c), n·(c × a), n·(a × b))`` has
    ``J v = n det J``. The others are the derivatives of det J along v for the three unit vectors n.
    """
    t2, t3 = angles[:, 0], angles[:, 1]
    (z1, z2, z3), (o1, o2, o3) = chain.z, chain.points
    # As seen from the second link, which θ1 does not move and θ2 turns away from the first axis.
    first, moment = _turned(z2, -t2, z1), _turned(z2, -t2, np.cross(z1, o2 - o1))
    tip = o3 + _turned(z3, t3, chain.tip - o3)
    a, b, c = moment + np.cross(first, tip - o2), np.cross(z2, tip - o2), np.cross(z3, tip - o3)
    bc = np.cross(b, c)
    a_by_2 = -np.cross(z2, moment) - np.cross(np.cross(z2, first), tip - o2)
    bc_by_3 = np.cross(np.cross(z2, c), c) + np.cross(b, np.cross(z3, c))
    by_2 = _dot(a_by_2, bc)
    by_3 = _dot(np.cross(first, c), bc) + _dot(a, bc_by_3)
    along = by_2[:, None] * np.cross(c, a) + by_3[:, None] * np.cross(a, b)
    return np.column_stack([_dot(a, bc), along])


def _steepness(chain: Chain) -> Array:
    """Bounds ``(4,)`` on how much the conditions change while both angles change by 1: from their coefficients."""
    turn = 2.0 * math.pi * np.arange(_SAMPLES) / _SAMPLES
    angles = np.stack(np.meshgrid(turn, turn, indexing="ij"), axis=-1).reshape(-1, 2)
    values = _conditions(chain, angles).reshape(_SAMPLES, _SAMPLES, 4)
    size = np.abs(np.fft.fft2(values, axes=(0, 1))) / _SAMPLES**2
    degree = np.abs(np.fft.fftfreq(_SAMPLES, 1.0 / _SAMPLES))
    return np.asarray(((degree[:, None] + degree)[..., None] * size).sum(axis=(0, 1)))


def around(robot: Robot, chain: Chain, place: Array) -> Array:
    """Configurations ``(k, n)`` on both sides of the singular curve at a cusp (θ2, θ3), nearer and farther.

    Behind the curve, there are three postures next to the cusp, of which two are connected on this side of it.
    """
    step = 1e-6 * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    det = _conditions(chain, place + step)[:, 0]
    slope = det[1:] - det[0]
    across = slope / (float(np.linalg.norm(slope)) or 1.0)
    q = np.tile(generic_q(robot), (len(_ASIDE), 1))
    q[:, chain.joints[1:]] = chain.sense * (place + _ASIDE[:, None] * across)
    return q


def _apart(places: Array) -> Array:
    """One of each group of places ``(k, 2)`` next to each other."""
    found: list[Array] = []
    while len(places):
        found.append(places[0])
        off = np.abs(wrapped(places - places[0])).max(axis=1)
        places = places[off > _SAME]
    return np.array(found).reshape(-1, 2)


def _turned(axis: Array, angles: Array, vector: Array) -> Array:
    """A vector ``(3,)`` turned about a unit vector by each angle ``(k, 3)``."""
    along = axis * (axis @ vector)
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(along + cos * (vector - along) + sin * np.cross(axis, vector))


def _meeting(z: Array, points: Array) -> Array:
    """The point of the second of two lines that is nearest to the first ``(3,)``."""
    normal = np.cross(z[0], z[1])
    along = np.cross(points[1] - points[0], z[0]) @ normal / (normal @ normal)
    return np.asarray(points[1] + along * z[1])


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ki,ki->k", a, b))
