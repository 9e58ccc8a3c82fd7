"""The arms of the benchmark: the built-in ones, and others whose geometry has no closed form of its own.

Lengths as the makers publish them, or round numbers where "like" is said.
"""

from __future__ import annotations

import math
from functools import cache

import kin
from kin.robot import Robot

_QUARTER, _SIXTY = 0.5 * math.pi, math.pi / 3.0
Table = tuple[tuple[float, float, float, float], ...]  # rows (θ, d, a, α), standard
_TABLES: dict[str, tuple[str, Table]] = {
    "jaco": (
        "Jaco, wrist of 60°",
        (
            (0, 0.2755, 0, _QUARTER),
            (0, 0, 0.41, math.pi),
            (0, -0.0098, 0, _QUARTER),
            (0, -0.25008, 0, _SIXTY),
            (0, -0.08556, 0, _SIXTY),
            (0, -0.20278, 0, math.pi),
        ),
    ),
    "crx": (
        "CRX-like",
        (
            (0, 0, 0, -_QUARTER),
            (0, 0, 0.54, math.pi),
            (0, 0, 0, -_QUARTER),
            (0, -0.54, 0, _QUARTER),
            (0, 0.15, 0, -_QUARTER),
            (0, -0.16, 0, math.pi),
        ),
    ),
    "sawyer": (
        "Sawyer",
        (
            (0, 0.317, 0.081, -_QUARTER),
            (_QUARTER, 0.1925, 0, _QUARTER),
            (0, 0.4, 0, -_QUARTER),
            (0, -0.1685, 0, _QUARTER),
            (0, 0.4, 0, -_QUARTER),
            (0, 0.1363, 0, _QUARTER),
            (0, 0.13375, 0, 0),
        ),
    ),
    "scorbot": (
        "Scorbot ER-VII",
        (
            (0, 0.3585, 0.05, -_QUARTER),
            (0, -0.037, 0.3, 0),
            (0, 0, 0.35, 0),
            (0, 0, 0, -_QUARTER),
            (0, 0.251, 0, 0),
        ),
    ),
    "elbow5": (
        "five joints, offset elbow",
        (
            (0, 0.3, 0.05, -_QUARTER),
            (0, 0.1, 0.4, 0),
            (0, 0, 0.02, -_QUARTER),
            (0, 0.4, 0, _QUARTER),
            (0, 0, 0, -_QUARTER),
        ),
    ),
}


@cache
def robots() -> dict[str, Robot]:
    """All arms by id."""
    others = {
        robot_id: kin.Robot.from_dh(
            table, robot_id=robot_id, name=name, home=[0.1, 0.2, -0.3, 0.4, 0.5, 0.6, 0.7][: len(table)]
        )
        for robot_id, (name, table) in _TABLES.items()
    }
    return {**kin.files.classic_robots(), "ur5e": kin.get_robot("ur5e"), **others}
