"""The registry of closed-form solvers: one module, one row each, in order of preference.

A solver module offers ``NAME``, ``TITLE``, ``PARAMETER`` (id and label of its redundancy parameter),
``match(robot)`` (its geometry, or None if the arm is of another family), ``handles(geometry, task)``,
``solve(geometry, problem) -> Candidates`` and ``branch_name(index, q)``. It never verifies, filters or sorts:
:mod:`kin.ik` does that once for all. Which family an arm belongs to is read off its axes, never off its name.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, Protocol, cast

from kin.robot import Robot
from kin.solvers import collinear7, srs7, wrist5
from kin.solvers.common import Candidates, Problem
from kin.transforms import Array


class Solver(Protocol):
    """What a solver module looks like from outside."""

    NAME: str
    TITLE: str
    PARAMETER: tuple[str, str]

    def match(self, robot: Robot) -> Any: ...

    def handles(self, geometry: Any, task: int) -> bool: ...

    def solve(self, geometry: Any, problem: Problem) -> Candidates: ...

    def branch_name(self, index: int, q: Array) -> str: ...


class Match(NamedTuple):
    """A solver together with the geometry it found in a robot."""

    solver: Solver
    geometry: Any


SOLVERS: tuple[Solver, ...] = tuple(cast(Solver, module) for module in (wrist5, srs7, collinear7))


@lru_cache(maxsize=256)
def solver_for(robot: Robot) -> Match | None:
    """The first registered closed form that fits the robot's axes, None if there is none."""
    for solver in SOLVERS:
        geometry = solver.match(robot)
        if geometry is not None:
            return Match(solver, geometry)
    return None
