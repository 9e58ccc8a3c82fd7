"""What a program has drawn in the scene, by the names that it gave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from app.viewer.declared.scene import Node, axes, label, lines
from kin import InputError
from kin.transforms import pose_from_position_wxyz

MOST, MOST_POINTS = 100, 20_000  # drawings, and points in all of them

Drawn = tuple[int, Mapping[str, Any]]  # a number that no other has, and the fields of the API
Drawings = dict[str, Drawn]  # by name


def merged(drawings: Drawings, more: Mapping[str, Mapping[str, Any] | None], numbers: Iterator[int]) -> Drawings:
    """The drawings with others of these names; None removes one. Raises `InputError` for too many."""
    found = dict(drawings)
    for name, fields in more.items():
        found.pop(name, None)
        if fields is not None:
            found[name] = next(numbers), fields
    if len(found) > MOST:
        raise InputError("draw", f"{len(found)} drawings", f"at most {MOST} in a page")
    points = sum(len(fields.get("points", ())) for _, fields in found.values())
    if points > MOST_POINTS:
        raise InputError("draw", f"{points} points in all drawings", f"at most {MOST_POINTS} in a page")
    return found


def nodes(drawings: tuple[Drawn, ...]) -> list[Node]:
    """The nodes of the scene; a drawing that is replaced is made anew."""
    return [_node(f"drawn-{serial}", fields) for serial, fields in drawings]


def _node(key: str, fields: Mapping[str, Any]) -> Node:
    match fields["kind"]:
        case "points":
            points = np.asarray(fields["points"], np.float32)
            props = {
                "points": points,
                "colors": np.tile(np.array(_rgb(fields["color"]), np.uint8), (len(points), 1)),
                "point_size": fields["size"],
                "point_shape": "circle",
            }
            node = Node("point_cloud", key, props)
        case "line":
            points = np.asarray(fields["points"], np.float32)
            chords = np.stack([points[:-1], points[1:]], axis=1)
            node = lines(key, chords, _rgb(fields["color"]), fields["width"])
        case "frame":
            T, length = pose_from_position_wxyz(fields["position"], fields["wxyz"]), fields["length"]
            node = axes(key, T, length, 0.03 * length)
        case _:
            node = label(key, fields["text"], fields["position"])
    node.keep, node.once = False, True
    return node


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
