"""What is assumed of a link whose body is not known: tubes along the lengths d and a of its rows."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.joint import stroke_of
from kin.robot import Joint, Robot, exact_cos_sin

SHARE, THINNEST, STOUTEST = 0.032, 0.014, 0.3  # radius, relative to all lengths, and at most to the shortest one
OFFSET = 0.04  # a length below this share of all is an offset, and not what limits the radius
SHORTEST = 1e-6  # m

Point = tuple[float, float, float]
ORIGIN = (0.0, 0.0, 0.0)


class Tube(NamedTuple):
    """The axis of a tube: of link `link`, in the frame of DH row `row`."""

    link: int
    row: int
    start: Point
    end: Point


def radius_of(pieces: list[Tube]) -> float:
    """The radius of all tubes of an arm."""
    lengths = np.array([math.dist(each.start, each.end) for each in pieces])
    whole = float(lengths.sum())
    shortest = float(lengths[lengths > OFFSET * whole].min(initial=whole))
    return max(min(SHARE * whole, STOUTEST * shortest), THINNEST * whole)


def tubes(robot: Robot) -> list[Tube]:
    """Tubes along the lengths of the table, base first; none where a link has no length."""
    found: list[Tube] = []

    def add(link: int, row: int, start: Point, end: Point) -> None:
        if math.dist(start, end) > SHORTEST:
            found.append(Tube(link, row, start, end))

    link = 0
    for i, row in enumerate(robot.rows):
        rod = _rod(robot, row)
        if robot.convention == "modified":
            add(link, i - 1, ORIGIN, (row.a, 0.0, 0.0))
            link += row.moves
            add(link, i, (0.0, 0.0, -row.d - rod), ORIGIN)
            continue
        link += row.moves
        # Seen from the frame behind Tx(a) Rx(α).
        c, s = exact_cos_sin(row.alpha)
        corner = (-row.a, 0.0, 0.0)
        back = row.d + rod
        add(link, i, (-row.a, -s * back, -c * back), corner)
        add(link, i, corner, ORIGIN)
    add(link, len(robot.rows) - 1, ORIGIN, tuple(robot.T_last_tool[:3, 3].tolist()))
    return found


def _rod(robot: Robot, row: Joint) -> float:
    """Length of what slides: as far as it is drawn out at most."""
    stroke = stroke_of(row, robot.joints) if row.kind == "prismatic" else 0.0
    return stroke if math.isfinite(stroke) else 0.0
