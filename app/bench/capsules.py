"""Collisions by plain numpy: the reference that answers are checked with, and a contestant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kin.axes import screw_x, screw_z
from kin.collision import Obstacle
from kin.collision.bodies import bodies_of
from kin.robot import Robot
from kin.transforms import Array

_PARTS = 201  # configurations along a motion


def distances(robot: Robot, q: Array, spheres: Sequence[Obstacle] = ()) -> Array:
    """Least distance ``(k,)`` of the compared capsules of an arm, and of spheres, at configurations ``(k, n)``."""
    body = bodies_of(robot)
    frames = _frames(robot, q)[:, body.rows + 1]
    turn, place = frames[..., :3, :3], frames[..., :3, 3]
    starts = (turn @ body.shape[:, :3, None])[..., 0] + place
    ends = (turn @ body.shape[:, 3:6, None])[..., 0] + place
    first, second = body.pairs.T
    apart = _between(starts[:, first], ends[:, first], starts[:, second], ends[:, second])
    least = (apart - body.shape[first, 6] - body.shape[second, 6]).min(axis=1, initial=np.inf)
    starts, ways = starts[:, body.moving], ends[:, body.moving] - starts[:, body.moving]
    squares, radii = np.einsum("...i,...i", ways, ways), body.shape[body.moving, 6]
    for each in spheres:
        apart = _to_segment(np.array(each.xyz), starts, ways, squares) - radii
        least = np.minimum(least, apart.min(axis=1) - each.sizes[0])
    return np.asarray(least)


def touches_between(robot: Robot, q: Array, ends: Array, spheres: Sequence[Obstacle]) -> NDArray[np.bool_]:
    """Whether an arm touches anything on straight motions of the joints ``(k, n)``, by configurations on each."""
    parts = np.linspace(0.0, 1.0, _PARTS)[:, None]
    pairs = zip(q, ends, strict=True)
    return np.array([distances(robot, a + parts * (b - a), spheres).min() < 0.0 for a, b in pairs])


def _frames(robot: Robot, q: Array) -> Array:
    """The frame before the first row and those after each row ``(k, rows + 1, 4, 4)``."""
    found = [np.broadcast_to(robot.T_world_base, (len(q), 4, 4))]
    joint = 0
    for row in robot.rows:
        x = screw_x(row.a, row.alpha)
        z = np.broadcast_to(screw_z(row.theta, row.d), (len(q), 4, 4)).copy()
        if row.kind == "prismatic":
            z[:, 2, 3] += q[:, joint]
        elif row.kind == "revolute":
            turn = np.broadcast_to(np.eye(4), (len(q), 4, 4)).copy()
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(q[:, joint])
            turn[:, 1, 0] = np.sin(q[:, joint])
            turn[:, 0, 1] = -turn[:, 1, 0]
            z = turn @ z
        joint += row.kind != "fixed"
        found.append(found[-1] @ (x @ z if robot.convention == "modified" else z @ x))
    return np.stack(found, axis=1)


def _between(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Distances of segments a–b and c–d ``(…, 3)``: at an end of one, or where both lines are nearest."""
    u, v, r = b - a, d - c, a - c
    uu, vv, uv, ur, vr = (np.einsum("...i,...i", x, y) for x, y in ((u, u), (v, v), (u, v), (u, r), (v, r)))
    across = uu * vv - uv * uv
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (uv * vr - ur * vv) / across, (uu * vr - uv * ur) / across
    inside = (across > 1e-14 * uu * vv) & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    s, t = np.where(inside, s, 0.0), np.where(inside, t, 0.0)
    crossing = np.linalg.norm(r + s[..., None] * u - t[..., None] * v, axis=-1)
    ends = [_to_segment(a, c, v, vv), _to_segment(b, c, v, vv), _to_segment(c, a, u, uu), _to_segment(d, a, u, uu)]
    return np.asarray(np.minimum(crossing, np.min(ends, axis=0)))


def _to_segment(point: Array, start: Array, way: Array, square: Array) -> Array:
    gap = point - start
    t = np.clip(np.einsum("...i,...i", gap, way) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(gap - t[..., None] * way, axis=-1))
