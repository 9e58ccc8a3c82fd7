"""The lesson's drawings: the ring of arm angles, the elbow's circle, and the trade of two coaxial joints."""

from __future__ import annotations

import numpy as np

from app.viewer.declared.scene import Color, Lazy, Node, bars, label, lines
from app.viewer.lessons.redundancy.facts import RedundancyFacts
from app.viewer.lessons.redundancy.path import elbow_paths, has_path
from app.viewer.lessons.redundancy.ring import FLAT, Circle, Ring, arc_segments, elbow_circle, trade_segments
from app.viewer.scene.bodies.parts import JOINT_COLORS
from app.viewer.scene.meshes import body
from app.viewer.self_motion import End
from kin import Robot
from kin.ik import Redundancy
from kin.transforms import Array

RING = 1.32  # radius of the ring, relative to the elbow's circle
SMALLEST_CIRCLE = 0.25  # of the arm's size unit; a smaller circle has no room for a ring
TRADE_RADIUS = 4.6  # in the arm's size unit
FEASIBLE, BLOCKED, LIMIT, NOW, ELBOW, LINE = (
    (0, 158, 115),
    (165, 165, 165),
    (213, 94, 0),
    (0, 114, 178),
    (86, 180, 233),
    (120, 120, 120),
)


def scene(read: RedundancyFacts) -> list[Node | Lazy]:
    """All drawings, of the facts that the panel shows."""
    present = Lazy("present", _present, (read,))
    return [present] if read.ring is None else [present, Lazy("ring", _ring, (read.ring,))]


def _ring(ring: Ring) -> list[Node]:
    """Feasible and blocked arcs and their ends. An arm whose elbow is not on a circle gets its path instead."""
    robot, item = ring.robot, ring.item
    if item is None:
        return []
    if has_path(robot, item):
        return _path(ring, item)
    circle = _circle(robot, elbow_circle(robot, ring.goal)) if item.name == "psi" else None
    if circle is None:
        return []
    size, nodes = body(robot).size, []
    chords, inside = arc_segments(circle, item.intervals, RING)
    for kind, rows, color, width in (
        ("feasible", inside, FEASIBLE, 0.5),
        ("blocked", np.logical_not(inside), BLOCKED, 0.25),
    ):
        if rows.any():
            nodes.append(bars(kind, chords[rows], color, width * size))
    for i, end in enumerate(ring.ends):
        ray = np.array([[circle.at(end.value, RING - 0.12), circle.at(end.value, RING + 0.18)]])
        nodes.append(bars(f"end-{i}", ray, LIMIT, 0.4 * size))
        nodes.append(_name(f"end-{i}-name", end, circle.at(end.value, RING + 0.3)))
    return nodes


def _path(ring: Ring, item: Redundancy) -> list[Node]:
    """The path of the elbow, and what ends it."""
    size, nodes = body(ring.robot).size, []
    for i, (interval, path) in enumerate(elbow_paths(ring.robot, ring.T_held, ring.goal, item)):
        if np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < size:
            continue
        chords = np.stack([path[:-1], path[1:]], axis=1)
        nodes.append(bars(f"path-{i}", chords, FEASIBLE, 0.5 * size))
        for k, point in ((0, path[0]), (1, path[-1])):
            close = [end for end in ring.ends if abs(end.value - interval[k]) < 1e-9]
            if len(close) == 1:
                nodes.append(_name(f"path-{i}-{k}", close[0], point))
    return nodes


def _name(key: str, end: End, at: Array) -> Node:
    text = f"limit of joint {end.joint + 1}" if end.joint >= 0 else "posture ends"
    return label(key, text, at, anchor=None)


def _present(facts: RedundancyFacts) -> list[Node]:
    """The configuration in the scene: the line from shoulder to wrist and the elbow, or the trade."""
    robot, item, size = facts.robot, facts.item, body(facts.robot).size
    nodes = []
    circle = _circle(robot, facts.circle) if item is not None and item.name == "psi" else None
    if circle is not None and item is not None:
        pointer = np.array([[circle.center, circle.at(item.value, RING + 0.1)]])
        nodes = [
            lines("line", np.array([[circle.shoulder, circle.wrist]]), LINE, 1.5),
            lines("elbow", arc_segments(circle, (), 1.0)[0], ELBOW, 2.0),
            bars("now", pointer, NOW, 0.28 * size),
        ]
    if facts.trades:
        chords, joints = trade_segments(robot, facts.q, TRADE_RADIUS * size)
        # One node for each colour: the browser shows colours given per point brighter.
        colors: tuple[tuple[Color, float], ...] = ((JOINT_COLORS[0], 0.35), (JOINT_COLORS[1], 0.35), (LINE, 0.15))
        for i, (color, width) in enumerate(colors):
            nodes.append(bars(f"trade-{i}", chords[joints == i], color, width * size))
    return nodes


def _circle(robot: Robot, circle: Circle | None) -> Circle | None:
    """The circle, if it has room for a ring."""
    smallest = max(FLAT, SMALLEST_CIRCLE * body(robot).size)
    return circle if circle is not None and circle.radius > smallest else None
