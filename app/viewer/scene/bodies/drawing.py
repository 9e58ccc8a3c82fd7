"""Bodies that look like the real arms: one file ``<robot id>.toml`` in this folder draws one built-in arm.

A file describes the arm as its maker's drawing does: in one posture, ``pose``, and in coordinates of the base.
Each of its ``parts`` names the joint that carries it (0: none, the part stands still), a colour, and an axis,
``along = [[x, y, z], [x, y, z]]``. The ``section`` across this axis is the convex hull of discs
``[u, v, radius]``: one disc gives a cylinder, two a rounded bar, four a box with rounded edges. ``end`` is the
section at the far end, if it differs, and ``bevel`` the size of the bevel at both rims.

Parts with ``opens = [x, y, z]`` are fingers: they are drawn closed, and move by this when the gripper opens.

The directions u and v are y and z across an axis along x, z and x along y, x and y along z. Across any other
axis u is horizontal. Lengths are in millimetres, angles in degrees.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.bodies.parts import Color, Part, joint_color
from app.viewer.scene.chain import chain, link_poses
from app.viewer.scene.shapes import DIRECTIONS, Solid, loft, merged, outline, placed, spaced
from kin import Robot, builtin_robots
from kin.axes import inverse, perpendicular_to
from kin.transforms import Array

FOLDER = Path(__file__).parent
MM = 0.001
STEP = 0.03  # m, between the spheres that cover a part
DEPTH = 0.004  # m, by which a sphere may stand out of another that makes it needless
RIM = 7  # points on each outline that belong to them
OF_JOINT = "joint"  # the colour of the joint that carries the part, as its slider and its axis have it


@dataclass(frozen=True, eq=False)
class Drawing:
    """The body of an arm, per link (base first) and in the coordinates of that link.

    Attributes:
        parts: one mesh for each colour.
        spheres: ``(k, 4)`` of x, y, z and radius that cover the link, some of radius 0 on its edges.
        fingers: parts that a gripper moves, which are not among the others.
    """

    parts: tuple[tuple[Part, ...], ...]
    spheres: tuple[Array, ...]
    fingers: tuple[Finger, ...] = ()


@lru_cache(maxsize=32)
def drawing(robot: Robot) -> Drawing | None:
    """The drawn body of a built-in arm; None for all others, and for arms without a file."""
    path = FOLDER / f"{robot.id}.toml"
    if builtin_robots().get(robot.id) != robot or not path.is_file():
        return None
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    return _drawn(robot, data)


def _drawn(robot: Robot, data: dict[str, Any]) -> Drawing:
    scale = np.where(robot.revolute, np.pi / 180.0, MM)
    poses = link_poses(robot, (np.array(data["pose"], dtype=float) * scale)[None])[0]
    solids: list[dict[str, list[Solid]]] = [{} for _ in poses]
    spheres: list[list[Array]] = [[np.empty((0, 4))] for _ in poses]
    fingers = []
    for part in data["parts"]:
        solid = _loft(part)
        if "opens" in part:
            fingers.append(_finger(part, solid.mesh, poses[part["joint"]], _rgb(data["colors"][part["color"]])))
            continue
        solids[part["joint"]].setdefault(part["color"], []).append(solid.mesh)
        spheres[part["joint"]].append(solid.spheres)
    colors = {name: _rgb(text) for name, text in data["colors"].items()}
    parts, covers = [], []
    for link, T_base_link in enumerate(poses):
        T = inverse(T_base_link)
        colors[OF_JOINT] = joint_color(chain(robot).links[link].leader)
        parts.append(
            tuple(Part(f"body-{c}", placed(merged(group), T), colors[c]) for c, group in solids[link].items())
        )
        cover = _outermost(np.vstack(spheres[link]))
        cover[:, :3] = cover[:, :3] @ T[:3, :3].T + T[:3, 3]
        covers.append(cover)
    return Drawing(tuple(parts), tuple(covers), tuple(fingers))


def _finger(part: dict[str, Any], mesh: Solid, T_base_link: Array, color: Color) -> Finger:
    """A part that is drawn closed and slides along `opens`."""
    T = inverse(T_base_link)
    way = T[:3, :3] @ (MM * np.array(part["opens"], dtype=float))
    length = float(np.linalg.norm(way))
    axis = np.eye(4)
    axis[:3, 2] = way / length
    axis[:3, 0] = perpendicular_to(axis[:3, 2])
    axis[:3, 1] = np.cross(axis[:3, 2], axis[:3, 0])
    return Finger(part["joint"], (Part("finger", placed(mesh, T), color),), axis, True, 0.0, length)


@dataclass(frozen=True, eq=False)
class _Covered:
    """One part in coordinates of the base, with the spheres ``(k, 4)`` that cover it."""

    mesh: Solid
    spheres: Array


def _loft(part: dict[str, Any]) -> _Covered:
    start, end = MM * np.array(part["along"], dtype=float)
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    across = _across(axis)
    first = MM * np.array(part["section"], dtype=float)
    last = MM * np.array(part["end"], dtype=float) if "end" in part else first
    bevel = min(MM * part.get("bevel", 3.0), 0.4 * length)
    heights = (0.0, 0.0, bevel, length - bevel, length, length)
    outlines = (
        _middle(first),
        outline(first, bevel),
        outline(first),
        outline(last),
        outline(last, bevel),
        _middle(last),
    )
    rings = [start + z * axis + points @ across for z, points in zip(heights, outlines, strict=True)]
    spheres = [np.column_stack([np.vstack(rings[2:4])[:: DIRECTIONS // RIM], np.zeros(2 * RIM)])]
    half = 0.5 * length
    pieces = [(first, 0.0, half), (last, half, length)] if "end" in part else [(first, 0.0, length)]
    for discs, low, high in pieces:
        for u, v, radius in spaced(discs, STEP):
            inside = min(radius, 0.5 * (high - low))
            line = start + np.outer([low + inside, high - inside], axis) + np.array([u, v]) @ across
            centres = spaced(line, max(inside, STEP))
            spheres.append(np.column_stack([centres, np.full(len(centres), inside)]))
    outward = np.cross(*across) @ axis > 0.0
    return _Covered(loft(rings if outward else rings[::-1]), np.vstack(spheres))


def _outermost(spheres: Array) -> Array:
    """Those of the spheres ``(k, 4)`` that are not inside another one, apart from `DEPTH`."""
    order = spheres[np.argsort(-spheres[:, 3], kind="stable")]
    kept: list[Array] = []
    for sphere in order:
        if all(np.linalg.norm(sphere[:3] - other[:3]) + sphere[3] > other[3] + DEPTH for other in kept):
            kept.append(sphere)
    return np.array(kept).reshape(-1, 4)


def _middle(discs: Array) -> Array:
    """The outline of a section, shrunk to one point: the rim of a cap."""
    points = outline(discs)
    return np.broadcast_to(points.mean(axis=0), points.shape)


def _across(axis: Array) -> Array:
    """The directions u and v ``(2, 3)`` of a section across an axis."""
    k = int(np.abs(axis).argmax())
    if abs(axis[k]) > 1.0 - 1e-9:
        return np.roll(np.eye(3), -(k + 1), axis=0)[:2]
    u = np.cross([0.0, 0.0, 1.0], axis)
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(axis, u)])


def _rgb(text: str) -> Color:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)
