"""The drawings of a program: the path of the tool, coloured by its speed, and its waypoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.viewer.declared.scene import Color, Node, bars, label
from app.viewer.scene.meshes import body
from app.viewer.skeleton import placed, places, skeleton
from app.viewer.tabs.program.plan import Fault, Plan, tool_path
from app.viewer.tabs.workspace.colours import table
from kin import fk
from kin.motion import Circ, Motion
from kin.transforms import Array, wxyz_from_rotation

MAP = "viridis"
LEVELS = 8  # colours of the path
FAULT, VIA, OTHER, GHOST = (213, 94, 0), (204, 121, 167), (213, 94, 0), (120, 144, 168)
GHOSTS = 12  # at most; waypoints between are left out evenly
FRAMES = 14  # frames along the path
LABEL = 1.2  # of the arm's size: labels that are closer share one


def nodes(plan: Plan, fault: Fault | None, ghosts: bool, frames: bool, other: Motion | None) -> Sequence[Node]:
    """Everything.

    Args:
        fault: what cannot be driven.
        ghosts, frames: whether copies of the arm, and frames along the path, are shown.
        other: a motion that is compared with the program.
    """
    robot, driven = plan.motion.robot, plan.driven
    size = body(robot).size
    poses = fk(robot, plan.waypoints)
    found = [_axes("waypoints", poses, 2.2 * size, 0.11 * size)]
    labels = list(zip(poses[:, :3, 3], _names(plan), strict=True))
    if fault is not None:
        found += _fault(plan, fault, size)
        if fault.place is not None:
            labels.append((np.array(fault.place), "✕ cannot go on"))
    for i, (place, words) in enumerate(shared(labels, LABEL * size)):
        found.append(_gone(label(f"name-{i}", words, place, 0.9, anchor=None)))
    for i, row in enumerate(plan.segments):
        if isinstance(row, Circ):
            found.append(_dot(f"via-{i}", 0.3 * size, VIA, 1.0, np.array(row.via)))
    if ghosts:
        found.append(_ghosts(plan))
    if driven is not None and driven.duration > 0.0:
        found += _path(plan, size)
        if frames:
            found.append(_frames(plan, size))
    if other is not None and other.planned and other.duration > 0.0:
        points = tool_path(other)[0][:, :3, 3]
        dashes = points[: len(points) // 2 * 2].reshape(-1, 2, 3)
        found.append(_gone(bars("other", dashes, OTHER, 0.18 * size)))
    return found


def _gone(node: Node) -> Node:
    """The node, which is removed when it is not shown."""
    node.keep = False
    return node


def _fault(plan: Plan, fault: Fault, size: float) -> list[Node]:
    """The end of the row that cannot be driven, the tool's way there, and where on it the arm cannot go on."""
    if fault.index >= len(plan.q) or not plan.q[fault.index]:
        return []
    end = fk(plan.motion.robot, plan.q[fault.index][-1])[:3, 3]
    found = [_dot("fault", 0.5 * size, FAULT, 0.55, end)]
    if len(fault.way) > 1:
        points = np.array(fault.way)
        found.append(_gone(bars("fault-way", np.stack([points[:-1], points[1:]], axis=1), FAULT, 0.22 * size)))
    if fault.place is not None:
        found.append(_dot("fault-place", 0.36 * size, FAULT, 1.0, np.array(fault.place)))
    return found


def _dot(key: str, radius: float, colour: Color, opacity: float, at: Array) -> Node:
    looks = {"opacity": opacity, "cast_shadow": False, "receive_shadow": False}
    return Node("icosphere", key, {"radius": radius, "color": colour, **looks}, at, keep=False)


def _axes(key: str, poses: Array, length: float, radius: float) -> Node:
    where = {"batched_wxyzs": wxyz_from_rotation(poses[:, :3, :3]), "batched_positions": poses[:, :3, 3]}
    return Node("batched_axes", key, {**where, "axes_length": length, "axes_radius": radius}, keep=False)


def _path(plan: Plan, size: float) -> list[Node]:
    """The path of the tool. One node for each colour: the browser shows colours of points brighter."""
    T, speed = plan.path
    points = T[:, :3, 3]
    if plan.top_speed < 1e-6:
        return []
    chords = np.stack([points[:-1], points[1:]], axis=1)
    middle = 0.5 * (speed[:-1] + speed[1:]) / plan.top_speed
    level = np.minimum((middle * LEVELS).astype(int), LEVELS - 1)
    found = []
    for k in np.unique(level).tolist():
        r, g, b = table(MAP)[int((k + 0.5) * 255 / LEVELS)].tolist()
        found.append(_gone(bars(f"path-{k}", chords[level == k], (r, g, b), 0.3 * size)))
    return found


def _frames(plan: Plan, size: float) -> Node:
    """Small frames along the path, at equal distances."""
    T, _ = plan.path
    steps = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1) + 1e-9
    way = np.concatenate([[0.0], np.cumsum(steps)])
    rows = np.searchsorted(way, np.linspace(0.0, way[-1], FRAMES + 2)[1:-1])
    return _axes("frames", T[rows], 1.1 * size, 0.05 * size)


def _ghosts(plan: Plan) -> Node:
    """Translucent copies of the arm at the waypoints.

    They are hidden, not removed: browsers do not draw others that are added below the same frame afterwards.
    """
    robot, q = plan.motion.robot, plan.waypoints
    rows = np.unique(np.linspace(0, len(q) - 1, min(len(q), GHOSTS)).astype(int))
    positions, wxyz, _ = places(robot, q[rows])
    node = placed("ghosts", robot, positions.reshape(-1, 3), wxyz.reshape(-1, 4), GHOST, 0.3)
    node.props["batched_scales"] = np.tile(skeleton(robot).scales, (len(rows), 1))
    return node


def _names(plan: Plan) -> list[str]:
    """The label of each target: the number of its row and, at its end, its name; other points have two numbers."""
    found = []
    for i, (row, q) in enumerate(zip(plan.segments, plan.q, strict=True)):
        found += [f"{i + 1}.{k + 1}" for k in range(len(q) - 1)]
        found += [f"{i + 1} {row.name}".strip()] if q else []
    return found


def shared(labels: list[tuple[Array, str]], near: float) -> list[tuple[Array, str]]:
    """Labels of places ``(3,)``; those within `near` (m) of one another are one, which would overprint else."""
    found: list[tuple[Array, list[str]]] = []
    for place, name in labels:
        other = next((words for at, words in found if np.linalg.norm(at - place) < near), None)
        if other is None:
            found.append((place, [name]))
        else:
            other.append(name)
    return [(place, " · ".join(words)) for place, words in found]
