"""The bounding box, the reach and the holes of a workspace, exact to rounding.

Each is the least or largest value of a coordinate or of a distance. A descent
(:mod:`kin.workspace.search.descent`) ends at a local extreme, so many are made: from the best of some ten thousand
evenly spread configurations, and from a few of the spread ones whatever their value, as the widest valley need not
be the deepest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kin.fk import fk_positions, link_frames
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.results import Extreme, Span
from kin.workspace.sampling.kernels import sample_configurations
from kin.workspace.sampling.streams import joint_streams
from kin.workspace.search.descent import minimise_each, quadratic

_CANDIDATES = 1 << 14
_BEST, _SPREAD = 24, 24
_PARALLEL = 1e-9


def along(region: Region, direction: Array) -> Span:
    """The reach along a direction ``(3,)``: least and largest dot product with the tool point."""
    return Span(
        _extreme(region, quadratic(slope=direction), lambda p: p @ direction),
        _extreme(region, quadratic(slope=-direction), lambda p: p @ direction),
    )


def from_axis(region: Region, point: Array, axis: Array) -> Span:
    """Least and largest distance from the axis through a point along a unit vector."""
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
    """The configuration of least f, with the value of `measure` there."""
    q = np.empty((_CANDIDATES, region.robot.n))
    sample_configurations(region.arm, joint_streams(0, region.movable, quasi=True), 0, q)
    p = fk_positions(region.robot, q) - f[9:12]
    heights = 0.5 * np.einsum("ki,ij,kj->k", p, f[:9].reshape(3, 3), p) + p @ f[12:]
    low = np.flatnonzero(heights <= np.partition(heights, _BEST - 1)[_BEST - 1])
    # Equal heights keep their order: a partition alone picks other ones on another processor.
    best = low[np.argsort(heights[low], kind="stable")[:_BEST]]
    q = np.concatenate([q[np.sort(best)], q[:_SPREAD]])
    ends = np.empty(len(q))
    minimise_each(region.arm, f, q, ends)
    found = q[int(np.argmin(ends))].copy()
    point = fk_positions(region.robot, found)
    for array in (found, point):
        array.flags.writeable = False
    return Extreme(float(measure(point)), found, point)


def base_axis(region: Region) -> tuple[Array, Array, Array]:
    """A point of joint 1's axis, its unit direction, and the shoulder, ``(3,)`` each.

    The shoulder is the point of the axis nearest to the first later joint axis that is not parallel to it: where
    the arm's second motion starts from, whatever the value of joint 1.
    """
    robot = region.robot
    before = _frames_before(region)
    revolute = robot.turns_as_one
    base = robot.T_world_base
    point, axis = (before[0][:3, 3], before[0][:3, 2]) if revolute else (base[:3, 3], base[:3, 2])
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
    # A modified row turns about the z axis of its own frame, a standard one about that of the row before.
    shift = 1 if robot.convention == "modified" else 0
    return [frames[row + shift] for row in robot.joint_rows]
