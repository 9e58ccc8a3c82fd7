"""Ten scenes with a table, shelves and narrow gaps, and where the arm begins and ends in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

import kin

Place = tuple[Literal["down", "forward"], float, float, float]
DOWN = np.diag([1.0, -1.0, -1.0])
FORWARD = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # the tool points away from the base


@dataclass(frozen=True)
class Scene:
    """Obstacles, and the poses of the tool at both ends: which way it points, and where (m)."""

    name: str
    obstacles: tuple[kin.Obstacle, ...]
    start: Place
    goal: Place


def box(name: str, x: float, y: float, z: float, *size: float) -> kin.Obstacle:
    return kin.Obstacle("box", (x, y, z), size=size, name=name)


TABLE = box("table", 0.65, 0.0, -0.02, 0.7, 1.4, 0.05)
LEFT, RIGHT = ("down", 0.5, 0.38, 0.25), ("down", 0.5, -0.38, 0.25)


def shelf(x: float, boards: tuple[float, ...], panels: tuple[float, ...]) -> tuple[kin.Obstacle, ...]:
    """A shelf that stands in front of the arm: boards at heights, upright panels at places across."""
    top, wide = max(boards), max(panels) - min(panels)
    level = tuple(box(f"board {z:g}", x, 0.5 * (max(panels) + min(panels)), z, 0.3, wide, 0.02) for z in boards)
    return level + tuple(box(f"panel {y:g}", x, y, 0.5 * top, 0.3, 0.02, top) for y in panels)


def slot(low: float, high: float) -> tuple[kin.Obstacle, ...]:
    """A wall beside the arm with a slot between two heights."""
    return (
        box("lower wall", 0.65, 0.0, 0.5 * low, 0.7, 0.06, low),
        box("upper wall", 0.65, 0.0, high + 0.3, 0.7, 0.06, 0.6),
    )


SCENES = (
    Scene("post", (TABLE, box("post", 0.5, 0.0, 0.35, 0.1, 0.1, 0.7)), LEFT, RIGHT),
    Scene("wall", (TABLE, box("wall", 0.6, 0.0, 0.25, 0.5, 0.05, 0.5)), LEFT, RIGHT),
    Scene("two posts", (TABLE, *(box("post", 0.5, y, 0.4, 0.08, 0.08, 0.8) for y in (-0.17, 0.17))), LEFT, RIGHT),
    Scene(
        "crate",
        (
            TABLE,
            *(box("side", 0.5, y, 0.12, 0.4, 0.02, 0.24) for y in (0.18, 0.56)),
            *(box("end", x, 0.37, 0.12, 0.02, 0.4, 0.24) for x in (0.31, 0.69)),
        ),
        RIGHT,
        ("down", 0.5, 0.37, 0.18),
    ),
    Scene(
        "one level up",
        shelf(0.7, (0.15, 0.5, 0.85), (-0.35, 0.35)),
        ("forward", 0.56, 0.0, 0.33),
        ("forward", 0.56, 0.0, 0.67),
    ),
    Scene(
        "next compartment",
        shelf(0.7, (0.3, 0.75), (-0.4, 0.0, 0.4)),
        ("forward", 0.6, -0.2, 0.5),
        ("forward", 0.6, 0.2, 0.5),
    ),
    Scene(
        "into the shelf",
        shelf(0.7, (0.25, 0.65), (-0.3, 0.3)),
        ("down", 0.4, -0.5, 0.4),
        ("forward", 0.62, 0.0, 0.45),
    ),
    Scene("wide slot", slot(0.4, 0.85), ("forward", 0.5, 0.3, 0.35), ("forward", 0.5, -0.3, 0.35)),
    Scene("narrow slot", slot(0.45, 0.75), ("forward", 0.5, 0.3, 0.35), ("forward", 0.5, -0.3, 0.35)),
    Scene(
        "under a beam",
        (TABLE, box("beam", 0.45, 0.0, 0.42, 0.08, 1.6, 0.08)),
        ("forward", 0.6, 0.0, 0.22),
        ("forward", 0.6, 0.0, 0.65),
    ),
)


def ends(robot: kin.Robot, scene: Scene) -> tuple[np.ndarray, np.ndarray] | None:
    """A free configuration ``(n,)`` at each end, the first that inverse kinematics finds; None: there is none."""
    found = []
    for way, *xyz in (scene.start, scene.goal):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = DOWN if way == "down" else FORWARD, xyz
        result = kin.solve_ik(robot, T, q_seed=robot.q_home, avoid_self_collision=True, obstacles=scene.obstacles)
        if not result.solutions:
            return None
        found.append(result.solutions[0].q)
    return found[0], found[1]
