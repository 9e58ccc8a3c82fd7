"""Ghosts: translucent copies of the arm, one node each, posed by sending a few hundred bytes.

A ghost consists of instances of one cylinder: along each link and, short and wide, about each axis. The browser
draws all of them in one call, and a new posture is a new list of their poses.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

from app.viewer.declared.scene import Node, frame, label
from app.viewer.postures.survey import Posture, color_of
from app.viewer.scene.meshes import body
from app.viewer.skeleton import placed, places
from kin import Robot

OPACITY, FAINT = 0.42, 0.2


def ghosts(
    robot: Robot,
    postures: tuple[Posture, ...],
    shown: frozenset[str],
    click: Callable[[int], tuple[Hashable, ...]],
) -> list[Node]:
    """The ghosts of these branches with their numbers; `click` gives the event of a click on one of them."""
    rows = [(i, p, p.q) for i, p in enumerate(postures) if p.q is not None and p.name in shown]
    if not rows:
        return []
    positions, wxyz, anchors = places(robot, np.array([q for _, _, q in rows]))
    nodes, names, size = [], dict[tuple[float, ...], str](), body(robot).size
    for k, (i, posture, _) in enumerate(rows):
        color, opacity = color_of(i, posture), OPACITY if posture.available else FAINT
        nodes.append(placed(str(i + 1), robot, positions[k], wxyz[k], color, opacity, click=click(i)))
        at = tuple((np.round(anchors[k] / size) * size).tolist())
        names[at] = f"{names[at]} · {i + 1}" if at in names else str(i + 1)
    labels = [label(str(k), text, at, anchor=None) for k, (at, text) in enumerate(names.items(), 1)]
    return [frame("ghost", *nodes), frame("name", *labels)]
