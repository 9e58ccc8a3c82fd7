"""The parts of an (r, z) section's boundary that one joint traces alone: exact curves instead of polylines.

A configuration on the envelope has joints at limits, or the arm is singular there; along many parts of the
boundary all joints but one stand still, as on the outer arc of the outstretched arm. Vertex after vertex, the
configuration on the envelope is found by a descent towards a point a little outside of the vertex (from there the
minimum is well conditioned), starting from that of the vertex before; where only one joint moved, forward
kinematics of that joint gives the curve. It is part of a circle if the joint axis is perpendicular to the section,
else of a torus section.
"""

from __future__ import annotations

import math

import numpy as np

from kin.fk import fk_positions, jacobian
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.results import Section, SectionArc
from kin.workspace.search.cells import CellMap
from kin.workspace.search.descent import minimise_each, quadratic

_OUTSIDE = 0.25  # of a square's side
_STILL = 1e-6  # m: a joint that moves the point less from a vertex to the next stands still
_EYE = np.eye(3)
_SHORTEST = 3  # vertices
_POINTS = 33
_ROUND = 1e-9  # m
_SWEEP = 0.25  # rad


def arcs_of(cells: CellMap, found: Section) -> tuple[SectionArc, ...]:
    """The arcs of an (r, z) section of a region whose joint 1 turns freely, with the map of that region."""
    arcs: list[SectionArc] = []
    for curve in found.curves:
        arcs += _arcs_of_curve(cells, found, curve)
    return tuple(arcs)


def _arcs_of_curve(found: CellMap, section: Section, curve: Array) -> list[SectionArc]:
    q = _envelope(found, section, curve)
    count = len(curve)
    steps = [_mover(found.region, q[k], q[(k + 1) % count]) for k in range(count)]
    # One joint traces the whole curve, or each arc begins where another joint takes over.
    starts = [k for k in range(count) if steps[k] != steps[k - 1]] or [0]
    arcs = []
    for start, end in zip(starts, [*starts[1:], starts[0] + count], strict=True):
        joint = steps[start]
        if joint is not None and end - start + 1 >= _SHORTEST:
            arcs.append(_arc(found.region, section, q, start, end, joint))
    return arcs


def _envelope(found: CellMap, section: Section, curve: Array) -> Array:
    """Configurations ``(k, n)`` on the envelope next to the vertices, NaN on the axis of joint 1."""
    along = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    places = curve + _OUTSIDE * section.step * normal
    p = section.origin + places[:, :1] * section.u + places[:, 1:] * section.v
    q, distance = found.nearest(p, 0.0)
    d = np.empty(1)
    for k in range(len(curve)):
        if math.isnan(q[k, 0]):
            continue
        if k > 0 and not math.isnan(q[k - 1, 0]):
            near, d = found.nearest(p[k : k + 1], 0.0, 1, q[k - 1 : k])
            if d[0] <= distance[k] + _ROUND:
                q[k], distance[k] = near[0], d[0]
        # To the last digit, to distinguish joints that stand still from joints that move.
        minimise_each(found.region.arm, quadratic(_EYE, p[k]), q[k : k + 1], d)
    r = np.abs(curve[:, 0]) if section.signed else np.minimum(curve[:, 0], places[:, 0])
    q[r < _ROUND] = math.nan
    return q


def _mover(region: Region, a: Array, b: Array) -> int | None:
    """The joint, other than joint 1, that alone moves the point between two configurations; None if none does."""
    if math.isnan(a[0] + b[0]):
        return None
    shift = np.linalg.norm(jacobian(region.robot, a)[:3], axis=0) * np.abs(b - a)
    movers = np.flatnonzero(shift[1:] > _STILL) + 1
    return int(movers[0]) if len(movers) == 1 else None


def _arc(region: Region, section: Section, q: Array, start: int, end: int, joint: int) -> SectionArc:
    """The arc from vertex `start` to vertex `end`, extended to the joint's limits where it ends at one."""
    count = len(q)
    values = [float(q[k % count, joint]) for k in range(start - 1, end + 2)]
    first = _to_limit(values[2], values[1], values[0], region.bounds[joint])
    last = _to_limit(values[-3], values[-2], values[-1], region.bounds[joint])
    held = q[(start + end) // 2 % count].copy()
    points = _traced(region, section, held, joint, np.linspace(first, last, _POINTS))
    held[joint] = first
    for array in (held, points):
        array.flags.writeable = False
    # Any curve is close to a circle along a short arc: a longer part of the same curve is compared.
    middle = 0.5 * (first + last)
    sweep = middle + np.linspace(-_SWEEP, _SWEEP, 9)
    centre, radius = _circle(_traced(region, section, held, joint, sweep))
    if centre is None:
        # A circle that continues beyond joint 1's axis is folded there, but not in its own plane.
        centre, radius = _circle(_traced(region, section, held, joint, sweep, folded=False))
    return SectionArc(joint, float(first), float(last), held, points, centre, radius)


def _traced(region: Region, section: Section, q: Array, joint: int, values: Array, folded: bool = True) -> Array:
    """The points ``(k, 2)`` of the section that one joint traces, as (r, z).

    With `folded` False: ``(k, 3)``, in the plane through joint 1's axis and the middle point, where the distance
    from the axis has a sign; the third coordinate is the distance from that plane.
    """
    configurations = np.repeat(q[None], len(values), axis=0)
    configurations[:, joint] = values
    p = fk_positions(region.robot, configurations) - section.origin
    height = p @ section.v
    across = p - height[:, None] * section.v
    if folded:
        r = np.linalg.norm(across, axis=1)
        if section.signed:
            turned = configurations[:, 0]
            left = np.cross(section.v, section.u)
            r *= np.sign(across @ section.u * np.cos(turned) + across @ left * np.sin(turned))
        return np.stack([r, height], axis=1)
    ahead = across[len(values) // 2]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-300)
    return np.stack([across @ ahead, height, across @ np.cross(section.v, ahead)], axis=1)


def _to_limit(inner: float, end: float, beyond: float, limits: tuple[float, float]) -> float:
    """Where an arc ends: at the value beyond its last vertex if that is a limit and no farther than a step."""
    return beyond if beyond in limits and abs(beyond - end) <= 2.0 * abs(end - inner) else end


def _circle(points: Array) -> tuple[tuple[float, float] | None, float | None]:
    """Centre and radius of the circle through points ``(k, 2)`` or ``(k, 3)`` in the plane, or None."""
    if np.abs(points[:, 2:]).max(initial=0.0) > _ROUND:
        return None, None
    points = points[:, :2]
    a, b, c = points[0], points[len(points) // 2], points[-1]
    twice = 2.0 * np.array([b - a, c - a])
    if abs(np.linalg.det(twice)) < _ROUND:
        return None, None
    centre = np.linalg.solve(twice, np.array([b @ b - a @ a, c @ c - a @ a]))
    away = np.linalg.norm(points - centre, axis=1)
    if np.ptp(away) > _ROUND:
        return None, None
    return (float(centre[0]), float(centre[1])), float(away.mean())
