"""The walk through a DH table in the scene: a large moving frame, the completed frames, and the present parameter.

Links hide their own axes. So rotations are drawn as arcs at a distance from the joint, and lengths as in an
engineering drawing: next to what they measure, between two extension lines. The table in the other convention is
drawn as a skeleton to one side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.exercises.rows import turns
from app.viewer.declared.scene import Lazy, Node, axes, bars, frame, label
from app.viewer.lessons.dh.facts import DHFacts
from app.viewer.lessons.dh.steps import (
    MOVED,
    ORDERS,
    amount,
    axis,
    coaxial_joints,
    coinciding,
    elementary,
    expression,
    frames_name,
    reread,
)
from app.viewer.lessons.dh.views import ABOUT_X, ABOUT_Z, TITLES
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import GREY, Segments, clear_of
from app.viewer.lessons.label_room import label_room
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.meshes import body
from kin import Robot, link_frames
from kin.axes import inverse
from kin.transforms import Array
from kin.units import Units

AXES = ((204, 0, 0), (51, 153, 0), (0, 0, 204))  # x, y, z, as viser paints the axes of a frame
# In units of the arm's thickness.
MOVING, PLACED = 8.0, 4.5
FRAME = "frame 0"  # a label of usual length
HEIGHTS = (1.2, -0.6, 1.7, -1.2, 0.6)  # of a frame's label, in lengths of its z axis


def triads(frames: Array, size: float) -> Segments:
    """x, y and z of frames ``(k, 4, 4)`` as lines ``(3k, 2, 3)``."""
    origins = np.repeat(frames[:, None, :3, 3], 3, axis=1)
    tips = origins + size * np.swapaxes(frames[:, :3, :3], 1, 2)
    return np.stack([origins, tips], axis=2).reshape(-1, 2, 3).astype(np.float32)


@lru_cache(maxsize=64)
def triad_colors(count: int) -> NDArray[np.uint8]:
    """Colours of the lines of `count` `triads`."""
    colors = np.array([linear(color) for color in AXES])
    return np.tile(np.repeat(colors[:, None], 2, axis=1), (count, 1, 1))


def linear(color: tuple[int, int, int]) -> NDArray[np.uint8]:
    """A screen colour as viser needs it at the ends of lines: it takes those as linear intensities."""
    return np.round(255.0 * (np.array(color) / 255.0) ** 2.2).astype(np.uint8)


def skeleton(robot: Robot, frames: Array) -> Segments:
    """The links as lines ``(2 rows, 2, 3)``: along z by d and along x by a, in the convention's order."""
    start = np.concatenate([robot.T_world_base[None], frames[:-1]])
    origin, end = start[:, :3, 3], frames[:, :3, 3]
    if robot.convention == "standard":
        bend = origin + start[:, :3, 2] * ((end - origin) * start[:, :3, 2]).sum(1, keepdims=True)
    else:
        bend = origin + start[:, :3, 0] * ((end - origin) * start[:, :3, 0]).sum(1, keepdims=True)
    return (
        np.stack([np.stack([origin, bend], 1), np.stack([bend, end], 1)], 1).reshape(-1, 2, 3).astype(np.float32)
    )


def joint_axis(robot: Robot, frames: Array, joint: int, reach: float) -> Segments:
    """The axis of a moving joint ``(1, 2, 3)``, to a distance `reach` on both sides."""
    row = robot.joint_rows[joint]
    # In a standard table a joint turns about z of the frame before its row.
    line = row - 1 if robot.convention == "standard" else row
    T = frames[line] if line >= 0 else robot.T_world_base
    return np.array([[T[:3, 3] - reach * T[:3, 2], T[:3, 3] + reach * T[:3, 2]]], dtype=np.float32)


def walk(facts: DHFacts, read: DHFacts, figure: FigureNodes, units: Units, asked: bool) -> list[Node | Lazy]:
    """The walk on the arm itself.

    Args:
        read: what the panel shows. Labels of frames are moved with it: they cost as much as the rest.
        asked: whether a question asks for what a joint makes of its row.
    """
    size, at = body(facts.robot).size, facts.place
    with figure:
        measured = _measured(facts, figure, units, asked)
    placed = _with_base(facts.robot, facts.frames)[: at.placed + 1]
    return [
        moving_frame("moving", at.T_0_now, size),
        placed_frames("placed", placed, size),
        *measured,
        Lazy("names", _names, (read,)),
    ]


def _names(facts: DHFacts) -> list[Node]:
    """One label for all placed frames of one origin, at the tip of the z axis of one of them."""
    robot, count, size, nodes = facts.robot, facts.place.placed + 1, body(facts.robot).size, []
    frames = _with_base(robot, facts.frames)[:count]
    for group, (member, height) in zip(coinciding(robot), _places_of_labels(robot), strict=True):
        if placed := [number for number in group if number < count]:
            T = frames[min(member, count - 1)]
            point = T[:3, 3] + height * PLACED * size * T[:3, 2]
            nodes.append(label(f"name-{group[0]}", frames_name(placed, len(robot.rows)), point))
    return nodes


def _measured(facts: DHFacts, figure: FigureNodes, units: Units, asked: bool) -> list[Node]:
    """The parameters of the row so far, each beside what it measures; the present one with its share."""
    robot, at, nodes = facts.robot, facts.place, list[Node]()
    T = at.T_0_now @ inverse(at.A)  # the frame before the row
    moved = MOVED.get(robot.rows[at.row].kind)
    for k, factor in enumerate(ORDERS[robot.convention][: at.motion + 1]):
        value = at.values[k]
        shown = value * (at.share if k == at.motion else 1.0)
        if value != 0.0 and not (asked and factor == moved):
            so_far = f"{amount(factor, shown, units)} of " if shown != value else ""
            text = f"{expression(robot, at.row, factor, units)} = {so_far}{amount(factor, value, units)}"
            about, p, R = axis(factor), T[:3, 3], T[:3, :3]
            color = ABOUT_Z if about == 2 else ABOUT_X
            if turns(factor):
                # About z from x, and about x from z.
                start, axle = R[:, 2 - about], R[:, about]
                nodes += figure.angle(factor, p, start, axle, shown, "", units, color, words=text)
            else:
                off = clear_of(p, p + value * R[:, about], facts.frames[:, :3, 3])
                nodes += figure.dimension(factor, p, p + shown * R[:, about], "", units, off, color, words=text)
        T = T @ elementary(factor, shown)
    return nodes


def both(facts: DHFacts, read: DHFacts) -> list[Node | Lazy]:
    """The table in the other convention: a skeleton next to the arm, and on both the joint axes that differ."""
    robot, other, size, offset = facts.robot, facts.other, body(facts.robot).size, aside(facts.robot)
    beside = [
        moving_frame("moving", facts.other_place.T_0_now, size),
        bars("bones", skeleton(other, facts.other_frames), GREY, 1.1 * size),
        placed_frames("frames", _with_base(other, facts.other_frames), size),
    ]
    return [
        *_joint_axes(robot, facts.frames, size),
        Lazy("axes", _axis_names, (robot, read.frames, offset, size)),
        frame(
            "other",
            *beside,
            *_joint_axes(other, facts.other_frames, size),
            Lazy("axes", _axis_names, (other, read.other_frames, -offset, size)),
            position=offset,
        ),
    ]


@lru_cache(maxsize=64)
def _compared_joints(robot: Robot) -> tuple[int, ...]:
    """Indices of the joints that share an axis with a neighbour in one of the conventions."""
    return tuple(sorted({j for r in (robot, reread(robot)) for k in coaxial_joints(r) for j in (k, k + 1)}))


def _joint_axes(robot: Robot, frames: Array, size: float) -> list[Node]:
    return [
        bars(f"line-{j + 1}", joint_axis(robot, frames, j, 11.0 * size), joint_color(j), 0.3 * size)
        for j in _compared_joints(robot)
    ]


def _axis_names(robot: Robot, frames: Array, outwards: Array, size: float) -> list[Node]:
    """The title of a reading and the names of its axes, at their outer ends: those of both arms must not meet."""
    base = robot.T_world_base[:3, 3] - np.array([0.0, 0.0, 3.0 * size])
    nodes, coaxial = [label("title", TITLES[robot.convention], base, anchor="top-center")], coaxial_joints(robot)
    for j in _compared_joints(robot):
        if j in coaxial:
            continue  # two joints on one axis have one label
        text = f"joints {j} and {j + 1}: one axis" if j - 1 in coaxial else f"joint {j + 1}"
        ends = joint_axis(robot, frames, j, 11.0 * size)[0]
        end = ends[int((ends @ outwards.astype(np.float32)).argmin())]
        nodes.append(label(f"line-{j + 1}-name", text, end, anchor="center-left"))
    return nodes


def moving_frame(key: str, T: Array, size: float) -> Node:
    """A large frame ``(4, 4)`` with labelled axes."""
    look = {"origin_radius": 0.4 * size, "origin_color": (230, 159, 0)}
    node = axes(key, T, MOVING * size, 0.17 * size, **look)
    node.children = [Lazy("letters", _letters, (size,))]
    return node


def _letters(size: float) -> list[Node]:
    return [label(letter, letter, 1.1 * MOVING * size * tip) for letter, tip in zip("xyz", np.eye(3), strict=True)]


def placed_frames(key: str, frames: Array, size: float) -> Node:
    """The axes of frames ``(k, 4, 4)`` as lines. Another number of them has a node of its own."""
    node = bars(f"{key}-{len(frames)}", triads(frames, PLACED * size), triad_colors(len(frames)), 0.26 * size)
    node.keep = False
    return node


def _with_base(robot: Robot, frames: Array) -> Array:
    """The base's frame and the frames after each row ``(rows + 1, 4, 4)``."""
    return np.concatenate([robot.T_world_base[None], frames])


def aside(robot: Robot) -> Array:
    """The place ``(3,)`` of the other arm: to the left of the arm in the default view, out of its reach."""
    left = np.array([DIRECTION[1], -DIRECTION[0], 0.0])
    place: Array = 1.4 * body(robot).radius * left / np.linalg.norm(left)
    return place


@lru_cache(maxsize=64)
def _places_of_labels(robot: Robot) -> list[tuple[int, float]]:
    frames = _with_base(robot, link_frames(robot, robot.q_home))
    return label_places(coinciding(robot), frames, body(robot).size)


def label_places(groups: Sequence[Sequence[int]], frames: Array, size: float) -> list[tuple[int, float]]:
    """Where the label of each group of `frames` ``(k, 4, 4)`` is: at the z axis of which one, at how many lengths.

    It is the first place with room for a label, or else the one farthest from all labels before.
    """
    chosen: list[tuple[int, float]] = []
    taken: list[Array] = []
    for group in groups:
        best, most = (group[0], HEIGHTS[0]), -1.0
        for member, height in ((member, height) for height in HEIGHTS for member in group):
            point = frames[member, :3, 3] + height * PLACED * size * frames[member, :3, 2]
            room = min((label_room(point - other, FRAME, FRAME, size) for other in taken), default=math.inf)
            if room > most:
                best, most = (member, height), room
            if room >= 1.0:
                break
        chosen.append(best)
        taken.append(frames[best[0], :3, 3] + best[1] * PLACED * size * frames[best[0], :3, 2])
    return chosen
