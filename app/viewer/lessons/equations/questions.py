"""The facts that the texts of the lesson "Equations" use (``lesson.toml``): the tool's pose of an arm at home."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from app.exercises.variant import Quantity
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import DOWN, UP, bar, direction
from app.viewer.lessons.guide.outline import Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration, first_clear
from kin import Robot, fk, jacobian
from kin.transforms import Array
from kin.units import Units, fixed

NEAR = 0.01  # m by which a printed coordinate may differ from the right one
_TRIED, _ROUNDS = 40, 20


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    T = fk(robot, robot.q_home)
    n = np.cross(T[:3, 1], T[:3, 2])
    k = int(np.argmax(np.abs(n)))
    i, j = "xyz"[(k + 1) % 3], "xyz"[(k + 2) % 3]
    entry = int(np.argmax(np.abs(T[:3, 3])))
    hidden = without(robot, entry)
    numbers: dict[str, float | Quantity] = {
        "largest": float(n[k]),
        "entry": entry + 1.0,
        "near": Quantity(NEAR, "length"),
    }
    words = {
        "p": "(" + ", ".join(units.lengths.number(v) for v in T[:3, 3].tolist()) + f"){units.lengths.suffix}",
        **{f"{name}_column": _vector(T[:3, column]) for column, name in ((1, "o"), (2, "a"))},
        "entry_name": f"p{'xyz'[entry]}",
        "height": "Higher" if T[2, 3] > 0.0 else "Lower",
        "other_height": "Lower" if T[2, 3] > 0.0 else "Higher",
        "component": "xyz"[k],
        "terms": f"o{i} a{j} − o{j} a{i}",
        "tested": f"n{'xyz'[k]}",
        "product": fixed(flipped(T, k, 0), 3),
    }
    functions = {"hides": lambda joint: float(hidden[int(joint) - 1])}
    return LessonFacts(
        numbers, functions, words, {"home": Pose(as_configuration(robot.q_home))}, leads=leads(robot, T)
    )


def leads(robot: Robot, T: Array) -> dict[str, Lead | None]:
    """The columns of the tool's pose ``(4, 4)``, and ways up, level and down to where the tool point is."""
    p, foot = T[:3, 3], np.array([T[0, 3], T[1, 3], 0.0])
    ways = {name: direction(robot, p, T[:3, column]) for column, name in enumerate("noa")}
    other = direction(robot, foot, DOWN if p[2] > 0.0 else UP)
    heights = {"height": bar(foot, p), "other height": other, "as high": bar(np.zeros(3), foot)}
    return {**ways, **heights, "p": bar(np.zeros(3), p)}


@lru_cache(maxsize=64)
def without(robot: Robot, entry: int) -> Array:
    """A configuration ``(n,)`` with one coordinate of the tool point at zero."""
    found = first_clear(robot, _at_zero(robot, entry))
    assert found is not None
    return found


def _at_zero(robot: Robot, entry: int) -> Iterator[Array]:
    """Configurations ``(n,)`` with one coordinate of the tool point at zero."""
    for q in (robot.q_home, *robot.random_q(np.random.default_rng(6), _TRIED)):
        for _ in range(_ROUNDS):
            value, row = float(fk(robot, q)[entry, 3]), jacobian(robot, q)[entry]
            if abs(value) < 0.01 * NEAR:
                yield np.asarray(q)
                break
            if not (size := float(row @ row)) > 1e-9:
                break
            q = np.clip(q - value / size * row, robot.lower, robot.upper)


def _vector(column: Array) -> str:
    return "(" + ", ".join(fixed(value, 3) for value in column.tolist()) + ")"


def flipped(T: Array, row: int, column: int) -> float:
    """The largest entry of RᵀR − I if one entry of R is printed with the wrong sign."""
    R = T[:3, :3].copy()
    R[row, column] *= -1.0
    return float(np.abs(R.T @ R - np.eye(3)).max())
