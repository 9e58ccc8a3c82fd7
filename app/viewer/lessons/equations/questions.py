"""The facts that the texts of the lesson "Equations" use (``lesson.toml``): the tool's pose of an arm at home."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot, fk, jacobian
from kin.axes import NEARLY
from kin.differential.task import lifts
from kin.transforms import Array
from kin.units import Units, fixed

SAMPLES = 8


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    return outline_of("equations", robot, units, facts(robot, units))


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    T = fk(robot, robot.q_home)
    a = np.cross(T[:3, 0], T[:3, 1])
    k, tested = int(np.argmax(np.abs(a))), int(np.argmax(np.abs(T[:3, 0])))
    i, j = "xyz"[(k + 1) % 3], "xyz"[(k + 2) % 3]
    product = flipped(T, tested, 0)
    numbers = {
        "largest": float(a[k]),
        "found": float(product > NEARLY),
        "raises": float(changes_height(robot, 0)),
    }
    words = {
        "p": "(" + ", ".join(units.lengths.number(v) for v in T[:3, 3].tolist()) + f"){units.lengths.suffix}",
        **{f"{name}_column": _vector(T[:3, column]) for column, name in enumerate("noa")},
        "component": "xyz"[k],
        "terms": f"n{i} o{j} − n{j} o{i}",
        "tested": f"n{'xyz'[tested]}",
        "product": fixed(product, 3),
    }
    return LessonFacts(numbers, {}, words, {"home": Pose(as_configuration(robot.q_home))})


def _vector(column: Array) -> str:
    return "(" + ", ".join(fixed(value, 3) for value in column.tolist()) + ")"


def flipped(T: Array, row: int, column: int) -> float:
    """The largest entry of RᵀR − I if one entry of R is printed with the wrong sign."""
    R = T[:3, :3].copy()
    R[row, column] *= -1.0
    return float(np.abs(R.T @ R - np.eye(3)).max())


def changes_height(robot: Robot, joint: int) -> bool:
    """Whether a joint ever changes z of the tool point."""
    q = robot.random_q(np.random.default_rng(5), SAMPLES)
    return lifts(robot, jacobian(robot, q), joint)
