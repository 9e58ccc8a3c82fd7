"""The iterates in the scene: translucent copies of the arm, the way of the tool, start and target."""

from __future__ import annotations

import numpy as np

from app.viewer.declared.scene import Node, axes, bars
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import AMBER, BLUE, GREEN
from app.viewer.lessons.numeric.facts import Iterated
from app.viewer.lessons.numeric.iteration import Problem
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot, fk
from kin.transforms import Array

COPIES = 10  # ghosts at most, with the first and the last iterate among them
POINTS = 128  # of the way of the tool
OPACITY = 0.45
# From the start to the last iterate.
FIRST, LAST = np.array([105.0, 115.0, 130.0]), np.array([213.0, 94.0, 0.0])


def scene(problem: Problem, iterated: Iterated | None, at: int, figure: FigureNodes) -> list[Node]:
    """The target, and the iterates up to one of them."""
    T, size = problem.T, figure.size
    with figure:
        nodes = [*figure.point("aim", T[:3, 3], "target", GREEN), axes("axes", T, 5.0 * size, 0.25 * size)]
        if iterated is not None:
            nodes += _iterates(iterated, at, figure)
    return nodes


def _iterates(iterated: Iterated, at: int, figure: FigureNodes) -> list[Node]:
    robot, T, q = iterated.problem.robot, iterated.problem.T, iterated.run.q[: at + 1]
    tools, size = fk(robot, q)[:, :3, 3], figure.size
    points = figure.point("start", tools[0], "start", BLUE)
    if np.linalg.norm(tools[-1] - T[:3, 3]) > 4.0 * size and at:
        points += figure.point("here", tools[-1], str(at), AMBER)
    # Always as many, so that no node is made anew; those beyond the iterates have no length.
    way = np.repeat(tools[-1][None, None], 2, axis=1).repeat(POINTS, axis=0)
    recent = tools[-POINTS - 1 :]
    way[: len(recent) - 1] = np.stack([recent[:-1], recent[1:]], axis=1)
    return [
        *points,
        bars("way", way, AMBER, 0.3 * size),
        _ghosts(robot, q[chosen(len(q))]),
    ]


def _ghosts(robot: Robot, q: Array) -> Node:
    """Copies of the arm at configurations ``(k, n)``."""
    vertices, faces = cylinder()
    sizes = skeleton(robot).scales
    positions, wxyz, _ = places(robot, q)
    shape = (COPIES, len(sizes), 3)
    everywhere, turned = np.zeros(shape), np.tile([1.0, 0.0, 0.0, 0.0], (COPIES, len(sizes), 1))
    scales, colours = np.full(shape, 1e-6), np.zeros(shape)
    k = len(q)
    everywhere[:k], turned[:k], scales[:k] = positions, wxyz, sizes
    share = np.linspace(0.0, 1.0, k)[:, None, None] if k > 1 else np.ones((1, 1, 1))
    colours[:k] = FIRST + share * (LAST - FIRST)
    return Node(
        "batched_meshes_simple",
        "ghosts",
        {
            "vertices": vertices,
            "faces": faces,
            "batched_positions": everywhere.reshape(-1, 3).astype(np.float32),
            "batched_wxyzs": turned.reshape(-1, 4).astype(np.float32),
            "batched_scales": scales.reshape(-1, 3).astype(np.float32),
            "batched_colors": colours.reshape(-1, 3).astype(np.uint8),
            "opacity": OPACITY,
            "lod": "off",
            "cast_shadow": False,
            "receive_shadow": False,
        },
    )


def chosen(count: int) -> list[int]:
    """Which of `count` iterates are drawn: the first ones, where steps are large, and the last."""
    if count <= COPIES:
        return list(range(count))
    return [*range(COPIES - 1), count - 1]
