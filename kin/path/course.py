"""What a path is searched in: its waypoints, and how motion between them is measured.

Motion is weighted, so that radians and metres can be compared. A step is a *jump* if the weighted motion of some
joint is larger than `max_step`; steps over several waypoints may be that many times as long. Waypoints without any
exact configuration (gaps) are left out of the course and filled in at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kin.ik import messages
from kin.ik.problem import Question
from kin.ik.results import IKResult
from kin.solvers.common import TURN
from kin.solvers.contract import POSITION
from kin.transforms import Array

GRID = math.radians(15.0)  # between samples of what is free, for 60 waypoints and more; down to half for fewer
WIDE = 2.0 * TURN + 1e-9  # travel above which a joint is a circle
_PRISMATIC_WEIGHT = 4.0  # radians that a metre of a sliding joint counts as
_PULL = 1e-6  # weight of the start's distance from home


def has_closed_form(question: Question) -> bool:
    """Whether a closed form answers the task; a lone point leaves too much free and is left to descents."""
    match = question.match
    return match is not None and question.code != POSITION and match.handles(question.code)


def is_sampled(question: Question) -> bool:
    """Whether layers are samples from the start; two free values are sampled only when there is need."""
    return has_closed_form(question) and len(question.freedoms) < 2


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """What is the same all along.

    Attributes:
        question: limits, task, where the arm is (its seed).
        weight, ring: ``(n,)`` weights of the joints, 2π for a joint that is followed as a circle, else 0.
        max_step: a weighted motion larger than this is a jump.
        pull: weight of the motion from the seed to the first waypoint.
        grid: radians between samples of what is free.
    """

    question: Question
    weight: Array
    ring: Array
    max_step: float
    pull: float
    grid: float

    @classmethod
    def of(cls, question: Question, max_step: float, started: bool, count: int) -> Way:
        """The way of a path of `count` waypoints; `started`: the arm is where the seed says."""
        wide = ~(question.upper - question.lower <= WIDE)
        return cls(
            question=question,
            weight=np.where(question.robot.revolute, 1.0, _PRISMATIC_WEIGHT),
            ring=np.where(question.robot.revolute & wide, TURN, 0.0),
            max_step=max_step,
            pull=1.0 if started else _PULL,
            grid=GRID * min(max(count / 60.0, 0.5), 1.0),
        )

    def moves(self, a: Array, b: Array) -> Array:
        """Weighted motion of each joint from a to b ``(..., n)``."""
        return np.asarray(np.abs(b - a) * self.weight)

    def farthest(self, a: Array, b: Array) -> float:
        """Weighted motion of the joint that goes farthest from a to b ``(n,)``."""
        return float(self.moves(a, b).max())

    def told(self, joint: int, move: float) -> str:
        """A weighted motion of a joint as its own, for a sentence."""
        return messages.joint_value(self.question.robot, joint, move / float(self.weight[joint]))

    def leaps(self, q: Array, spans: Sequence[int]) -> list[int]:
        """The steps of a path ``(s, n)`` that are jumps, by the index of their end."""
        allowed = self.max_step * (1.0 + 1e-9) * np.array(spans[1:])
        found: list[int] = (1 + np.flatnonzero(self.moves(q[:-1], q[1:]).max(axis=1) > allowed)).tolist()
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """A waypoint.

    Attributes:
        asked: the question as it was put.
        question: what the configurations meet: only point and approach direction where the roll is given up.
        layer: configurations to choose from ``(m, n)``, none in a gap.
        gap: why there is none.
    """

    asked: Question
    question: Question
    layer: Array
    gap: IKResult | None = None

    @property
    def relaxed(self) -> bool:
        """Whether the roll was given up."""
        return self.question.code != self.asked.code


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The waypoints that have a layer: their indices, and how many steps lie between each and the one before."""

    way: Way
    stops: list[Stop]
    at: list[int]
    spans: list[int]

    @classmethod
    def through(cls, way: Way, stops: list[Stop]) -> Course:
        """The course through those of all waypoints that have a layer."""
        at = [i for i, stop in enumerate(stops) if len(stop.layer)]
        return cls(way, [stops[i] for i in at], at, [1, *np.diff(at).tolist()])

    @property
    def free(self) -> bool:
        """Whether a finer grid of free values would be another one."""
        question = self.way.question
        return has_closed_form(question) and not all(freedom.rare for freedom in question.freedoms)

    def leaps(self, q: Array) -> list[int]:
        """The steps of a path ``(s, n)`` that are jumps, by the index of their end."""
        return self.way.leaps(q, self.spans)

    def rank(self, q: Array) -> tuple[int, float]:
        """Jumps and sum of squares of a path ``(s, n)``, the motion to its start included: what is minimised."""
        moves = self.way.moves(q[:-1], q[1:])
        start = self.way.moves(self.way.question.seed, q[0])
        cost = self.way.pull * (start**2).sum() + ((moves**2).sum(axis=1) / self.spans[1:]).sum()
        return len(self.leaps(q)), float(cost)
