"""What the lesson "Numeric IK" knows: the target, how it is approached, and the iterates that were found."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.lessons.numeric import basins, iteration
from app.viewer.lessons.numeric.basins import Basins
from app.viewer.lessons.numeric.iteration import METHODS, Match, Method, Problem, Run
from app.viewer.lessons.numeric.settings import LIMITS, Numbers, NumericSettings
from kin import Robot, fk, get_robot
from kin.transforms import Array

UNLIMITED = LIMITS[1] - 1e-4


@dataclass(frozen=True, eq=False)
class Iterated:
    """Iterations that have ended.

    Attributes:
        problem: the target that they were to reach.
        runs: method and iterates, the chosen method first.
    """

    problem: Problem
    runs: tuple[tuple[Method, Run], ...]

    @property
    def run(self) -> Run:
        """The iterates of the chosen method."""
        return self.runs[0][1]

    @property
    def solutions(self) -> Array | None:
        """All exact solutions ``(k, n)``; None if there are infinitely many."""
        return _solutions(self.problem)


@dataclass(frozen=True, eq=False)
class NumericFacts(Facts[NumericSettings]):
    """See the module."""

    @property
    def iterated(self) -> Iterated | None:
        """The iterations that have ended last; None: there are none yet."""
        found: Iterated | None = self.work("iterates").value
        return found

    @property
    def basins(self) -> Basins | None:
        """The picture of the starts, if it is complete."""
        found: Basins | None = self.work("basins").value
        return found

    @property
    def problem(self) -> Problem:
        """The target; the same object as long as it is the same."""
        return _problem(self.robot, self.settings.target, self.settings.match)

    @property
    def options(self) -> iteration.Settings:
        """How to iterate."""
        s = self.settings
        longest = math.inf if s.longest >= UNLIMITED else s.longest
        return iteration.Settings(s.method, s.damping, s.gain, longest, s.limits)

    @property
    def start(self) -> Array:
        """Where the iterations begin ``(n,)``."""
        return self.q if self.settings.start is None else np.array(self.settings.start)

    @property
    def number(self) -> int:
        """The number of the iterate on show."""
        count = 0 if self.iterated is None else self.iterated.run.count
        return count if self.settings.at is None else min(self.settings.at, count)

    @property
    def pictured(self) -> Problem:
        """The target in the picture of the basins: that of the arm with two joints, or of the built-in one."""
        return self.problem if self.is_mine else _builtin()

    @property
    def is_mine(self) -> bool:
        """Whether the basins of this arm can be drawn: two revolute joints that the target decides."""
        return self.robot.n == 2 and bool(self.robot.revolute.all()) and self.problem.is_finite

    def iterate(self) -> Iterator[Iterated | None]:
        """Run the chosen method, and the others if they are compared: None now and then, and the answer last."""
        chosen, found = self.settings.method, []
        for method in (chosen, *(m for m in METHODS if self.settings.compare and m != chosen)):
            for run in iteration.iterate(self.problem, self.options._replace(method=method), self.start):
                if run is not None:
                    found.append((method, run))
                else:
                    yield None
        yield Iterated(self.problem, tuple(found))


@lru_cache(maxsize=64)
def _problem(robot: Robot, target: Numbers, match: Match) -> Problem:
    return Problem(robot, np.array(target).reshape(4, 4), match)


@lru_cache(maxsize=64)
def _solutions(problem: Problem) -> Array | None:
    return basins.exact(problem) if problem.is_finite else None


@lru_cache(maxsize=1)
def _builtin() -> Problem:
    robot = get_robot("planar2r")
    return Problem(robot, fk(robot, robot.q_home), "point")
