"""A cut through the workspace, with the curves that bound it.

For each node of a grid in the plane, the map (:mod:`kin.workspace.search.cells`) decides whether the tool reaches
it, and on each edge with one end inside the boundary is located. For a point outside, the nearest reachable point
and the direction to it give the tangent of the boundary: where it meets the edge, a little outside, is the next
point to test, or the midpoint where the tangent does not meet the edge. Close to the boundary, the tangent is the
boundary. No point is tested closer than needed: descents are slow where the tool only just misses its target.

Without a plane the section is that in (r, z), distance from joint 1's axis and height along it, whatever the value
of joint 1: the cut of a half-plane through the axis with the body that a joint 1 without limits would sweep.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kin.axes import is_zero, joint_axes
from kin.errors import InputError
from kin.fk import fk_positions
from kin.ik.options import JointConstraints, Limits, Locks
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array, finite_array
from kin.workspace.region import Region, checked_integer
from kin.workspace.results import Section
from kin.workspace.search.cells import CellMap, cell_map
from kin.workspace.search.extremes import base_axis
from kin.workspace.sections.arcs import arcs_of
from kin.workspace.sections.contour import Edge, Flags, enclosed, ends, loops

_EXACT = 1e-6  # of a cube's side
# Fractions of a square's side. From this close, the tangent gives the boundary this far aside to about 1e-5.
_NEAR, _ASIDE = 0.04, 0.1
_NARROW = 1e-4  # of a square's side
_ROUNDS = 16
_DOUBTS = 64  # descents from all over the workspace for a node in a hole
ALIKE = 3


def workspace_section(
    robot: Robot | str,
    plane: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    resolution: int = 96,
    signed: bool = False,
    cancel: Callable[[], None] = never_cancel,
) -> Section:
    """The cut of the workspace with a plane, and its boundary.

    Args:
        robot: the arm, or the id of a built-in one.
        plane: a point (m) and a normal of it; None for the (r, z) section of an arm whose joint 1 is revolute.
        limits, locked: as in `kin.JointConstraints`. An (r, z) section ignores those of joint 1.
        constraints: both as one value, instead of `limits` and `locked`.
        resolution: squares along the longer side of the plane's window, 8 to 1000.
        signed: give r of an (r, z) section a sign: negative where the tool is behind joint 1's axis, that is more
            than 90° from the direction in which joint 1 faces (`faced`).
        cancel: called now and then; raises to cancel the computation.

    Returns:
        The boundary as curves, its exact arcs, and the area inside.

    Raises:
        InputError: naming the wrong argument.

    Examples:
        >>> import kin
        >>> len(kin.workspace.workspace_section("scara", resolution=48).curves) > 0
        True
    """
    region = Region.finite(robot_of(robot), JointConstraints.of(limits, locked, constraints))
    count = checked_integer("resolution", resolution, 8, 1000, "a whole number from 8 to 1000")
    if plane is None:
        if not region.robot.turns_as_one:
            slides = region.robot.joints[0].kind == "prismatic"
            why = "slides" if slides else "does not turn the whole arm about its axis"
            raise InputError("plane", None, f"a point and a normal: joint 1 of {region.robot.id} {why}")
        return profile(region, count, signed, cancel)
    if not isinstance(plane, Sequence) or len(plane) != 2:
        raise InputError("plane", plane, "a point and a normal, three numbers each")
    origin, normal = finite_array("plane[0]", plane[0], (3,)), finite_array("plane[1]", plane[1], (3,))
    length = float(np.linalg.norm(normal))
    if origin.ndim != 1 or normal.ndim != 1 or not length > 0.0:
        raise InputError("plane", plane, "a point and a normal, three numbers each, the normal not zero")
    u, v = plane_axes(normal / length)
    return _cut(cell_map(region).cancelled_by(cancel), origin, u, v, -math.inf, count)


def _turning(region: Region, most: float) -> Region:
    """The same region with joint 1 turning from −most to most."""
    return replace(region, bounds=((-most, most), *region.bounds[1:]))


def faced(robot: Robot, axis: Array) -> Array:
    """The direction ``(3,)`` in which joint 1 faces at 0, perpendicular to its `axis` ``(3,)``.

    It is perpendicular to the second axis, too, unless both are parallel, and on the side of the base's x axis (y,
    where x is perpendicular to it). It turns with joint 1.
    """
    x, y = robot.T_world_base[:3, 0], robot.T_world_base[:3, 1]
    ahead = np.cross(axis, joint_axes(robot)[1].direction) if robot.n > 1 else np.zeros(3)
    if is_zero(*ahead):
        ahead = next(across for e in (x, y) if not is_zero(*(across := e - axis * (axis @ e))))
    side = next((s for s in (float(ahead @ x), float(ahead @ y)) if not is_zero(s)), 1.0)
    return np.asarray(math.copysign(1.0 / float(np.linalg.norm(ahead)), side) * ahead)


def profile(
    region: Region, resolution: int, signed: bool = False, cancel: Callable[[], None] = never_cancel
) -> Section:
    """The section in (r, z); `signed` and `cancel` as of `workspace_section`.

    A point at the distance r in the half-plane that joint 1 faces at 0 is reached from there with |θ1| ≤ 90° if
    the tool is in front of the axis. In the opposite half-plane the same values reach what is behind.
    """
    point, axis, _ = base_axis(region)
    u = faced(region.robot, axis) if signed else plane_axes(axis)[0]
    cells = cell_map(_turning(region, 0.5 * math.pi if signed else math.pi)).cancelled_by(cancel)
    least = -math.inf if signed else 0.0
    found = replace(_cut(cells, point - axis * (point @ axis), u, axis, least, resolution), signed=signed)
    return replace(found, arcs=arcs_of(cells, found))


def plane_axes(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors of the plane; v points up in vertical planes, u along x in horizontal ones."""
    if abs(normal[2]) < 0.9:
        v = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
        v /= np.linalg.norm(v)
        u = np.cross(v, normal)
    else:
        u = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        u /= np.linalg.norm(u)
        v = np.cross(normal, u)
    return u, v


def _cut(found: CellMap, origin: Array, u: Array, v: Array, least: float, resolution: int) -> Section:
    """The section in the plane through `origin`, where s is not below `least`."""
    window = _window(found, found.occupied, origin, u, v, least)
    step = float((window[1] - window[0]).max()) / resolution
    if not step > 0.0:
        return Section(origin, u, v, (), (), 0.0, 0.0)
    places = _grid(window, step)
    q, distance = _test_nodes(found, origin, u, v, places, least)
    inside = distance <= _EXACT * found.size
    if inside[-1].any() or inside[0].any() or inside[:, -1].any() or inside[:, 0].any():
        # Curves would not close at the rim: the workspace extends beyond the points that made the map. Beyond the
        # whole map, no node is found to be inside.
        places = _grid(_window(found, np.ones_like(found.occupied), origin, u, v, least), step)
        q, distance = _test_nodes(found, origin, u, v, places, least)
        inside = distance <= _EXACT * found.size
    curves = tuple(_on_boundary(found, origin, u, v, places, inside, q, loop, least) for loop in loops(inside))
    area = sum(_area(curve) for curve in curves)
    for curve in curves:
        curve.flags.writeable = False
    return Section(origin, u, v, curves, (), area, step)


def _window(found: CellMap, cubes: Flags, origin: Array, u: Array, v: Array, least: float) -> tuple[Array, Array]:
    """Least and largest coordinates (s, t) of some cubes ``(m,)`` of the map, s not below `least`."""
    corners = np.concatenate([found.corners[cubes], found.corners[cubes] + found.edge]) - origin
    s, t = corners @ u, corners @ v
    return np.array([max(s.min(), least), t.min()]), np.array([s.max(), t.max()])


def _grid(window: tuple[Array, Array], step: float) -> Array:
    """Nodes ``(a, b, 2)`` that cover a window, with a step to spare all around.

    The second nodes of an (r, z) section are on the axis itself, so that r is not cut off at a square.
    """
    low, high = window
    first = low - step
    shape = np.ceil((high - low) / step).astype(int) + 3
    s, t = first[0] + step * np.arange(shape[0]), first[1] + step * np.arange(shape[1])
    return np.stack(np.meshgrid(s, t, indexing="ij"), axis=-1)


def _test_nodes(
    found: CellMap, origin: Array, u: Array, v: Array, places: Array, least: float
) -> tuple[Array, Array]:
    """The nearest configuration ``(a, b, n)`` of every node ``(a, b, 2)`` and its distance ``(a, b)``."""
    a, b, _ = places.shape
    p = origin + places[..., :1] * u + places[..., 1:] * v
    q, distance = found.nearest(p.reshape(-1, 3), _EXACT * found.size, ALIKE)
    q, distance = q.reshape(a, b, -1), distance.reshape(a, b)
    out = places[..., 0] < least
    exact = _EXACT * found.size

    def retry(where: Flags, guess: Array, alike: int = 1) -> None:
        i, j = np.nonzero(where)
        near, d = found.nearest(p[i, j], exact, alike, guess[i, j])
        better = d < distance[i, j]
        q[i[better], j[better]], distance[i[better], j[better]] = near[better], d[better]

    def try_from_neighbours() -> None:
        for axis, by in ((0, 1), (0, -1), (1, 1), (1, -1)):
            retry((distance > exact) & (np.roll(distance, by, axis) <= exact) & ~out, np.roll(q, by, axis))

    # A node that was missed is tried again from neighbours that are reached, one in a hole from all over.
    try_from_neighbours()
    try_from_neighbours()
    distance[out] = math.inf
    holes = enclosed(distance <= exact)
    if holes.any():
        starts = found.seeds[found.occupied].reshape(-1, q.shape[-1])
        for k in range(_DOUBTS):
            doubtful = holes & (distance > exact)
            start = starts[k * len(starts) // _DOUBTS]
            retry(doubtful, np.broadcast_to(start, q.shape))
        try_from_neighbours()
        distance[out] = math.inf
    return q, distance


def _on_boundary(
    found: CellMap, origin: Array, u: Array, v: Array, places: Array, inside: Flags, q: Array, loop: list[Edge],
    least: float,
) -> Array:  # fmt: skip
    """The boundary's points ``(k, 2)`` on the edges that a loop crosses."""
    pairs = [ends(edge, inside) for edge in loop]
    a = np.array([places[i] for i, _ in pairs])
    way = np.array([places[o] for _, o in pairs]) - a
    from_inside = np.array([q[i] for i, _ in pairs])
    step = float(np.abs(way[0]).max())
    # Fractions of the way from a: last reached, first missed, next to test, and the boundary by the tangent.
    reached, missed, ahead = np.zeros(len(a)), np.ones(len(a)), np.ones(len(a))
    answer = np.full(len(a), 0.5)
    # The axis itself bounds an (r, z) section: there is nothing beyond it to be missed.
    beyond = a[:, 0] + way[:, 0] < least
    answer[beyond] = ((least - a[:, 0]) / np.where(beyond, way[:, 0], 1.0))[beyond]
    open_ = np.flatnonzero(~beyond)
    for _ in range(_ROUNDS):
        if not len(open_):
            break
        at = a[open_] + ahead[open_, None] * way[open_]
        p = origin + at[:, :1] * u + at[:, 1:] * v
        near, distance = found.nearest(p, _EXACT * found.size, 2, from_inside[open_])
        hit = distance <= _EXACT * found.size
        seen = np.isfinite(distance) & ~hit
        reached[open_[hit]], missed[open_[~hit]] = ahead[open_[hit]], ahead[open_[~hit]]
        from_inside[open_[hit]] = near[hit]
        answer[open_] = ahead[open_] = 0.5 * (reached + missed)[open_]
        out = np.where(
            seen[:, None], p - fk_positions(found.region.robot, np.where(seen[:, None], near, 0.0)), 0.0
        )
        fall = np.einsum("kr,kr->k", out, way[open_, :1] * u + way[open_, 1:] * v)
        meets = missed[open_] - distance**2 / np.where(fall > 0.0, fall, math.nan)
        good = seen & (meets >= reached[open_])
        answer[open_[good]] = meets[good]
        aside = np.linalg.norm((at - out @ np.stack([u, v], axis=1)) - (a + answer[:, None] * way)[open_], axis=1)
        ahead[open_[good]] = np.minimum(meets[good] + 0.5 * _NEAR, ahead[open_[good]])
        near_by = good & (distance <= _NEAR * step) & (aside <= _ASIDE * step)
        done = near_by | ((missed - reached)[open_] < _NARROW)
        open_ = open_[~done]
    curve = a + answer[:, None] * way
    # Of a part of the axis itself only the ends are kept.
    on_line = beyond & np.roll(beyond, 1) & np.roll(beyond, -1)
    return np.ascontiguousarray(curve[~on_line])


def _area(curve: Array) -> float:
    """Area enclosed by a closed polyline ``(k, 2)``, positive if it runs counterclockwise."""
    s, t = curve.T
    return 0.5 * float((s * np.roll(t, -1) - t * np.roll(s, -1)).sum())
