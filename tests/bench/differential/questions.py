"""Random questions to inverse kinematics, the same for every source tree: they are made with NumPy alone.

The kinds take turns: question `number` is of kind ``number % len(KINDS)``. Many are at places where code is most
likely to be wrong: the boundary of the reach, singular configurations, joint limits.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

PATH_EVERY = 200  # questions; a path takes as long as some fifty targets
_PATH_POSES = 5
_QUARTER = 0.5 * math.pi


@dataclass(slots=True, eq=False)
class Question:
    """What one arm is asked.

    Attributes:
        robot: the arm.
        number: of the question.
        kind: the key of `KINDS`.
        rng: further random numbers.
        q: a configuration ``(n,)``, which the forward kinematics are asked for.
        target: of the inverse kinematics, ``(4, 4)`` or a point ``(3,)``.
        seed: of the inverse kinematics ``(n,)``.
        options: further keywords of `kin.solve_ik`.
    """

    robot: Any
    number: int
    kind: str
    rng: np.random.Generator
    q: np.ndarray
    seed: np.ndarray
    target: np.ndarray = field(default_factory=lambda: np.empty(0))
    options: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, robot: Any, number: int) -> Question:
        """Question `number` to an arm: the same numbers in every process."""
        kind = list(KINDS)[number % len(KINDS)]
        rng = np.random.default_rng([number, zlib.crc32(robot.id.encode())])
        question = cls(robot, number, kind, rng, configuration(robot, rng), configuration(robot, rng))
        KINDS[kind](question)
        if not question.target.size:
            question.target = pose(robot, question.q)
        return question

    def path(self) -> list[np.ndarray]:
        """Poses on the way from the seed to `q`, joint by joint."""
        return [pose(self.robot, self.seed + s * (self.q - self.seed)) for s in np.linspace(0.0, 1.0, _PATH_POSES)]

    def __str__(self) -> str:
        words = [f"{name}={value!r}" for name, value in self.options.items()]
        return f"{self.robot.id} {self.number} ({', '.join([self.kind, *words])})"


def bounds(robot: Any) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper limits ``(n,)``, ±π for a joint without."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    return lower, np.where(np.isfinite(robot.upper), robot.upper, math.pi)


def configuration(robot: Any, rng: np.random.Generator) -> np.ndarray:
    """A random configuration inside the limits ``(n,)``."""
    return rng.uniform(*bounds(robot))


def pose(robot: Any, q: np.ndarray) -> np.ndarray:
    """T_base_tool ``(4, 4)`` by plain matrix products, whatever the source tree computes."""
    T = np.array(robot.base)
    values = iter(q.tolist())
    for row in robot.rows:
        theta, d = row.theta, row.d
        if row.kind == "revolute":
            theta += next(values)
        elif row.kind == "prismatic":
            d += next(values)
        z, x = _screw(2, theta, d), _screw(0, row.alpha, row.a)
        T = T @ (z @ x if robot.convention == "standard" else x @ z)
    return T @ np.array(robot.tool)


def _screw(axis: int, angle: float, distance: float) -> np.ndarray:
    """A rotation about the axis x (0) or z (2) and a translation along it; exact at quarter turns."""
    c, s = (0.0 if abs(value) < 1e-15 else value for value in (math.cos(angle), math.sin(angle)))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T = np.eye(4)
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i], T[axis, 3] = -s, s, distance
    return T


def _clipped(asked: Question, q: np.ndarray) -> np.ndarray:
    return np.clip(q, *bounds(asked.robot))


def _typical(asked: Question) -> None:
    """A pose inside the limits."""


def _boundary(asked: Question) -> None:
    """The elbow is stretched, nearly or exactly; some targets are a little farther away or nearer."""
    n = asked.robot.n
    elbow = 3 if n == 7 else min(2, n - 1)
    asked.q[elbow] = asked.rng.choice([0.0, 1e-9, 1e-5, 1e-3, 1e-2]) * asked.rng.choice([-1, 1])
    asked.q = _clipped(asked, asked.q)
    asked.target = pose(asked.robot, asked.q)
    if asked.rng.random() < 0.5:
        asked.target[:3, 3] *= 1.0 + 1e-3 * asked.rng.normal()


def _singular(asked: Question) -> None:
    """Some joints at multiples of a quarter turn, exactly or nearly."""
    q, rng = asked.q, asked.rng
    q = np.where(rng.random(q.size) < 0.5, np.round(q / _QUARTER) * _QUARTER, q)
    asked.q = _clipped(asked, q + rng.choice([0.0, 1e-10, 1e-7, 1e-4]) * rng.normal(size=q.size))


def _at_limits(asked: Question) -> None:
    """Some joints at their limits; the seed is the answer or near it."""
    lower, upper = bounds(asked.robot)
    pick = asked.rng.integers(4, size=asked.q.size)
    asked.q = np.select([pick == 0, pick == 1], [lower, upper], asked.q)
    asked.seed = _clipped(asked, asked.q + asked.rng.choice([0.0, 1e-3]) * asked.rng.normal(size=asked.q.size))


def _seed_is_answer(asked: Question) -> None:
    asked.seed = asked.q.copy()


def _approach(asked: Question) -> None:
    asked.options["task"] = "approach"


def _position(asked: Question) -> None:
    asked.options["task"] = "position"
    asked.target = pose(asked.robot, asked.q)
    if asked.rng.random() < 0.5:
        asked.target = asked.target[:3, 3].copy()


def _locked(asked: Question) -> None:
    """One joint is locked, mostly where the target can be reached."""
    joint = int(asked.rng.integers(asked.robot.n))
    value = float((asked.q if asked.rng.random() < 0.8 else asked.seed)[joint])
    asked.options["locked"] = [value if i == joint else None for i in range(asked.robot.n)]


def _tolerances(asked: Question) -> None:
    asked.options |= {"position_tolerance": 1e-4, "rotation_tolerance": 1e-3}


def _narrow_limits(asked: Question) -> None:
    """Narrower limits, within which the target can be reached."""
    lower, upper = bounds(asked.robot)
    width = asked.rng.uniform(0.02, 0.6, lower.size) * np.minimum(upper - lower, 6.0)
    below = asked.rng.random(lower.size)
    low, high = np.maximum(lower, asked.q - below * width), np.minimum(upper, asked.q + (1.0 - below) * width)
    asked.options["limits"] = list(zip(low.tolist(), high.tolist(), strict=True))


def _moved_away(asked: Question) -> None:
    """A pose that is often out of reach."""
    asked.target = pose(asked.robot, asked.q)
    asked.target[:3, 3] += 0.3 * asked.rng.normal(size=3)


def _without_limits(asked: Question) -> None:
    _moved_away(asked)
    asked.options["respect_limits"] = False


def _all_images(asked: Question) -> None:
    asked.options |= {"images": "all", "prefer": str(asked.rng.choice(["nearest", "limits"]))}


def _manipulable(asked: Question) -> None:
    asked.options["prefer"] = "manipulability"


def _rounded(asked: Question) -> None:
    """A target of few digits."""
    asked.target = pose(asked.robot, asked.q).round(int(asked.rng.integers(4, 8)))


def _wide_apart(asked: Question) -> None:
    """Values beyond one turn."""
    turns = np.where(asked.robot.revolute, 2.0 * math.pi * asked.rng.integers(-1, 2, asked.q.size), 0.0)
    asked.q = asked.q + turns


KINDS: dict[str, Callable[[Question], None]] = {
    "typical": _typical,
    "boundary": _boundary,
    "singular": _singular,
    "at limits": _at_limits,
    "seed is the answer": _seed_is_answer,
    "approach": _approach,
    "position": _position,
    "locked": _locked,
    "tolerances": _tolerances,
    "narrow limits": _narrow_limits,
    "moved away": _moved_away,
    "without limits": _without_limits,
    "all images": _all_images,
    "manipulability": _manipulable,
    "rounded": _rounded,
    "several turns": _wide_apart,
}
