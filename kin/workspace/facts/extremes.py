"""The bounding box, the reach and the holes of a workspace, exact to rounding.

Each is the least or largest value of a coordinate or of a distance. A descent
(:mod:`kin.workspace.facts.descent`) ends in a local extreme, so many are made: from the best of some ten thousand
evenly spread configurations, and from a
few of the spread ones whatever their value, as the widest valley need not be the deepest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kin.fk import fk_positions, link_frames
from kin.transforms import Array
from kin.workspace.clouds.draw import configurations
from kin.workspace.clouds.numbers import streams
from kin.workspace.facts.descent import settle_each
from kin.workspace.region import Region
from kin.workspace.results import Extreme, Span

_LOOKED_AT = 1 << 14
_BEST, _SPREAD = 24, 24
_PARALLEL = 1e-9


def quadratic(D: Array | None = None, centre: Array | None = None, slope: Array | None = None) -> Array:
    """½ (p − c)ᵀ D (p − c) + gᵀ (p − c) as `kin.workspace.facts.descent.settle` takes it ``(15,)``."""
    zero = np.zeros(3)
    parts = (
        np.zeros(9) if D is None else D.ravel(),
        zero if centre is None else centre,
        zero if slope is None else slope,
    )
    return np.concatenate(parts).astype(np.float64)


def along(region: Region, direction: Array) -> Span:
    """The reach along a direction ``(3,)``: least and largest of its product with the tool point."""
    return Span(
        _extreme(region, quadratic(slope=direction), lambda p: p @ direction),
        _extreme(region, quadratic(slope=-direction), lambda p: p @ direction),
    )


def from_line(region: Region, point: Array, axis: Array) -> Span:
    """Least and largest distance from the line through a point along a unit vector."""
    return _from(region, point, np.eye(3) - np.outer(axis, axis))


def from_point(region: Region, point: Array) -> Span:
    """Least and largest distance from a point."""
    return _from(region, point, np.eye(3))


def _from(region: Region, centre: Array, D: Array) -> Span:
    def distance(p: Array) -> Array:
        return np.asarray(np.linalg.norm((p - centre) @ D, axis=-1))

    return Span(
        _extreme(region, quadratic(D, centre), distance), _extreme(region, quadratic(-D, centre), distance)
    )


def _extreme(region: Region, f: Array, measure: Callable[[Array], Array]) -> Extreme:
    """The least f, told by the quantity it stands for."""
    key, step = streams(0, region.free, quasi=True)
    q = np.empty((_LOOKED_AT, region.robot.n))
    configurations(key, step, True, region.lower, region.upper, 0, q)
    p = fk_positions(region.robot, q) - f[9:12]
    heights = 0.5 * np.einsum("ki,ij,kj->k", p, f[:9].reshape(3, 3), p) + p @ f[12:]
    best = np.argpartition(heights, _BEST)[:_BEST]
    q = np.concatenate([q[np.sort(best)], q[:_SPREAD]])
    ends = np.empty(len(q))
    settle_each(region.robot.model, f, region.lower, region.upper, q, ends)
    found = q[int(np.argmin(ends))].copy()
    point = fk_positions(region.robot, found)
    for array in (found, point):
        array.flags.writeable = False
    return Extreme(float(measure(point)), found, point)


def base_line(region: Region) -> tuple[Array, Array, Array]:
    """A point of joint 1's line, its unit direction, and the shoulder, ``(3,)`` each.

    The shoulder is the point of the line nearest to the first later joint axis that is not parallel to it: where
    the arm's second motion starts from, whatever joint 1 does.
    """
    robot = region.robot
    before = _frames_before(region)
    turning = robot.joints[0].kind == "revolute"
    base = robot.T_world_base
    point, axis = (before[0][:3, 3], before[0][:3, 2]) if turning else (base[:3, 3], base[:3, 2])
    shoulder = point
    for T, joint in zip(before[1:], robot.joints[1:], strict=True):
        cross = np.cross(axis, T[:3, 2])
        square = float(cross @ cross)
        if joint.kind == "revolute" and square > _PARALLEL:
            shoulder = point + axis * (np.cross(T[:3, 3] - point, T[:3, 2]) @ cross) / square
            break
    return point.copy(), axis.copy(), shoulder.copy()


def _frames_before(region: Region) -> list[Array]:
    """The frame along whose z axis each joint moves, ``(4, 4)`` each, at the middle of the region."""
    robot = region.robot
    q = 0.5 * (region.lower + region.upper)
    frames = [robot.T_world_base, *link_frames(robot, q)]
    # A modified row turns about its own z axis, which its own frame has; a standard one about that of the row
    # before.
    shift = 1 if robot.convention == "modified" else 0
    return [frames[row + shift] for row in robot.joint_rows]
